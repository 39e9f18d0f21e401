"""`wsph study`: run a grid of overrides over a scene: cost and error of each."""

# pyright: strict

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wsph.cli.command import Command

if TYPE_CHECKING:
    from wsph.study.runs import Row


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", type=Path)
    parser.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="output folder (default: the study's name with -out)"
    )
    parser.add_argument(
        "--workers", type=_count, default=0, metavar="N", help="processes to spread the runs over (default: one a core)"
    )
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="make only the rows that the folder does not have")
    again.add_argument("--overwrite", action="store_true", help="replace an earlier study in the folder")


def _act(options: argparse.Namespace) -> int:
    from wsph.output.claim import Claim
    from wsph.study import files
    from wsph.study.runs import digests, run_study
    from wsph.study.tables import load_study

    study, scene = load_study(options.study)
    folder = options.out if options.out is not None else Path(f"{options.study.stem}-out")
    warnings.simplefilter("ignore")  # of energy that some of the rows create or lose: the table says it
    with Claim(folder, options.overwrite, options.resume, files.is_a_study) as claim:
        of = digests(study, scene, options.study.parent)
        known = files.known_rows(folder, of) if options.resume else None

        def keep(rows: "Sequence[Row | None]") -> None:
            claim.make()
            if known is None and sum(row is not None for row in rows) == 1:
                files.clear(folder)
            files.keep_rows(rows, of, study, folder)

        try:
            rows = run_study(study, scene, options.study.parent, _told, options.workers, known=known, keep=keep)
        except KeyboardInterrupt:
            if not files.is_a_study(folder):
                raise
            print(f"error: interrupted; rows that are complete are in {folder}: go on with --resume", file=sys.stderr)
            return 130
        claim.make()
        files.write_study(rows, study, folder)
    for row in rows:
        place = ", ".join(f"{key} = {row[key]}" for key in study.grid)
        figures = f"{row.get('right_hand_sides', '-')} right-hand sides, error {row.get('error', float('nan')):.3g}"
        over = f" ({row['compared']})" if row.get("compared", "whole run") != "whole run" else ""
        print(f"{row['variant']}: {place}: {row['status']}, {figures}{over}")
    print(f"{len(rows)} runs; study.csv, study.json in {folder}")
    return 0


def _told(done: int, of: int) -> None:
    """How far a study is, on a terminal."""
    if sys.stderr.isatty():
        print(f"{done} of {of}", file=sys.stderr)


def _count(text: str) -> int:
    """A number of processes, 0 for one a core."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)


STUDY = Command("study", "run a grid of overrides over a scene: cost and error of each", _declare, _act)
