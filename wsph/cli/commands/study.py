"""`wsph study`: run a grid of overrides over a scene: cost and error of each."""

# pyright: strict

import argparse
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from wsph.cli.command import Command
from wsph.cli.options import declare_out, declare_workers, folder_of

if TYPE_CHECKING:
    from wsph.study.rows import Made, Row

OUT = ("study", "out")
"""What the output folder is called after, and its ending."""


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", type=Path)
    declare_out(parser, *OUT)
    declare_workers(parser)
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="make only the rows that the folder does not have")
    again.add_argument("--overwrite", action="store_true", help="replace an earlier study in the folder")
    again.add_argument(
        "--dry-run",
        action="store_true",
        help="print what every row will take, and run nothing; by the rows that the folder has",
    )


def _act(options: argparse.Namespace) -> int:
    # 1 where rows are lost.
    from wsph.output.claim import Claim
    from wsph.ranks.world import refuse_copies
    from wsph.study import files
    from wsph.study.cluster import MPI, executor_at
    from wsph.study.forecast import in_words
    from wsph.study.judge import judged
    from wsph.study.plan import facts, planned
    from wsph.study.runs import run_study
    from wsph.study.tables import load_study

    if options.scheduler != MPI:
        refuse_copies("wsph study")
    study, scene = load_study(options.study)
    beside, plan = options.study.parent, planned(study, scene)
    warnings.simplefilter("ignore")  # of energy that some of the rows create or lose: the table says it
    folder, names = folder_of(options, *OUT), [row.name for row in plan]
    if options.dry_run:
        there: dict[int, Made] = {}
        if files.is_a_study(folder):
            try:
                there = files.known_rows(folder, facts(study, plan, beside), names)
            except files.OtherRow as error:
                print(f"the rows in {folder} tell nothing: {error.why}")
        for line in in_words(plan, there):
            print(line)
        return 0
    with Claim(folder, options.overwrite, options.resume, files.STUDY) as claim:
        of = facts(study, plan, beside)
        made = files.known_rows(folder, of, names) if options.resume else {}
        anew = not made

        def keep(place: int, one: "Made") -> None:
            nonlocal anew
            claim.make()
            if anew:
                files.clear(folder)
            anew, made[place] = False, one
            files.keep_row(folder, one, of[place])
            files.keep_rows(folder, made, of, names, study.title)
            if sys.stderr.isatty():
                print(f"{len(made)} of {len(plan)}", file=sys.stderr)

        try:
            with executor_at(options.scheduler) as executor:
                where = beside.resolve()
                outcome = run_study(study, scene, where, executor, workers=options.workers, known=made, keep=keep)
        except KeyboardInterrupt:
            if not files.is_a_study(folder):
                raise
            print(f"error: interrupted; rows that are complete are in {folder}: go on with --resume", file=sys.stderr)
            return 130
        claim.make()
        judged(plan, outcome.made)
        files.keep_rows(folder, outcome.made, of, names, study.title)
        files.write_table(outcome.rows, folder)
        files.draw(outcome.rows, study.title, folder)
    for place in sorted(outcome.made):
        print(f"{names[place]}: {_in_words(outcome.made[place].row)}")
    print(f"{len(outcome.made)} runs; study.csv, study.json in {folder}")
    for place, why in sorted(outcome.lost.items()):
        print(f"error: row {names[place]!r} is lost: {why}; --resume makes it", file=sys.stderr)
    return 1 if outcome.lost else 0


def _in_words(row: "Row") -> str:
    """A row's figures."""
    words = [str(row["status"]), f"{row.get('right_hand_sides', '-')} right-hand sides"]
    if row.get("error") is not None:
        over = row.get("compared", "whole run")
        words.append(f"error {row['error']:.3g}" + (f" ({over})" if over != "whole run" else ""))
    if row.get("bar") is not None:
        words.append(f"estimate {row['estimate']:.3g}, bar {row['bar']:.3g}, order {row['order']:.2g}")
    words += [str(row[key]) for key in ("convergence", "disagrees") if row.get(key)]
    return ", ".join(words)


STUDY = Command("study", "run a grid of overrides over a scene: cost and error of each", _declare, _act)
