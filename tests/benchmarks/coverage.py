"""How often the error bars of `--accuracy` hold, its tolerances are met, and what it costs: on scenes with closed forms.

    python tests/benchmarks/coverage.py [--only NAME] [--group GROUP] [--write]

Of every scene a dense ladder is run first, of which the true error of each row is known. Then the search runs at each
tolerance on those rows, with a limit on its work; it sees no answer. Counted are searches (met: the true error of what it
says is within the tolerance), bars where a search ended, and windows of three and four rows of the ladder in steps of 1.41
and 2; the total work over that of the cheapest row which, with all finer ones, is within the tolerance. --write leaves
docs/coverage.json for docs/make.py.
"""

import argparse
import json
import math
import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import coverage_round as round_bodies
import coverage_scenes as scenes
from coverage_lost import LOST
from coverage_scenes import Case

from wsph.accuracy.columns import aims, look
from wsph.accuracy.limits import Limit
from wsph.accuracy.measures import Record, distances, frequency
from wsph.accuracy.row import Row
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import search, seen_of

ROOT = Path(__file__).resolve().parents[2]
GROUPS = {
    "known": [*scenes.KNOWN, *round_bodies.KNOWN],
    "fresh": [*scenes.FRESH, *round_bodies.FRESH],
    "round": round_bodies.ROUND,
}
FINE, FINER = 20001, 50
"""Times at which an answer is compared: so many at least, and so many for each record of the row. Of a front that is a cell
wide fewer say less than the row does: 20001 made errors of 10000 cells wrong by a fifth, up and down."""
TOO_SMALL = 1e-6
"""True errors below this are rounding: a bar of zero holds there."""


class Kept(Rows):
    """Rows that are run once for all searches of a scene."""

    def __init__(self, case: Case, known: dict[int, Row]):
        super().__init__(case.scene)
        self._known = known

    def run(self, scene, cells, planned, progress=None, composed=None):
        if cells not in self._known:
            self._known[cells] = super().run(scene, cells, planned, progress, composed)
            self.spent -= self._known[cells].work
        self.spent += self._known[cells].work
        return self._known[cells]


def true_errors(case: Case, row: Row) -> dict[str, float]:
    """The error of a row by column."""
    if case.frequency is not None:
        errors = {name: abs(frequency(record) / case.frequency - 1.0) for name, record in row.records.items()}
        return {name: error if error > case.floor else 0.0 for name, error in errors.items()}
    found = {}
    for name, exact in case.exact.items():
        record = row.records[name]
        # Of jumps between two records the answer has more than they.
        count = max(FINE, FINER * len(record.times))
        times = np.union1d(record.times, np.linspace(record.times[0], record.times[-1], count))
        error = float(distances([Record(times, exact(times)), record])[0, 1])
        found[name] = error if error > case.floor else 0.0
    return found


def measured(case: Case) -> dict:
    """All figures of a scene."""
    started, known = time.process_time(), {}
    ladder = Kept(case, known)
    cells = ladder.first
    while ladder.costs.plan(cells).work <= case.work:
        ladder.run(ladder.lattices.scene_at(cells), cells, 0.0)
        cells = ladder.lattices.next(1.19 * cells)
    dense = [known[n] for n in sorted(known)]
    windows = [one for ratio in (2.0**0.5, 2.0) for one in _windows(case, ladder, dense, ratio)]
    searches = [_searched(case, known, tolerance) for tolerance in case.tolerances]
    for one in searches:
        one["cheapest"] = _cheapest(case, known, one["tolerance"])
    return {
        "name": case.name,
        "kind": case.kind,
        "formal": ladder.formal.order,
        "rows": [(row.cells, row.work, max(true_errors(case, row).values())) for row in dense],
        "windows": windows,
        "searches": searches,
        "cpu_seconds": time.process_time() - started,
    }


def _windows(case: Case, ladder: Rows, dense: list[Row], ratio: float):
    """What every window of four rows says, beside the truth."""
    for last in range(len(dense)):
        chosen = [dense[last]]
        for row in reversed(dense[:last]):
            if chosen[-1].cells >= 0.97 * ratio * row.cells and len(chosen) < 4:
                chosen.append(row)
        if len(chosen) < 4:
            continue
        asked, precision = aims(case.scene, 0.01), case.scene.run.precision
        seen = look([row.spacing for row in chosen], [row.records for row in chosen], asked, ladder.formal, precision)
        truth = true_errors(case, chosen[0])
        for name, each in seen.items():
            misfit = ladder.lattices.misfit(chosen[0].cells)
            yield {"converges": each.estimate.converges, "bar": each.estimate.bar + misfit, "true": truth[name]}


def _searched(case: Case, known: dict[int, Row], tolerance: float) -> dict:
    rows = Kept(case, known)
    found = search(rows, aims(case.scene, tolerance), Limit(None, case.limit * case.work))
    last = rows.made[-1] if rows.made else None
    truth = true_errors(case, last) if last is not None else {}
    seen = seen_of(rows, aims(case.scene, tolerance))
    misfit = rows.lattices.misfit(last.cells) if last is not None else 0.0
    bars = [
        {"bar": each.estimate.bar + misfit, "true": truth[name]}
        for name, each in seen.items()
        if each.estimate.converges
    ]
    return {
        "tolerance": tolerance,
        "status": found.status,
        "cells": [row.cells for row in rows.made],
        "true": max(truth.values(), default=math.nan),
        "estimate": max((each.estimate.error for each in seen.values()), default=math.nan),
        "total": rows.spent,
        "first_work": rows.made[min(2, len(rows.made) - 1)].work if rows.made else 0.0,
        "bars": bars,
    }


def _cheapest(case: Case, known: dict[int, Row], tolerance: float) -> float | None:
    """The work of the coarsest row which with all finer ones is within a tolerance."""
    best = None
    for cells in sorted(known, reverse=True):
        if max(true_errors(case, known[cells]).values()) > tolerance:
            break
        best = known[cells].work
    return best


def lost(case: Case) -> dict:
    """Whether a search sees that a scene does not converge."""
    found = _searched_lost(case)
    print(f"{case.name}: {found['status']}: {found['why']}", flush=True)
    return found


def _searched_lost(case: Case) -> dict:
    rows = Rows(case.scene)
    found = search(rows, aims(case.scene, case.tolerances[0]), Limit(None, case.limit * case.work))
    return {"name": case.name, "status": found.status, "why": found.why, "cells": [row.cells for row in rows.made]}


def summary(cases: list[dict]) -> dict:
    """The figures over scenes."""
    searches = [(case, one) for case in cases for one in case["searches"]]
    by_tolerance, by_kind = {}, {}
    for tolerance in (0.05, 0.01, 0.002):
        mine = [(case, one) for case, one in searches if one["tolerance"] == tolerance]
        by_tolerance[f"{100 * tolerance:g} %"] = _figures(mine)
    for kind in dict.fromkeys(case["kind"] for case in cases):
        mine = [case for case in cases if case["kind"] == kind]
        by_kind[kind] = _figures([(case, one) for case in mine for one in case["searches"]]) | _of_windows(mine)
    return {"tolerances": by_tolerance, "kinds": by_kind, "all": _figures(searches) | _of_windows(cases)}


def _figures(searches: list) -> dict:
    answers = [one for _, one in searches if one["status"] == "met"]
    bars = [bar for _, one in searches for bar in one["bars"]]
    costs = [
        one["total"] / one["cheapest"] for one in answers if one["cheapest"] and one["cheapest"] > one["first_work"]
    ]
    return {
        "searches": len(searches),
        "answers": len(answers),
        "met": sum(one["true"] <= one["tolerance"] for one in answers),
        "bars": len(bars),
        "bars_hold": sum(_holds(bar) for bar in bars),
        "width": _median([bar["bar"] / bar["true"] for bar in bars if bar["true"] > TOO_SMALL]),
        "cost": _median(costs),
        "false_alarms": sum(one["status"] == "no convergence" for _, one in searches),
    }


def _of_windows(cases: list[dict]) -> dict:
    """Of the windows of scenes; the width is the median over scenes of their own medians."""
    each = [
        case if "windows" not in case or isinstance(case["windows"], int) else _of_scene(case["windows"])
        for case in cases
    ]
    sums = {key: sum(one[key] for one in each) for key in ("windows", "flagged", "windows_given", "windows_hold")}
    return sums | {"windows_width": _median([one["windows_width"] for one in each if one["windows_width"]])}


def _of_scene(windows: list[dict]) -> dict:
    given = [one for one in windows if one["converges"]]
    return {
        "windows": len(windows),
        "flagged": len(windows) - len(given),
        "windows_given": len(given),
        "windows_hold": sum(_holds(one) for one in given),
        "windows_width": _median([one["bar"] / one["true"] for one in given if one["true"] > TOO_SMALL]),
    }


def _holds(bar: dict) -> bool:
    return bar["true"] <= max(bar["bar"], TOO_SMALL)


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def told(case: dict) -> str:
    """A scene in a line, and one a search."""
    w = _of_windows([case])
    lines = [
        f"{case['name']} ({case['kind']}, formal {case['formal']:g}): {len(case['rows'])} rows, error {case['rows'][0][2]:.2g} to"
        f" {case['rows'][-1][2]:.2g}; windows hold {w['windows_hold']}/{w['windows_given']}, width {w['windows_width'] or 0:.2g},"
        f" flagged {w['flagged']}; {case['cpu_seconds']:.1f} CPU s"
    ]
    for one in case["searches"]:
        cost = f"{one['total'] / one['cheapest']:.2g}" if one["cheapest"] else "-"
        bad = " BAR" if not all(map(_holds, one["bars"])) else ""
        miss = " MISS" if one["status"] == "met" and one["true"] > one["tolerance"] else ""
        lines.append(
            f"    {100 * one['tolerance']:g} %: {one['status']}, true {100 * one['true']:.2g} %, estimate {100 * one['estimate']:.2g} %, cost"
            f" {cost}, {one['cells']}{bad}{miss}"
        )
    return "\n".join(lines)


def main() -> None:
    """Run, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--only", default="", metavar="NAME", help="scenes whose name has this in it, the others as they were"
    )
    parser.add_argument("--group", default="", choices=["", *GROUPS], help="these alone, the others as they were")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    path = ROOT / "docs" / "coverage.json"
    alone = options.only or options.group
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    cases, missed = (kept["scenes"], kept["lost"]) if alone and kept else ([], [])
    tables = {key: kept[key] for key in ("budgets", "seconds") if key in kept}
    for group, makers in GROUPS.items():
        for make in makers:
            case = make()
            if options.only not in case.name or options.group not in ("", group):
                continue
            cases = [one for one in cases if one["name"] != case.name]
            found = measured(case) | {"group": group}
            cases.append(found)
            print(told(found), flush=True)
            if options.write:
                keep(cases, missed, tables)
    for case in (make() for make in LOST):
        if options.only in case.name and not options.group:
            missed = [*(one for one in missed if one["name"] != case.name), lost(case)]
    print(json.dumps(summary(cases), indent=1))
    if options.write:
        keep(cases, missed, tables)


def keep(cases: list[dict], missed: list[dict], tables: dict) -> None:
    """Write docs/coverage.json; anew after every scene."""
    path = ROOT / "docs" / "coverage.json"
    whole: dict = {"lost": missed, "summary": summary(cases)} | tables
    for group in GROUPS:
        whole[f"summary_{group}"] = summary([case for case in cases if case["group"] == group])
    whole["scenes"] = [{k: v for k, v in case.items() if k != "windows"} | _of_windows([case]) for case in cases]
    path.write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
