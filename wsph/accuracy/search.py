"""The search for a tolerance: up the ladder of a scene's lattices until the estimate of the finest row is within it.

Three rows with 1, 1.41 and 2 times the coarsest cells first; then, by the order that the four finest show, the lattice that
should be fine enough, at most twice as fine as the last. It ends where the estimate is within the tolerance, where four
rows show no convergence, or before a row that would go beyond the limit, with what is reachable within it.
"""

# pyright: strict

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from wsph.accuracy.columns import Aim, Seen, look, worst
from wsph.accuracy.envelope import BAR, FEWEST, KEEP, boundless
from wsph.accuracy.limits import Limit
from wsph.accuracy.row import Halted, in_seconds
from wsph.accuracy.rows import Rows
from wsph.accuracy.values import check_periods
from wsph.errors import Refused, SceneError

SAFE = 1.1
"""The estimate times this is to be within the tolerance: met in 98 %."""

FARTHEST, NEAREST = 2.0, 2.0**0.25
"""The next lattice over the last."""

START = (1.0, 2.0**0.5, 2.0)
"""Cells of the first rows over those of the coarsest."""

ROUNDS = 8
"""Rows after the first three at most."""

UNKNOWN = 0.5
"""An estimate of the finest of four rows from which nothing is extrapolated: one row more is made before a search is ended
for what it would take. So it is wherever the formal order is one: four rows that do not converge may fall by chance."""

AREA = {1: "", 2: "m", 3: "m2"}
"""The unit of an area of cracks, by the dimension."""

UNLIKE = 0.35
"""Difference of the two finest rows from which, where no finer one can be had, they have not been seen to converge: rows
that have nothing in common but the range of their values differ by 0.5 to 1.3."""


@dataclass
class Found:
    """How a search ended: `status`, and `why` in words; the answer is the last row, of which `seen` says what by column."""

    status: str
    why: str
    seen: Mapping[str, Seen] = field(default_factory=dict[str, Seen])


def seen_of(rows: Rows, asked: Mapping[str, Aim], most: int = KEEP) -> dict[str, Seen]:
    """What the four finest rows say of the finest, or a smaller number of them."""
    last = rows.made[: -most - 1 : -1]
    if len(last) < FEWEST:
        return {}
    spacings = [row.spacing for row in last]
    return look(spacings, [row.records for row in last], asked, rows.formal, rows.scene.run.precision, torn(rows))


def torn(rows: Rows) -> bool:
    """Whether cracks have more area in every finer one of the four finest rows, by more and more: what breaks at a strain or
    a stress of a point comes to pieces as small as its cells (Bazant & Oh 1983)."""
    last = rows.made[: -KEEP - 1 : -1]
    return boundless([row.spacing for row in last], [row.result.crack_area for row in last])


def search(rows: Rows, asked: Mapping[str, Aim], limit: Limit, sure: bool = False) -> Found:
    """Make rows until their finest is within the tolerances."""
    factor = BAR if sure else SAFE
    try:
        begun = rows.ahead(rows.lattices.scene_at(cells) for cells in _affordable(rows, limit))
        for number, cells in enumerate(_starts(rows)):
            # A row that runs already is ended where it runs, when it is late.
            awaited = number < begun and limit.seconds is not None
            if not awaited and (refusal := _refusal(rows, limit, cells, {}, factor)) is not None:
                return refusal
            check_periods(rows.make(cells), asked)
        for _ in range(ROUNDS):
            seen = seen_of(rows, asked)
            if not seen:
                return Found("refused", "no column has a size: give the probes a scale", seen)
            ended = _ended(rows, asked, seen, factor)
            if ended is not None:
                return ended
            cells, wanted = _next(rows, seen, factor)
            if (refusal := _refusal(rows, limit, cells, seen, factor, wanted)) is not None:
                return refusal
            rows.make(cells)
        seen = seen_of(rows, asked)
        return _unlike(rows, seen) or Found("out of reach", f"{len(rows.made)} rows have not met it", seen)
    except Halted as halt:
        return Found(halt.status, str(halt), seen_of(rows, asked))
    except KeyboardInterrupt:
        return Found("interrupted", "interrupted between two runs", seen_of(rows, asked))
    except (SceneError, Refused) as error:
        if not rows.made:
            raise
        return Found("out of reach", f"a finer lattice is refused: {str(error).splitlines()[0]}", seen_of(rows, asked))


def _starts(rows: Rows) -> Iterator[int]:
    """The first lattices."""
    cells = 0
    for start in START:
        cells = rows.lattices.next(max(start * rows.first, cells + 0.5))
        yield cells


def _affordable(rows: Rows, limit: Limit) -> Iterator[int]:
    """Those of the first lattices that the limit pays for by their plans, which is all that is known before any has run."""
    left = limit.left(rows)
    with suppress(SceneError, Refused):  # which is said when its turn comes
        for cells in _starts(rows):
            left -= limit.cost(rows, rows.costs.plan(cells))
            if left < 0.0:
                return
            yield cells


def _ended(rows: Rows, asked: Mapping[str, Aim], seen: Mapping[str, Seen], factor: float) -> Found | None:
    """The end of a search where its rows say so."""
    within = _within(seen, factor) and _borne_out(rows, asked, factor)
    whole = len(rows.made) >= KEEP or not any(each.estimate.clamped for each in seen.values())
    lost = [name for name, each in seen.items() if not each.estimate.converges]
    if within and whole and not lost:
        return Found("met", f"{factor:g} times the estimate is within the tolerance of every column", seen)
    if len(rows.made) > KEEP and lost:
        return _lost(rows, seen, lost)
    return None


def _within(seen: Mapping[str, Seen], factor: float) -> bool:
    return all(factor * each.share <= 1.0 for each in seen.values())


def _borne_out(rows: Rows, asked: Mapping[str, Aim], factor: float) -> bool:
    """Whether what the first four rows say is said by the three finest of them as well. Where something jumps the coarsest
    may be so coarse that differences from it are of another order, which all four then seem to have."""
    if rows.formal.order == 2.0 or len(rows.made) > KEEP:
        return True
    return len(rows.made) == KEEP and _within(seen_of(rows, asked, FEWEST), factor)


def _lost(rows: Rows, seen: Mapping[str, Seen], lost: list[str]) -> Found:
    """The end of a search that sees no convergence of some columns."""
    words = "; ".join(f"{name}: {', '.join(f'{d:.2g}' for d in seen[name].estimate.differences)}" for name in lost)
    cracks = ""
    if torn(rows):
        areas = ", ".join(f"{row.result.crack_area:.2g}" for row in rows.made[: -KEEP - 1 : -1])
        cracks = f"; every finer lattice has more area of cracks, {areas} {AREA[rows.scene.dim]}".rstrip()
    return Found(
        "no convergence",
        f"no convergence observed, differences of neighbours from the finest on: {words}{cracks}; no bar",
        seen,
    )


def _unlike(rows: Rows, seen: Mapping[str, Seen]) -> Found | None:
    """The end of a search that can have no finer row, and whose two finest are of one range and else unlike."""
    lost = [name for name, each in seen.items() if each.estimate.differences[0] > UNLIKE]
    if len(rows.made) <= KEEP or not lost:
        return None
    return _lost(rows, {name: each.lost if name in lost else each for name, each in seen.items()}, lost)


def _next(rows: Rows, seen: Mapping[str, Seen], factor: float) -> tuple[int, float]:
    """The next lattice, and the cells that should be enough."""
    last = rows.made[-1].cells
    wanted = max(last * _finer(each, factor) for each in seen.values())
    target = max(min(wanted, FARTHEST * last), NEAREST * last)
    return rows.lattices.next(target), wanted


def _finer(each: Seen, factor: float) -> float:
    """How many times as fine a lattice has to be for a column."""
    if not np.isfinite(each.estimate.error):
        return FARTHEST
    return (factor * each.share) ** (1.0 / each.estimate.order) if each.share > 0.0 else 0.0


def _refusal(
    rows: Rows, limit: Limit, cells: int, seen: Mapping[str, Seen], factor: float, wanted: float = 0.0
) -> Found | None:
    """The end of a search whose next row, or the one that is wanted, is beyond the limit."""
    left = limit.left(rows)
    # Where no convergence is seen yet what is wanted says nothing: one row more will tell.
    sees = bool(seen) and len(rows.made) >= KEEP and all(each.estimate.converges for each in seen.values())
    trusts = rows.formal.order == 2.0 and max((each.estimate.error for each in seen.values()), default=0.0) < UNKNOWN
    sees = sees and (len(rows.made) > KEEP or trusts)
    far = sees and limit.cost(rows, rows.scaled(wanted)) > left
    if limit.cost(rows, rows.costs.plan(cells)) <= left and not far:
        return None
    if not seen:
        return Found("out of reach", f"{limit} allows no ladder: the row with {cells} cells is beyond it", seen)
    if (lost := _unlike(rows, seen)) is not None:
        return lost
    plan, last = rows.scaled(max(cells, wanted)), rows.made[-1]
    reach = last.cells * max(left / limit.cost(rows, rows.scaled(last.cells)), 0.0) ** (1.0 / (rows.scene.dim + 1))
    name = worst(seen)
    each = seen[name].estimate
    reachable = each.error * min(last.cells / max(reach, 1.0), 1.0) ** each.order
    why = (
        f"{name} within {100.0 * seen[name].aim.tolerance:g} % needs about {max(cells, round(wanted))} cells, {plan.work:.2g} pair"
        f" visits, {in_seconds(rows.rate.seconds(plan))}; within {limit} expect {100.0 * factor * reachable:.2g} %"
    )
    return Found("out of reach", why, seen)
