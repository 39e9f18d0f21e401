"""`wsph run`: run a scene."""

# pyright: strict

import argparse
import warnings
from pathlib import Path

from wsph.cli import accuracy
from wsph.cli.command import Command
from wsph.cli.options import declare_out, declare_set, folder_of, overrides
from wsph.cli.progress import Progress

OUT = ("scene", "out")
"""What the output folder is called after, and its ending."""


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path)
    declare_out(parser, *OUT)
    declare_set(parser)
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the folder")
    parser.add_argument("--overwrite", action="store_true", help="replace an earlier run in the folder")
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    accuracy.add_options(parser)


def _act(options: argparse.Namespace) -> int:
    from wsph import load, run
    from wsph.backend.domain import WHOLE, failing_together
    from wsph.ranks import world
    from wsph.study.cluster import MPI

    if options.scheduler not in (None, MPI):
        world.refuse_copies("wsph run --scheduler")
    domain = world.domain() if options.scheduler is None else WHOLE
    if domain.rank > 0:
        warnings.simplefilter("ignore")
    with failing_together(domain):
        scene = load(options.scene, overrides(options.set))
    folder = folder_of(options, *OUT)
    searched = accuracy.asked(options)
    with Progress(options.quiet or domain.rank > 0) as progress:
        if searched:
            return accuracy.run_accurately(options, scene, folder, progress, domain)
        result = run(
            scene,
            folder,
            overwrite=options.overwrite,
            resume=options.resume,
            throw=False,
            progress=progress,
            domain=domain,
        )
    if not options.quiet and domain.rank == 0:
        s = result.summary
        print(
            f"{result.status}: {s['steps']} steps of {s['dt']:.4g} s, {s['particles']} particles, {s['wall_seconds']:.2f} s; output in {folder}"
        )
        for finding in s["findings"]:
            print(f"finding: {finding}")
    if result.failure is not None:
        raise result.failure
    return 130 if result.status == "interrupted" else 0


RUN = Command("run", "run a scene", _declare, _act)
