"""How accurate `--budget` is: the error of what it finds beside that of the best row of the ladder that the budget pays for.

    python tests/benchmarks/coverage_budgets.py [--only NAME] [--write]     budgets in work, which are the same everywhere
    python tests/benchmarks/coverage_budgets.py --seconds [--only NAME]     in seconds, on a machine that does nothing else:
                                                                            some six minutes
    python tests/benchmarks/coverage_budgets.py --cpu [--only NAME]         the same in CPU seconds of this process, on one
                                                                            that others use too
    python tests/benchmarks/coverage_budgets.py --replay [--only NAME]      the logic alone, on a clock that is made up, with
                                                                            rows that take what they took when --seconds
                                                                            --write was last run, and with scatter of it

--write puts the table of work, or that of seconds with the rows that were timed, into docs/coverage.json for docs/make.py.
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
import coverage_round as round_bodies
import coverage_scenes as scenes
from coverage import Kept, true_errors
from coverage_clock import replayed, timed, whole
from coverage_scenes import Case

from wsph.accuracy.accurate import accurate
from wsph.accuracy.budget import spend
from wsph.accuracy.columns import aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.row import Row

COVERAGE = Path(__file__).resolve().parents[2] / "docs" / "coverage.json"
PARTS = (1.0, 0.5, 0.2, 0.1, 0.05)
"""Budgets over the work of the scene's largest row."""
SECONDS = (2.0, 5.0, 10.0)
OVER, NEAR = 1.05, 1.3
"""Seconds used over those given at which a budget counts as exceeded; error over the best row's that is asked at most."""
SCATTER, SEEDS = 0.04, 5
"""Of the seconds of a row in a replay, in logarithms; replays of every budget with it."""
CASES: list[Callable[[], Case]] = [
    lambda: scenes._shock("shock bar, Taylor-SPH", "tsph"),
    lambda: scenes._vibrating("vibrating bar, leapfrog", "leapfrog", "stress-points"),
    lambda: scenes._push("smooth push, Taylor-SPH", "tsph"),
    scenes._struck,
    lambda: round_bodies._disc("breathing disc, fitted", "fitted", "fitted", 2.0 / 12, 8e6),
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
        seen = spend(rows, aims(case.scene, 0.01), Limit(None, budget)).seen
        errors, misfit = true_errors(case, rows.made[-1]), rows.lattices.misfit(rows.made[-1].cells)
        error = max(errors.values())
        bars = {name: each.estimate.bar + misfit for name, each in seen.items()}
        best = min(error for work, error in dense if work <= budget)
        found.append(
            {
                "budget": budget,
                "used": rows.spent / budget,
                "error": error,
                "best": best,
                "over_best": max(error, case.floor) / max(best, case.floor),
                "bar_holds": all(max(errors[name], case.floor) <= max(bars[name], case.floor) for name in bars),
                "cells": [row.cells for row in rows.made],
            }
        )
    return found


def seconds(only: str) -> dict[str, dict]:
    """Budgets in seconds, beside the best row that takes no longer by itself; every scene once before, so that its kernels
    are compiled."""
    begun, table = time.perf_counter(), {}
    for case in (case for case in (make() for make in CASES) if only in case.name):
        accurate(case.scene, limit=Limit(SECONDS[0]))
        dense = timed(case, SECONDS[-1])
        found = [_within(case, given, dense) for given in SECONDS]
        table[case.name] = {"rows": dense, "budgets": [one for one in found if one]}
    _told_of([one for each in table.values() for one in each["budgets"]])
    print(f"took {time.perf_counter() - begun:.0f} s")
    return table


def _within(case: Case, given: float, dense: list[dict]) -> dict:
    """What a budget of seconds finds; empty where it is no row."""
    started = time.perf_counter()
    answer = accurate(case.scene, limit=Limit(given))
    used = (time.perf_counter() - started) / given
    if answer.result is None:
        print(f"{case.name}: {given:g} s, {answer.why}", flush=True)
        return {}
    errors = true_errors(case, Row(answer.data["chosen"], 0.0, 0.0, 0.0, 0.0, answer.result))
    bars = {name: each["bar"] for name, each in answer.data["columns"].items()}
    hold = all(bars[name] is None or max(errors[name], case.floor) <= max(bars[name], case.floor) for name in bars)
    rows = answer.data["rows"]
    one = _one(given, used, max(*errors.values(), case.floor), dense) | {"bar_holds": hold}
    one |= {"cells": [row["cells"] for row in rows], "wall": [round(row["wall_seconds"], 3) for row in rows]}
    print(
        f"{case.name}: {given:g} s, used {100 * used:.0f} %, error {one['error']:.2g}, over the best that fits"
        f" {one['over_best']:.2f}{'' if hold else ', NOT WITHIN ITS BAR'}, {_in_words(one)}",
        flush=True,
    )
    return one


def _one(given: float, used: float, error: float, dense: list[dict]) -> dict:
    best = min(row["error"] for row in dense if whole(row) <= given)
    return {"budget": given, "used": used, "error": error, "over_best": error / best}


def _in_words(one: dict) -> str:
    return " ".join(f"{cells}:{wall:.2f} s" for cells, wall in zip(one["cells"], one["wall"], strict=True))


def _told_of(every: list[dict]) -> None:
    """Budgets of seconds in a line."""
    ratios, exceeded = [one["over_best"] for one in every], sum(one["used"] > OVER for one in every)
    print(
        f"{exceeded} of {len(every)} budgets exceeded by more than {100 * OVER - 100:.0f} %; error over that of the best row that"
        f" fits {np.median(ratios):.2f} in the median, {max(ratios):.2f} at most, within {NEAR:g} in"
        f" {sum(each <= NEAR for each in ratios)} of {len(ratios)}"
        + (f"; bars hold in {sum(one['bar_holds'] for one in every)}" if "bar_holds" in every[0] else "")
    )


def replay(only: str, kept: dict[str, dict]) -> None:
    """What the search does with rows that were timed, without and with scatter of what they take."""
    plain, scattered = [], []
    for case in (case for case in (make() for make in CASES) if only in case.name and case.name in kept):
        dense = kept[case.name]["rows"]
        for given in SECONDS:
            for seed in range(SEEDS + 1):
                found = replayed(case, dense, given, SCATTER if seed else 0.0, seed)
                one = _one(given, found["used"], found["error"], dense) | found
                (scattered if seed else plain).append(one)
                if not seed:
                    print(
                        f"{case.name}: {given:g} s, used {100 * one['used']:.0f} %, over the best that fits {one['over_best']:.2f},"
                        f" {_in_words(one)}"
                    )
    _told_of(plain)
    print(f"with a scatter of {100 * SCATTER:g} %: ", end="")
    _told_of(scattered)


def main() -> None:
    """Run, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="NAME", help="scenes whose name has this in it")
    parser.add_argument("--seconds", action="store_true")
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("--replay", action="store_true")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.cpu:
        time.perf_counter = time.process_time  # by which searches, runs and this table are timed
    if options.replay:
        kept = json.loads(COVERAGE.read_text(encoding="utf-8")).get("seconds", {})
        if not kept:
            parser.error(f"no rows were timed yet: --seconds --write leaves them in {COVERAGE}")
        replay(options.only, kept)
        return
    if options.seconds or options.cpu:
        found = seconds(options.only)
        if options.write:
            keep("seconds", found)
        return
    table = {case.name: spent(case) for case in (make() for make in CASES) if options.only in case.name}
    for name, each in table.items():
        for one in each:
            print(
                f"{name}: {one['budget']:.2g}, used {100 * one['used']:.0f} %, error {one['error']:.2g}, over the best that"
                f" fits {one['over_best']:.2f}, {one['cells']}{'' if one['bar_holds'] else ', NOT WITHIN ITS BAR'}"
            )
    every = [one for each in table.values() for one in each]
    ratios = [one["over_best"] for one in every]
    print(
        f"{len(every)} budgets: {np.median(ratios):.2f} times the error of the best row that fits in the median,"
        f" {np.quantile(ratios, 0.9):.2f} in nine of ten, {max(ratios):.2f} at most, within {NEAR:g} in"
        f" {sum(each <= NEAR for each in ratios)}; {sum(one['used'] > 1.0 for one in every)} exceeded; bars hold in"
        f" {sum(one['bar_holds'] for one in every)}"
    )
    if options.write:
        keep("budgets", table)


def keep(key: str, table: dict) -> None:
    """Put a table into docs/coverage.json; scenes that are not in it stay."""
    kept = json.loads(COVERAGE.read_text(encoding="utf-8"))
    kept[key] = kept.get(key, {}) | table
    COVERAGE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
