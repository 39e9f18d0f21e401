"""The most accurate answer that a budget pays for, with its bar.

A coarse row tells what work takes in seconds. Then the largest lattice n is sought that the budget pays for together
with rows of n/2.83 and n/2 before it; after each of these n is found anew, by what rows were found to take. One coarse row
alone predicts too long, so that a search that knows little plans too small a lattice, never too large a one.
"""

# pyright: strict

from collections.abc import Mapping

from wsph.accuracy.columns import Aim
from wsph.accuracy.envelope import FEWEST
from wsph.accuracy.limits import SHARE, Limit
from wsph.accuracy.row import Halted
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import Found, seen_of
from wsph.accuracy.values import check_periods
from wsph.errors import Refused, SceneError

COARSER = (2.0 * 2.0**0.5, 2.0)
"""The finest lattice over those of the rows before it."""

WORTH = 1.1
"""A lattice that is finer by less than this than the last row's is not worth a run."""

NEAR = 0.98
"""The next lattice that is tried where one is not paid for, over that."""

AGAIN = 1.3
"""The same of a run after the finest that was planned, where it took less than was thought."""


def spend(rows: Rows, asked: Mapping[str, Aim], limit: Limit) -> Found:
    """Make the finest row that the budget pays for, and coarser ones for its bar."""
    try:
        if limit.cost(rows, rows.costs.plan(rows.first)) > _left(rows, limit):
            return Found(
                "out of reach",
                f"{limit} pays for no row: the coarsest has {rows.costs.plan(rows.first).work:.3g} pair visits",
            )
        check_periods(rows.make(rows.first), asked)
        for part in (*COARSER, 1.0):
            if (cells := _affordable(rows, limit, part)) >= WORTH * rows.made[-1].cells:
                rows.make(cells)
        while (cells := _affordable(rows, limit, 1.0)) >= AGAIN * rows.made[-1].cells:
            rows.make(cells)
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


def _affordable(rows: Rows, limit: Limit, part: float) -> int:
    """The lattice of the finest one over `part` that is paid for, by its own plan; 0 where none finer than the last is."""
    cells = rows.lattices.below(_finest(rows, limit, part) / part)
    while cells > rows.made[-1].cells:
        # Setting it up for its plan has taken time of the budget.
        if limit.cost(rows, rows.costs.plan(cells)) <= _left(rows, limit):
            return cells
        cells = rows.lattices.below(min(NEAR * cells, cells - 0.5))
    return 0


def _left(rows: Rows, limit: Limit) -> float:
    """What is left of the part of a budget that is planned with: work is known beforehand but where steps get shorter."""
    known = limit.seconds is None and not rows.costs.plan(rows.first).shrinks
    return limit.left(rows, 1.0 if known else SHARE)


def _finest(rows: Rows, limit: Limit, part: float) -> float:
    """The cells of the finest lattice that is paid for, with those rows before it that `part` says are still to be made."""
    to_come = [1.0 / each for each in COARSER if each <= part]
    last = rows.made[-1]
    low, high = float(last.cells), 1e4 * last.cells
    for _ in range(60):
        cells = (low * high) ** 0.5
        plans = [rows.scaled(cells * each) for each in (*to_come, 1.0)]
        if sum(limit.cost(rows, each) for each in plans) <= _left(rows, limit):
            low = cells
        else:
            high = cells
    return low
