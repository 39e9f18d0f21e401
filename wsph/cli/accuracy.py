"""`wsph run SCENE --accuracy 1%` and `--budget "30 s"`: the options, what is printed, and the exit code."""

# pyright: strict

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from wsph.cli.options import declare_scheduler
from wsph.errors import WsphError

if TYPE_CHECKING:
    # What a search needs is imported by it: the command line starts without.
    from wsph.accuracy.report import Answer
    from wsph.backend.domain import Domain
    from wsph.scene.scene import Scene
    from wsph.simulation.run import Progress

T = TypeVar("T")

MET, MISSED, INTERRUPTED = 0, 4, 130
"""Exit codes."""


def add_options(run: argparse.ArgumentParser) -> None:
    """The options of `wsph run` that ask for an accuracy."""
    run.add_argument(
        "--accuracy",
        nargs="?",
        const="",
        metavar="TOLERANCE",
        help="search for a spacing with which the probes are within it, e.g. 1%% (default: that of [accuracy])",
    )
    run.add_argument(
        "--budget", metavar="LIMIT", help='what that may cost, or alone what to spend: "30 s", or pair visits'
    )
    run.add_argument(
        "--sure", action="store_true", help="the whole error bar within the tolerance, not the estimate alone"
    )
    run.add_argument("--check", action="store_true", help="ask another scheme whether it agrees")
    declare_scheduler(run)


def asked(options: argparse.Namespace) -> bool:
    """Whether the options ask for an accuracy. Raises WsphError for those that go with it alone."""
    if options.accuracy is not None or options.budget is not None:
        if options.resume:
            raise WsphError("--resume: a search begins anew; leave out --accuracy and --budget to go on with a run")
        return True
    if options.scheduler is not None:
        raise WsphError(
            "--scheduler goes with --accuracy or --budget, whose rows are many runs: one run is of one place"
        )
    alone = [name for name in ("sure", "check") if getattr(options, name)]
    if alone:
        raise WsphError(f"--{alone[0]} goes with --accuracy or --budget")
    return False


def run_accurately(
    options: argparse.Namespace, scene: "Scene", folder: Path, progress: "Progress | None", domain: "Domain"
) -> int:
    """Search, print, and return the exit code; of processes that share the rows the first does."""
    from wsph.accuracy.accurate import accurate
    from wsph.accuracy.limits import Limit
    from wsph.accuracy.running.together import follow
    from wsph.scene.outputs import read_tolerance
    from wsph.study.cluster import executor_at

    tolerance = _read("accuracy", options.accuracy, read_tolerance) if options.accuracy else None
    limit = _read("budget", options.budget, Limit.read) if options.budget is not None else None
    tell = None if options.quiet else _say
    if domain.rank > 0:
        follow(domain)
        return MET
    with executor_at(options.scheduler) as executor:
        found = accurate(
            scene,
            folder,
            tolerance=tolerance,
            limit=limit,
            sure=options.sure or None,
            check=options.check,
            overwrite=options.overwrite,
            tell=tell,
            progress=progress,
            domain=domain,
            executor=executor,
        )
    if not options.quiet:
        for line in told(found, folder):
            print(line)
    return INTERRUPTED if found.status == "interrupted" else MET if found.status == "met" else MISSED


def _read(option: str, text: str, read: Callable[[str], T]) -> T:
    """What an option says. Raises WsphError that names the option."""
    try:
        return read(text)
    except ValueError as error:
        raise WsphError(f"--{option}: {error}") from None


def told(found: "Answer", folder: Path) -> list[str]:
    """The answer in lines."""
    from wsph.quantities import is_list, is_table

    data = found.data
    lines: list[str] = []
    columns = data["columns"]
    for name, each in columns.items() if is_table(columns) else ():
        if is_table(each):
            what = f"{name} {each['words'] or each['quantity']}"
            lines.append(
                f"{what}: error about {_percent(each['estimate'])}, bar {_percent(each['bar'])}, order {_number(each['order'])}"
            )
    rows = data["rows"]
    count = len(rows) if is_list(rows) else 0
    kept = (
        f"; the row with {data['chosen']} cells is in {folder}" if found.result is not None else "; nothing was written"
    )
    lines.append(f"{found.status}: {found.why}")
    lines.append(f"{count} rows, {_number(data['total_work'])} pair visits{kept}")
    return lines


def _percent(value: object) -> str:
    return f"{100.0 * value:.2g} %" if isinstance(value, float) else "none"


def _number(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, (float, int)) else "none"


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
