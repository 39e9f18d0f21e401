"""The most accurate answer that a budget pays for, with its bar.

A coarse row tells what work, and what setting up, takes in seconds. Then the largest lattice n is sought that the budget
pays for together with rows of n/2.83 and n/2 before it, and the coarsest of these is made; after each row n is found anew,
by what rows were found to take. One coarse row alone predicts too long, so that a search that knows little plans too small a
lattice, never too large a one; and a row that takes longer than was thought is ended before it goes beyond the budget: the
answer is then the one before.
"""

# pyright: strict

from collections.abc import Mapping, Sequence

from wsph.accuracy.columns import Aim
from wsph.accuracy.envelope import FEWEST
from wsph.accuracy.limits import SHARE, SHARE_OF_SECONDS, Limit
from wsph.accuracy.row import Halted, Late
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import Found, seen_of
from wsph.accuracy.values import check_periods
from wsph.errors import Refused, SceneError

COARSER = {2.0 * 2.0**0.5: 1.5, 2.0: 1.1}
"""The finest lattice over those of the rows before it; and by how much each of them has to be finer than the last row's."""

WORTH = 1.1
"""The same of the finest: a lattice that is finer by less is not worth a run."""

NEAR = 0.98
"""The next lattice that is tried where one is not paid for, over that."""

AGAIN = 1.3
"""The same of a run after the finest that was planned, where it took less than was thought."""

DEAR = 0.04
"""The part of a budget's seconds from which another row like the last is left out that only the bar would be better for."""


def spend(rows: Rows, asked: Mapping[str, Aim], limit: Limit) -> Found:
    """Make the finest row that the budget pays for, and coarser ones for its bar."""
    try:
        if limit.cost(rows, rows.costs.plan(rows.first)) > _left(rows, limit):
            return Found(
                "out of reach",
                f"{limit} pays for no row: the coarsest has {rows.costs.plan(rows.first).work:.3g} pair visits",
            )
        check_periods(rows.make(rows.first), asked)
        finest = False
        while True:
            cells, finest = _next(rows, limit, AGAIN if finest else WORTH)
            if not cells:
                break
            try:
                rows.make(cells)
            except Late as late:
                rows.tell(str(late))
    except Halted as halt:
        return Found(halt.status, str(halt), seen_of(rows, asked))
    except KeyboardInterrupt:
        return Found("interrupted", "interrupted between two runs", seen_of(rows, asked))
    except (SceneError, Refused) as error:
        if not rows.made:
            raise
        return Found("met", f"a finer lattice is refused: {str(error).splitlines()[0]}", seen_of(rows, asked))
    if len(rows.made) < FEWEST:
        return Found("met", f"the finest row that {limit} pays for; no bar: it allows no ladder", {})
    seen = seen_of(rows, asked)
    lost = [name for name, each in seen.items() if not each.estimate.converges]
    if lost:
        return Found(
            "no convergence", f"the finest row that {limit} pays for; no convergence of {', '.join(lost)}", seen
        )
    return Found("met", f"the finest row that {limit} pays for, with coarser ones for its bar", seen)


def _next(rows: Rows, limit: Limit, worth: float) -> tuple[int, bool]:
    """The next lattice to be made, and whether it is the finest that is paid for; 0 where none is that is finer than the
    last by what is `worth` a run."""
    last, parts, least = rows.made[-1].cells, list(COARSER), COARSER | {1.0: worth}
    if limit.seconds is not None and limit.cost(rows, rows.scaled(last)) > DEAR * limit.seconds:
        parts = parts[1:]
    for part in (*parts, 1.0):
        to_come = [each for each in parts if each <= part]
        if cells := _affordable(rows, limit, part, to_come, least[part] * last):
            return cells, part == 1.0
    return 0, True


def _affordable(rows: Rows, limit: Limit, part: float, to_come: Sequence[float], least: float) -> int:
    """The lattice of the finest one over `part` that is paid for, by its own plan; 0 where it has not the `least` cells."""
    costs = rows.costs
    cells = rows.lattices.below(_finest(rows, limit, to_come) / part)
    while cells >= least:
        # Setting it up for its plan takes time of the budget.
        cost = limit.cost(rows, costs.plan(cells), composed=costs.holds(cells))
        left = _left(rows, limit)
        if cost <= left:
            return cells
        by = 1.0
        if limit.seconds is not None:
            by = max((left - costs.taken.get(cells, 0.0)) / cost, 0.0) ** (1.0 / (rows.scene.dim + 1))
        cells = rows.lattices.below(min(NEAR * by * cells, cells - 0.5))
    return 0


def _left(rows: Rows, limit: Limit) -> float:
    """What is left of the part of a budget that is planned with: work is known beforehand but where steps get shorter."""
    if limit.seconds is not None:
        return limit.left(rows, SHARE_OF_SECONDS)
    return limit.left(rows, SHARE if rows.costs.plan(rows.first).shrinks else 1.0)


def _finest(rows: Rows, limit: Limit, to_come: Sequence[float]) -> float:
    """The cells of the finest lattice that is paid for, with those rows before it that are still `to_come`, by the cells of
    the finest over theirs."""
    last = rows.made[-1]
    low, high = float(last.cells), 1e4 * last.cells
    for _ in range(60):
        cells = (low * high) ** 0.5
        plans = [rows.scaled(cells / each) for each in (*to_come, 1.0)]
        if sum(limit.cost(rows, each) for each in plans) <= _left(rows, limit):
            low = cells
        else:
            high = cells
    return low
