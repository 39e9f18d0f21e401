"""The answer of a search: what is written beside the output of its finest row, accuracy.json."""

# pyright: strict

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wsph.accuracy.columns import Aim, Seen, judged, widened, worst
from wsph.accuracy.envelope import FLOOR, KEEP
from wsph.accuracy.measures import distances
from wsph.accuracy.row import Halted
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import Found
from wsph.accuracy.values import value, values
from wsph.output.files import ACCURACY, finite_or_none, write_text
from wsph.quantities import Table
from wsph.simulation.result import Result

FOLLOWS = 1.2
"""Time step over spacing, of the last rows, that differ by more than this: the time step is not of the ladder."""

SECOND_ORDER = 4.0 / 3.0
"""The error of a time step over its difference to half of it, of second order."""


@dataclass(frozen=True)
class Answer:
    """How accurate an answer is: `status` "met", "no convergence", "out of reach", "refused" or "interrupted"; `data` as
    accuracy.json has it; `result` of the finest row, None where there is none."""

    status: str
    data: Table
    result: Result | None

    @property
    def why(self) -> str:
        """In words."""
        return str(self.data["why"])


def answer(
    rows: Rows, asked: Mapping[str, Aim], found: Found, tolerance: float | None, limit: Table, notes: list[str]
) -> Answer:
    """The answer of a search that ended with `found`. `notes` join the reasons."""
    seen = found.seen
    made = rows.made
    if seen:
        terms = _time_term(rows, seen) if found.status != "interrupted" else {}
        single = FLOOR["f32"] if rows.scene.run.precision == "f32" else 0.0
        others = rows.lattices.misfit(made[-1].cells) + single
        seen = widened(seen, {name: terms.get(name, 0.0) + others for name in seen})
    zero = judged(made[-1].records, asked)[1] if made else []
    why = [found.why, *notes, *([f"zero by symmetry, not judged: {', '.join(zero)}"] if zero else [])]
    data: Table = {
        "status": found.status,
        "tolerance": tolerance,
        "limit": limit,
        **(_figures(seen[worst(seen)]) if seen else {"estimate": None, "bar": None, "order": None}),
        "formal_order": str(rows.formal),
        "columns": {name: _column(each) | value(name, each, made) for name, each in seen.items()},
        "rows": [row.data() | more for row, more in zip(made, values(made, seen), strict=True)],
        "chosen": made[-1].cells if made else None,
        "total_work": rows.spent,
        "why": "; ".join(why),
    }
    return Answer(found.status, data, made[-1].result if made else None)


def write(data: Table, folder: Path) -> None:
    """Write accuracy.json."""
    write_text(folder / ACCURACY, json.dumps(data, indent=2, ensure_ascii=False) + "\n")


def _time_term(rows: Rows, seen: Mapping[str, Seen]) -> dict[str, float]:
    """The error of a time step that does not follow the spacing, which rows do not show: by a coarse row with half of it,
    infinite where that is not made."""
    last = rows.made[-KEEP:]
    ratios = [row.result.scene.end / row.steps / row.spacing for row in last]
    if max(ratios) <= FOLLOWS * min(ratios):
        return {}
    coarse = last[0]
    rows.tell("the time step does not follow the spacing: a coarse row again with half of it")
    half = rows.lattices.scene_at(coarse.cells).with_(dt=0.5 * coarse.result.summary["dt"])
    try:
        again = rows.run(half, coarse.cells, 2.0 * coarse.work)
    except (Halted, KeyboardInterrupt):
        return dict.fromkeys(seen, math.inf)
    found: dict[str, float] = {}
    for name, each in seen.items():
        pair = [coarse.records[name], again.records[name]]
        found[name] = SECOND_ORDER * float(distances(pair, each.aim.quantity, each.aim.scale)[0, 1])
    return found


def _figures(each: Seen) -> Table:
    found = each.estimate
    return {
        "estimate": finite_or_none(found.error),
        "bar": finite_or_none(found.bar),
        "order": finite_or_none(found.order),
    }


def _column(each: Seen) -> Table:
    aim = each.aim
    asked: Table = {"quantity": aim.quantity, "tolerance": aim.tolerance, "scale": aim.scale}
    return _figures(each) | {"order_seen": finite_or_none(each.estimate.seen)} | asked
