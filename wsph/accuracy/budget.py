"""The most accurate answer that a budget pays for, with its bar.

Rows before the finest are there for its bar, and to tell what it will take. The nearer is to cost a tenth of the finest at
most, the other a thirtieth, and they are as fine as that leaves them, with at most a half and a third of its cells: rows of
a fixed part of its cells would cost another part of it in every dimension, and where steps cost the same however few
particles they have, as small ones do in seconds, most of the budget. After each row what is paid for is found anew, by what
rows were found to take. One coarse row alone predicts too long, so that a search that knows little plans too small a
lattice, never too large a one; and a row that takes longer than was thought is ended before it goes beyond the budget: what
is left is then spent on a coarser one, or the answer is the one before."""

# pyright: strict

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from wsph.accuracy.columns import Aim
from wsph.accuracy.envelope import FEWEST
from wsph.accuracy.limits import SHARE, Limit
from wsph.accuracy.row import Halted, Late
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import Found, seen_of
from wsph.accuracy.values import check_periods
from wsph.errors import Refused, SceneError

BEFORE = ((2.0, 0.1, 1.2), (2.0**0.5, 0.03, 1.5))
"""Of the rows before the finest, the nearer first: cells of the next finer row over its own at least, its cost over that of
the finest at most, and by how much it has to be finer than the last row."""

WORTH = 1.1
"""The last of these of the finest: a lattice that is finer by less is not worth a run."""

NEAR = 0.98
"""The next lattice that is tried where one is not paid for, over that."""

LARGER = 1.08
"""The same of a lattice in favour of which the finest is ended, where its first steps take less than was thought."""

LOST = 0.1
"""The part of a budget's seconds that may be lost with rows that were ended so."""

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
        finest, lost_seconds = False, 0.0
        while True:
            cells, finest = _next(rows, limit, AGAIN if finest else WORTH)
            if not cells:
                break
            again = finest and not rows.costs.plan(cells).shrinks and lost_seconds < LOST * (limit.seconds or 0.0)
            rows.due = replace(limit.due, larger=LARGER ** (rows.scene.dim + 1) if again else math.inf)
            try:
                rows.make(cells)
            except Late as late:
                lost_seconds += late.row.wall_seconds if late.early else 0.0
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
    finest = _finest(rows, limit)
    last = rows.made[-1].cells
    if finest < worth * last:
        return 0, True
    for cells, least in _before(rows, limit, finest):
        if found := _affordable(rows, limit, cells, least):
            return found, False
    return _affordable(rows, limit, finest, worth * last), True


def _before(rows: Rows, limit: Limit, finest: float) -> list[tuple[float, float]]:
    """The cells of rows to come before the finest, coarsest first, and those that they have to have, but for rows that are
    hardly finer than the last."""
    most, cost, last = finest, limit.cost(rows, rows.scaled(finest)), float(rows.made[-1].cells)
    found: list[tuple[float, float]] = []
    for finer, share, least in BEFORE:
        most = _solved(lambda cells: limit.cost(rows, rows.scaled(cells)), share * cost, last, most / finer)
        if most >= least * last:
            found.insert(0, (most, least * last))
    return found


def _finest(rows: Rows, limit: Limit) -> float:
    """The cells of the finest lattice that is paid for, with those rows that are still to come before it; 0 where none
    is."""

    def cost(cells: float) -> float:
        before = [each for each, _ in _before(rows, limit, cells)]
        return sum(limit.cost(rows, rows.scaled(each)) for each in (cells, *before))

    last = float(rows.made[-1].cells)
    return _solved(cost, _left(rows, limit), last, 1e4 * last)


def _solved(cost: Callable[[float], float], most: float, low: float, high: float) -> float:
    """The cells between two numbers that cost the `most`, which is less than those of `high` do; 0 where `low` costs
    more."""
    if high < low or cost(low) > most:
        return 0.0
    for _ in range(20):
        cells = (low * high) ** 0.5
        low, high = (cells, high) if cost(cells) <= most else (low, cells)
    return low


def _affordable(rows: Rows, limit: Limit, most: float, least: float) -> int:
    """The finest lattice of at most so many cells that is paid for, by its own plan; 0 where it has not the `least`."""
    costs = rows.costs
    cells = rows.lattices.below(most)
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
    sure = limit.seconds is None and not rows.costs.plan(rows.first).shrinks
    return limit.left(rows, 1.0 if sure else SHARE)
