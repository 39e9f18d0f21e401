"""The table by which `wsph advise` names a scheme: every alternative on one scene of each kind, on a ladder of rows.

    python tests/benchmarks/advice.py [--only KIND] [--write]

Of each alternative the error of the row that does WORK pair visits is found along the line through its rows (in logarithms),
with the order that they show; the least error is the advice. --write leaves wsph/accuracy/schemes/rules.json.
"""

import argparse
import json
import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import coverage_scenes as scenes
from coverage import true_errors

from wsph.accuracy.row import Halted
from wsph.accuracy.rows import Rows
from wsph.errors import WsphError

ROOT = Path(__file__).resolve().parents[2]
ROWS, RATIO = 5, 1.4
ALTERNATIVES = [
    {"integrator": "tsph", "formulation": "small-strain"},
    {"integrator": "leapfrog", "formulation": "stress-points"},
    {"integrator": "leapfrog", "formulation": "total-lagrangian"},
    {"integrator": "rk4", "formulation": "stress-points"},
    {"integrator": "lf4", "formulation": "stress-points"},
    {"integrator": "leapfrog", "formulation": "updated-lagrangian"},
    {"integrator": "leapfrog", "formulation": "stress-points", "precision": "f32"},
]


def plastic_strip() -> scenes.Case:
    """The plastic bar in 2D: plane stress without a Poisson's ratio."""
    bar = scenes._karman("plastic strip", "leapfrog", "total-lagrangian")
    data = bar.scene.data()
    data["dim"] = 2
    data["bodies"][0] |= {"shape": scenes._box(1.0, 0.25), "spacing": 1.0 / 20}
    data["boundary"][1]["fixed"] = ["x"]
    data["probes"][0]["at"] = [[0.25, 0.125]]
    return scenes.Case("plastic strip", "jumps", scenes.Scene(**data), bar.exact, 3e6)


KINDS: dict[str, tuple[str, Callable[[], scenes.Case], float]] = {
    "wave-1d": ("a wave with a front in a bar", lambda: scenes._shock("", "tsph"), 2e6),
    "plastic-1d": ("a plastic wave in a bar", lambda: scenes._karman("", "tsph"), 2e6),
    "smooth-1d": ("a bar that vibrates", lambda: scenes._vibrating("", "tsph"), 2e6),
    "smooth": ("a body that vibrates", lambda: scenes._lame(2, 1.0 / 12, 3e6), 2e6),
    "struck": ("a body that is loaded at once", scenes._pulled, 2e6),
    "plastic": ("a body that yields", plastic_strip, 2e6),
    "contact": ("bodies that meet", scenes._rods, 5e6),
}


def measured(case: scenes.Case, alternative: dict, work: float) -> dict | None:
    """An alternative on a scene; None where it does not take it."""
    data = case.scene.data()
    data["run"] |= {k: v for k, v in alternative.items() if k != "integrator"} | {
        "integrator": {"name": alternative["integrator"]}
    }
    data["run"]["cfl"] = "auto"
    if alternative["integrator"] == "tsph":
        for condition in data.get("boundary", []):
            if "traction" in condition and condition.get("face") == "+x":
                condition["stress"] = {"xx": condition.pop("traction")["x"]}
    errors, works, cells, n = [], [], [], 0
    try:
        rows = Rows(scenes.Scene(**data))
        n = rows.first
        while rows.costs.plan(n).work <= work and len(cells) < 3 * ROWS:
            row = rows.run(rows.lattices.scene_at(n), n, 0.0)
            errors.append(max(true_errors(case, row).values()))
            works.append(row.work)
            cells.append(n)
            n = rows.lattices.next(RATIO * n)
    except (WsphError, Halted) as error:
        print(f"    {alternative}: {str(error).splitlines()[0]}")
        return None
    if len(cells) < 3:
        return None
    last = slice(-ROWS, None)
    logs = np.log(np.array([works[last], cells[last], np.maximum(errors[last], 1e-12)]))
    by_work, by_cells = np.polyfit(logs[0], logs[2], 1), np.polyfit(logs[1], logs[2], 1)
    return {
        **alternative,
        "precision": alternative.get("precision", "f64"),
        "order": -float(by_cells[0]),
        "error": float(math.exp(np.polyval(by_work, math.log(work)))),
        "error_of_a_cell": float(math.exp(by_cells[1])),
        "cells": cells[-1],
    }


def main() -> None:
    """Measure, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", choices=["", *KINDS], help="this kind alone, the others as they were")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    path = ROOT / "wsph" / "accuracy" / "schemes" / "rules.json"
    kept = json.loads(path.read_text(encoding="utf-8")) if options.only else {}
    for kind, (words, make, work) in KINDS.items():
        if options.only not in ("", kind):
            continue
        case = replace(make(), floor=0.0)
        print(f"{kind}: {words}")
        found = [one for alternative in ALTERNATIVES if (one := measured(case, alternative, work))]
        found.sort(key=lambda one: one["error"])
        for one in found:
            print(f"    {one['integrator']} {one['formulation']} {one['precision']}: error {one['error']:.3g} at {work:.1g}, order {one['order']:.2f}", flush=True)  # fmt: skip
        kept[kind] = {"words": words, "work": work, "alternatives": found}
        if options.write:
            path.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
