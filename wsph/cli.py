"""The command line: run, check, list, study, validate, view.

Exit codes: 0 completed; 1 a published case that does not come out as it should, or a failure of the machine (memory,
disk); 2 bad input (a faulty scene, a refused composition, an unusable folder); 3 unstable; 130 interrupted.
"""

# pyright: strict

import argparse
import json
import os
import signal
import sys
import tomllib
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wsph.errors import Unstable, WsphError, is_out_of_memory

LONGEST = 2000
"""Characters of a message's line that are printed."""

if TYPE_CHECKING:
    from wsph.study.runs import Row


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    # First of all: an interrupt while Python still imports is to be none of its tracebacks.
    for name in ("SIGTERM", "SIGINT", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and not (name == "SIGHUP" and signal.getsignal(number) is signal.SIG_IGN):  # as of nohup
            signal.signal(number, signal.default_int_handler)
    warnings.showwarning = _say
    try:
        options = _parser().parse_args(arguments)
        code = options.command(options)
        print(end="", flush=True)
        return code
    except Unstable as error:
        print(f"error: {error}", file=sys.stderr)
        return 3
    except WsphError as error:
        for line in str(error).splitlines():
            print(f"error: {_shortened(line)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("error: interrupted; nothing was written", file=sys.stderr)
        return 130
    except (MemoryError, RuntimeError, ImportError, OSError) as error:
        if not is_out_of_memory(error) and isinstance(error, OSError):
            return _failed(f"the machine failed: {error}")
        if not is_out_of_memory(error):
            raise
        words = " ".join(str(error).split()) or "no more can be had"
        return _failed(f"out of memory: {words}; use a coarser spacing, or free some")


def _failed(why: str) -> int:
    """A machine that failed, as where nobody reads what is printed or its disk is full: the exit code, after a sentence."""
    # What Python has still to print at its end goes nowhere either.
    with suppress(OSError, ValueError):  # where it is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    print(f"error: {why}", file=sys.stderr)
    return 1


def _shortened(line: str) -> str:
    """A line without its middle, where somebody has written a value of pages."""
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"


def _say(message: Warning | str, *_: object) -> None:
    print(f"warning: {message}", file=sys.stderr)


def _count(text: str) -> int:
    """A number of processes, 0 for one a core."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    from wsph import catalogue
    from wsph.plugins import registry

    parser = argparse.ArgumentParser(
        prog="wsph", description="Solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run = commands.add_parser("run", help="run a scene")
    run.add_argument("scene", type=Path)
    run.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="output folder (default: the scene's name with -out)"
    )
    run.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a key, e.g. --set bodies.0.spacing=0.005",
    )
    run.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the folder")
    run.add_argument("--overwrite", action="store_true", help="replace an earlier run in the folder")
    run.add_argument("--quiet", action="store_true", help="print nothing but errors")
    run.set_defaults(command=_run)
    check = commands.add_parser("check", help="validate a scene and print what it is composed of")
    check.add_argument("scene", type=Path)
    check.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="change a key")
    check.set_defaults(command=_check)
    listing = commands.add_parser(
        "list", help="list what a scene can name (default: installed integrators and materials)"
    )
    listing.add_argument("group", nargs="?", choices=[*registry.GROUPS, *catalogue.GROUPS])
    listing.add_argument("--json", action="store_true", help="print JSON")
    listing.set_defaults(command=_list)
    validation = commands.add_parser("validate", help="run the published cases and compare them with their oracles")
    validation.add_argument("cases", nargs="*", metavar="CASE", help="names of cases (default: all)")
    validation.add_argument("--full", action="store_true", help="all published sizes, not only the short ones")
    validation.add_argument("--json", action="store_true", help="print JSON")
    validation.set_defaults(command=_validate)
    study = commands.add_parser("study", help="run a grid of overrides over a scene: cost and error of each")
    study.add_argument("study", type=Path)
    study.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="output folder (default: the study's name with -out)"
    )
    study.add_argument(
        "--workers", type=_count, default=0, metavar="N", help="processes to spread the runs over (default: one a core)"
    )
    again = study.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="make only the rows that the folder does not have")
    again.add_argument("--overwrite", action="store_true", help="replace an earlier study in the folder")
    study.set_defaults(command=_study)
    view = commands.add_parser("view", help="show or save a picture of a run")
    _view_options(view)
    view.set_defaults(command=_view)
    return parser


def _view_options(view: argparse.ArgumentParser) -> None:
    """The options of `wsph view`."""
    view.add_argument("folder", type=Path, metavar="DIR")
    view.add_argument("--field", default="velocity", help="field to draw, e.g. stress_xx (default: velocity)")
    view.add_argument(
        "--save", type=Path, metavar="FILE", help="a .png, .pdf or .svg of the last frame, a .gif or .mp4 of all"
    )
    view.add_argument(
        "--curve",
        metavar="COLUMNS",
        help="draw columns of history.csv or of probes (PROBE.COLUMN) instead: --curve=a,b",
    )
    view.add_argument("--against", metavar="COLUMN", help="what curves are drawn over (default: time)")
    view.add_argument("--body", metavar="NAME", help="draw this body alone")
    view.add_argument("--time", metavar="T|FROM:TO", help='the frame nearest to a time ("2 ms"), or those in a range')
    view.add_argument(
        "--warp", type=float, metavar="FACTOR", help="draw displacements times a factor (0: the body as it was)"
    )
    view.add_argument(
        "--camera", choices=["xy", "xz", "yz", "iso"], help="from where to look (default: flat bodies xy)"
    )
    view.add_argument("--slice", metavar="AXIS[=AT]", help="a slice across an axis, in the middle or at a coordinate")
    view.add_argument("--clip", metavar="AXIS[<AT]", help="keep the half behind the middle, or what is <AT or >AT")
    view.add_argument("--range", metavar="LOW:HIGH", help='values from which to which colours go, e.g. "0:80 MPa"')
    view.add_argument(
        "--smooth", action="store_true", help="values recovered at nodes, not those of the cells as computed"
    )
    view.add_argument("--mesh", action="store_true", help="draw the edges of the cells")
    view.add_argument("--broken", type=float, metavar="DAMAGE", help="leave out what is damaged beyond this, e.g. 0.9")
    view.add_argument("--colours", default="viridis", choices=["viridis", "cividis", "gray"], help="default: viridis")


def _overrides(pairs: list[str]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for pair in pairs:
        key, separator, text = pair.partition("=")
        if not separator or not key:
            raise WsphError(f"--set {pair}: write it as KEY=VALUE")
        try:
            read = tomllib.loads(f"v = {text}")
        except tomllib.TOMLDecodeError:
            result[key] = text
            continue
        except RecursionError:
            raise WsphError(f"--set {key}: its value is nested too deeply to be read") from None
        if len(read) > 1:
            raise WsphError(f"--set {key}: gives more than one value; write --set once for each")
        result[key] = read["v"]
    return result


def _run(options: argparse.Namespace) -> int:
    from wsph import load, run

    scene = load(options.scene, _overrides(options.set))
    folder = options.out if options.out is not None else Path(f"{options.scene.stem}-out")
    with _Progress(options.quiet) as progress:
        result = run(scene, folder, overwrite=options.overwrite, resume=options.resume, throw=False, progress=progress)
    if not options.quiet:
        s = result.summary
        print(
            f"{result.status}: {s['steps']} steps of {s['dt']:.4g} s, {s['particles']} particles, {s['wall_seconds']:.2f} s; output in {folder}"
        )
        for finding in s["findings"]:
            print(f"finding: {finding}")
    if result.failure is not None:
        raise result.failure
    return 130 if result.status == "interrupted" else 0


class _Progress:
    """A progress bar on a terminal, silence elsewhere."""

    def __init__(self, quiet: bool):
        self._shown = not quiet and sys.stderr.isatty()

    def __enter__(self) -> Callable[[int, int, float], None] | None:
        if not self._shown:
            return None
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._bar.start()
        self._task = self._bar.add_task("", total=None)

        def update(step: int, steps: int, time: float) -> None:
            self._bar.update(self._task, completed=step, total=steps, description=f"t = {time:.4g} s")

        return update

    def __exit__(self, *_: object) -> None:
        if self._shown:
            self._bar.stop()


def _check(options: argparse.Namespace) -> int:
    from wsph.checking import described
    from wsph.scene.load import load

    for key, value in described(load(options.scene, _overrides(options.set)), str(options.scene)):
        print(f"{key:<14} {value}")
    return 0


def _list(options: argparse.Namespace) -> int:
    from wsph import catalogue
    from wsph.plugins import registry

    if options.group in catalogue.GROUPS:
        return _list_own(options.group, options.json)
    groups = [options.group] if options.group else list(registry.GROUPS)
    found = [entry for group in groups for entry in registry.described(group)]
    if options.json:
        rows = [
            {
                "group": e.group,
                "name": e.name,
                "distribution": e.distribution,
                "version": e.version,
                "target": e.target,
                "status": e.status,
                "description": e.description,
            }
            for e in found
        ]
        print(json.dumps(rows, indent=2))
        return 0
    for entry in found:
        print(
            f"{entry.group[:-1]:<11} {entry.name:<14} {entry.distribution} {entry.version:<8} {entry.status:<4} {entry.description}"
        )
    return 0


def _list_own(group: str, as_json: bool) -> int:
    """List the entries of wsph itself in a group; no plugin is looked for."""
    from wsph import catalogue

    rows = catalogue.GROUPS[group]()
    if as_json:
        found = [{"group": group, "name": row.name, "description": row.description, **row.data} for row in rows]
        print(json.dumps(found, indent=2))
        return 0
    for row in rows:
        print(f"{group[:-1]:<11} {row.name:<18} {row.description}")
        for words in row.words:
            print(f"{'':<31}{words}")
    return 0


def _study(options: argparse.Namespace) -> int:
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


def _validate(options: argparse.Namespace) -> int:
    from wsph.validation.validate import as_data, validate

    found: list[dict[str, Any]] = []
    met = True
    for outcome in validate(options.cases, options.full):
        met = met and outcome.meets
        found.append(as_data(outcome))
        if options.json:
            continue
        case = outcome.case
        print(f"{case.name}: {case.source}; oracle: {case.oracle}; {outcome.seconds:.1f} s")
        for row in outcome.rows:
            verdict = "reported" if row.asked == "reported" else "meets" if row.meets else "MISSES"
            asked = "" if row.asked == "reported" else f", asked {row.asked}"
            print(f"  {verdict:<8} {row.figure}: {row.reached:.3g} {row.unit}{asked}; published: {row.published}")
    if options.json:
        print(json.dumps(found, indent=2))
    return 0 if met else 1


def _view(options: argparse.Namespace) -> int:
    from wsph.output.view.look import Look, plane, span
    from wsph.output.view.pictures import view
    from wsph.output.view.tables import view_curves

    if options.curve is not None:
        view_curves(options.folder, options.curve, options.against, options.save)
        return 0
    slice, clip = plane(options.slice) if options.slice else None, plane(options.clip, "<>") if options.clip else None
    limits = span(options.range) if options.range else None
    shown = options.field, options.body, options.warp, options.camera
    look = Look(*shown, slice, clip, limits, options.smooth, options.mesh, options.colours, options.broken)
    view(options.folder, look, options.save, options.time)
    return 0


if __name__ == "__main__":
    sys.exit(main())
