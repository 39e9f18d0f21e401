"""How accurate `--budget` is: the error of what it finds beside that of the best row of the ladder that the budget pays for.

    python tests/benchmarks/coverage_budgets.py [--only NAME] [--write]     budgets in work, which are the same everywhere
    python tests/benchmarks/coverage_budgets.py --seconds [--only NAME]     in seconds, on a machine that does nothing else:
                                                                            some six minutes
    python tests/benchmarks/coverage_budgets.py --cpu [--only NAME]         the same in CPU seconds of this process, on one
                                                                            that others use too

--write puts the table of work into docs/coverage.json for docs/make.py.
"""

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import coverage_scenes as scenes
from coverage import Kept, true_errors
from coverage_scenes import Case

from wsph.accuracy.accurate import accurate
from wsph.accuracy.budget import spend
from wsph.accuracy.columns import aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.row import Row

ROOT = Path(__file__).resolve().parents[2]
PARTS = (1.0, 0.5, 0.2, 0.1, 0.05)
"""Budgets over the work of the scene's largest row."""
SECONDS = (2.0, 5.0, 10.0)
OVER, NEAR = 1.05, 1.3
"""Seconds used over those given at which a budget counts as exceeded; error over the best row's that is asked at most."""
DENSE = 1.25
"""Cells of a row over those of the one before, of the rows that are timed."""
CASES: list[Callable[[], Case]] = [
    lambda: scenes._shock("shock bar, Taylor-SPH", "tsph"),
    lambda: scenes._vibrating("vibrating bar, leapfrog", "leapfrog", "stress-points"),
    lambda: scenes._push("smooth push, Taylor-SPH", "tsph"),
    scenes._struck,
    lambda: scenes._disc("breathing disc, fitted", "fitted", "fitted", 2.0 / 12, 8e6),
    lambda: scenes._lame(2, 1.0 / 12, 8e6),
    scenes._cavity,
]


def spent(case: Case) -> list[dict]:
    """What each budget of work finds on a scene."""
    known: dict[int, Row] = {}
    ladder = Kept(case, known)
    cells = ladder.first
    while ladder.costs.plan(cells).work <= case.work:
        ladder.run(ladder.lattices.scene_at(cells), cells, 0.0)
        cells = ladder.lattices.next(1.19 * cells)
    dense = [(row.work, max(true_errors(case, row).values())) for row in known.values()]
    found: list[dict] = []
    for part in PARTS:
        rows, budget = Kept(case, known), part * case.work
        spend(rows, aims(case.scene, 0.01), Limit(None, budget))
        error = max(true_errors(case, rows.made[-1]).values())
        best = min(error for work, error in dense if work <= budget)
        found.append(
            {
                "budget": budget,
                "used": rows.spent / budget,
                "error": error,
                "best": best,
                "over_best": max(error, case.floor) / max(best, case.floor),
                "cells": [row.cells for row in rows.made],
            }
        )
    return found


def seconds(only: str) -> None:
    """Budgets in seconds, beside the best row that takes no longer by itself; every scene once before, so that its kernels
    are compiled."""
    begun, exceeded, ratios = time.perf_counter(), 0, []
    cases = [case for case in (make() for make in CASES) if only in case.name]
    for case in cases:
        accurate(case.scene, limit=Limit(SECONDS[0]))
        dense = _timed(case)
        for given in SECONDS:
            started = time.perf_counter()
            answer = accurate(case.scene, limit=Limit(given))
            used = (time.perf_counter() - started) / given
            exceeded += used > OVER
            if answer.result is None:
                print(f"{case.name}: {given:g} s, {answer.why}", flush=True)
                continue
            error = max(true_errors(case, Row(answer.data["chosen"], 0.0, 0.0, 0.0, 0.0, answer.result)).values())
            best = min(error for wall, error in dense if wall <= given)
            ratios.append(max(error, case.floor) / max(best, case.floor))
            print(
                f"{case.name}: {given:g} s, used {100 * used:.0f} %, {answer.data['chosen']} cells, error {error:.2g}, over the best"
                f" that fits {ratios[-1]:.2f}",
                flush=True,
            )
    print(
        f"{exceeded} of {len(cases) * len(SECONDS)} budgets exceeded by more than {100 * OVER - 100:.0f} %; error over that of the"
        f" best row that fits {np.median(ratios):.2f} in the median, {max(ratios):.2f} at most, within {NEAR:g} in"
        f" {sum(each <= NEAR for each in ratios)} of {len(ratios)}; took {time.perf_counter() - begun:.0f} s"
    )


def _timed(case: Case) -> list[tuple[float, float]]:
    """Seconds and errors of rows, up to those that take longer than the largest budget."""
    rows = Kept(case, {})
    found, cells, wall = [], rows.first, 0.0
    while wall * DENSE ** (case.scene.dim + 1) < SECONDS[-1]:
        row = rows.run(rows.lattices.scene_at(cells), cells, 0.0)
        wall = row.wall_seconds
        found.append((wall, max(true_errors(case, row).values())))
        cells = rows.lattices.next(max(DENSE * cells, cells + 0.5))
    return found


def main() -> None:
    """Run, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="NAME", help="scenes whose name has this in it")
    parser.add_argument("--seconds", action="store_true")
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.cpu:
        time.perf_counter = time.process_time  # by which searches, runs and this table are timed
    if options.seconds or options.cpu:
        seconds(options.only)
        return
    table = {case.name: spent(case) for case in (make() for make in CASES) if options.only in case.name}
    for name, each in table.items():
        for one in each:
            print(
                f"{name}: {one['budget']:.2g}, used {100 * one['used']:.0f} %, error {one['error']:.2g}, over the best that"
                f" fits {one['over_best']:.2f}, {one['cells']}"
            )
    every = [one for each in table.values() for one in each]
    ratios = [one["over_best"] for one in every]
    print(
        f"{len(every)} budgets: {np.median(ratios):.2f} times the error of the best row that fits in the median,"
        f" {np.quantile(ratios, 0.9):.2f} in nine of ten, {max(ratios):.2f} at most, within {NEAR:g} in"
        f" {sum(each <= NEAR for each in ratios)}; {sum(one['used'] > 1.0 for one in every)} exceeded"
    )
    if options.write:
        path = ROOT / "docs" / "coverage.json"
        kept = json.loads(path.read_text(encoding="utf-8")) | {"budgets": table}
        path.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
