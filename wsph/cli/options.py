"""Options that several commands have: `--set KEY=VALUE`, the output folder, and the number of processes."""

# pyright: strict

import argparse
import tomllib
from pathlib import Path

from wsph.errors import WsphError


def declare_set(parser: argparse.ArgumentParser) -> None:
    """Add `--set` to a command that reads a scene."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a key, e.g. --set bodies.0.spacing=0.005",
    )


def overrides(pairs: list[str]) -> dict[str, object]:
    """The keys of a scene that `--set` changes, by their dotted names."""
    result: dict[str, object] = {}
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


def declare_out(parser: argparse.ArgumentParser, of: str, ending: str) -> None:
    """Add `-o` to a command that writes a folder; where none is given, it has the name of what it is `of` (`folder_of`)."""
    text = f"output folder (default: the {of}'s name with -{ending})"
    parser.add_argument("-o", "--out", type=Path, metavar="DIR", help=text)


def folder_of(options: argparse.Namespace, of: str, ending: str) -> Path:
    """The folder that is given, or the one that `declare_out` tells of, here."""
    given: Path | None = options.out
    return given if given is not None else Path(f"{getattr(options, of).stem}-{ending}")


def declare_workers(parser: argparse.ArgumentParser) -> None:
    """Add `--workers` and `--scheduler` to a command that makes many runs."""
    parser.add_argument(
        "--workers",
        type=_count_of_processes,
        default=0,
        metavar="N",
        help="processes to spread the runs over (default: one a core)",
    )
    declare_scheduler(parser)


def declare_scheduler(parser: argparse.ArgumentParser) -> None:
    """Add `--scheduler` to a command whose runs know nothing of each other."""
    parser.add_argument(
        "--scheduler",
        metavar="WHERE",
        help="make the runs elsewhere: on the workers of a scheduler of Dask (tcp://HOST:PORT), or of mpi4py.futures (mpi)",
    )


def _count_of_processes(text: str) -> int:
    """A number of processes, 0 for one a core."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)
