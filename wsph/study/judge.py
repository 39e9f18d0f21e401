"""What the rows of a study say of each other's errors: estimates with bars, and variants that disagree.

Rows that differ in their spacing alone are a ladder. The envelope of its four finest rows gives the error E of the finest
and a bar on it. A coarser row k, which differs from the finest by D, has an estimate of D + E, and by the triangle
inequality a bar of D + bar: its true error lies between D - bar and D + bar. All are relative L1 differences of histories,
by column; a row has the largest of its columns.
"""

# pyright: strict

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from wsph.accuracy.columns import Aim, Seen, look
from wsph.accuracy.envelope import KEEP, boundless, disagree
from wsph.accuracy.measures import Record, distances
from wsph.accuracy.planning.formal import formal_order
from wsph.scene.scene import Scene
from wsph.study.plan import Planned
from wsph.study.rows import Made

NO_CONVERGENCE = "no convergence"

_TOO_FEW = f"no bar: {KEEP} rows of other spacings are needed"


@dataclass(frozen=True)
class Ladder:
    """Completed rows that differ in their spacing alone, by their numbers, finest first. `columns` by PROBE.COLUMN, empty
    where there are too few rows."""

    name: str
    rows: tuple[int, ...]
    columns: dict[str, Seen]

    @property
    def converges(self) -> bool:
        """Whether all of its columns do."""
        return all(each.estimate.converges for each in self.columns.values())


def judged(plan: Sequence[Planned], made: Mapping[int, Made]) -> list[Ladder]:
    """Give the rows what they say of each other: `estimate`, `bar`, `order` as seen, `convergence` and `disagrees`, in words
    and empty where there is nothing to say. Returns the ladders."""
    ladders = _ladders(plan, made)
    for ladder in ladders:
        _tell(ladder, made)
    for one, other in combinations(ladders, 2):
        if _disagree(one, other, made):
            for this, that in ((one, other), (other, one)):
                for place in this.rows:
                    said = made[place].row["disagrees"]
                    made[place].row["disagrees"] = f"{said}; {that.name}" if said else f"disagrees with {that.name}"
    return ladders


def _ladders(plan: Sequence[Planned], made: Mapping[int, Made]) -> list[Ladder]:
    groups: dict[str, list[int]] = {}
    for place, each in enumerate(plan):
        if place in made and made[place].series and each.spacing is not None:
            groups.setdefault(each.ladder, []).append(place)
    found: list[Ladder] = []
    for name, places in groups.items():
        rows = sorted(places, key=lambda k: plan[k].spacing or 0.0)
        spacings = [plan[k].spacing or 0.0 for k in rows]
        enough = len(rows) >= KEEP and len(set(spacings)) == len(rows)
        columns = _columns([made[k] for k in rows], spacings, plan[rows[0]].scene) if enough else {}
        found.append(Ladder(name, tuple(rows), columns))
    return found


def _columns(rows: Sequence[Made], spacings: Sequence[float], scene: Scene) -> dict[str, Seen]:
    records = [{name: Record(*series) for name, series in made.series.items()} for made in rows]
    asked = {name.rpartition(".")[0]: Aim(0.0, "history", None) for name in records[0]}
    torn = boundless(spacings, [float(made.row.get("crack_area") or 0.0) for made in rows])
    return look(spacings, records, asked, formal_order(scene), scene.run.precision, torn)


def _record(made: Made, name: str) -> Record:
    return Record(*made.series[name])


def _tell(ladder: Ladder, made: Mapping[int, Made]) -> None:
    columns = ladder.columns.values()
    for number, place in enumerate(ladder.rows):
        row = made[place].row
        row |= {"estimate": None, "bar": None, "order": None, "convergence": "", "disagrees": ""}
        if not columns:
            row["convergence"] = _TOO_FEW
            continue
        row["order"] = min((each.estimate.seen for each in columns if math.isfinite(each.estimate.seen)), default=None)
        if not ladder.converges:
            wrong = [name for name, each in ladder.columns.items() if not each.estimate.converges]
            row["convergence"] = NO_CONVERGENCE + (f" of {', '.join(wrong)}" if len(ladder.columns) > 1 else "")
            continue
        row["estimate"] = max(float(each.apart[number]) + each.estimate.error for each in columns)
        row["bar"] = max(float(each.apart[number]) + each.estimate.bar for each in columns)


def _disagree(one: Ladder, other: Ladder, made: Mapping[int, Made]) -> bool:
    """Whether the finest rows of two ladders with bars differ by more than those allow, in a column."""
    if not (one.converges and other.converges):
        return False
    for name in one.columns.keys() & other.columns.keys():
        apart = distances([_record(made[ladder.rows[0]], name) for ladder in (one, other)])[0, 1]
        if disagree(one.columns[name].estimate.bar, other.columns[name].estimate.bar, float(apart)):
            return True
    return False
