"""The command line from its arguments to its exit code.

Exit codes: 0 completed; 1 a published case that does not come out as it should, or a failure of the machine (memory,
disk); 2 bad input (a faulty scene, a refused composition, an unusable folder); 3 unstable; 4 an accuracy that is not met;
130 interrupted; 141 whoever read the output has closed it.
"""

# pyright: strict

import argparse
import os
import signal
import sys
import warnings
from contextlib import suppress

from wsph.cli.commands.advise import ADVISE
from wsph.cli.commands.calibrate import CALIBRATE
from wsph.cli.commands.check import CHECK
from wsph.cli.commands.cite import CITE
from wsph.cli.commands.completion import COMPLETION
from wsph.cli.commands.info import INFO
from wsph.cli.commands.list import LIST
from wsph.cli.commands.new import NEW
from wsph.cli.commands.run import RUN
from wsph.cli.commands.schema import SCHEMA
from wsph.cli.commands.study import STUDY
from wsph.cli.commands.validate import VALIDATE
from wsph.cli.commands.view import VIEW
from wsph.errors import Unstable, WsphError, is_out_of_memory
from wsph.output.interrupts import NAMES
from wsph.ranks.world import speaks

COMMANDS = (RUN, CHECK, ADVISE, NEW, LIST, SCHEMA, VALIDATE, STUDY, CALIBRATE, VIEW, CITE, INFO, COMPLETION)
"""In the order of the help."""

LONGEST = 2000
"""Characters of a message's line that are printed."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    # First of all: an interrupt while Python still imports is to be none of its tracebacks.
    for name in NAMES:
        number = getattr(signal, name, None)
        if number is None or (
            name in ("SIGHUP", "SIGUSR1") and signal.getsignal(number) is signal.SIG_IGN
        ):  # as of nohup
            continue
        signal.signal(number, signal.default_int_handler)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed before the program began
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    warnings.showwarning = _say
    try:
        options = _parser().parse_args(arguments)
        code = options.act(options)
        print(end="", flush=True)
        return code
    except Unstable as error:
        _tell(f"error: {error}")
        return 3
    except WsphError as error:
        for line in str(error).splitlines():
            _tell(f"error: {_shortened(line)}")
        return 2
    except KeyboardInterrupt:
        print("error: interrupted; nothing was written", file=sys.stderr)
        return 130
    except BrokenPipeError:  # as of `wsph list | head`: whoever reads has what it wanted
        _silence()
        return 141
    except (MemoryError, RuntimeError, ImportError, OSError) as error:
        if not is_out_of_memory(error) and isinstance(error, OSError):
            return _failed(f"the machine failed: {error}")
        if not is_out_of_memory(error):
            raise
        words = " ".join(str(error).split()) or "no more can be had"
        return _failed(f"out of memory: {words}; use a coarser spacing, or free some")


def _tell(words: str) -> None:
    """Print an error, once, of processes that share it."""
    if speaks():
        print(words, file=sys.stderr, flush=True)


def _failed(why: str) -> int:
    """A machine that failed, as where nobody reads what is printed or its disk is full: the exit code, after a sentence."""
    _silence()
    _tell(f"error: {why}")
    return 1


def _silence() -> None:
    """What Python has still to print at its end goes nowhere."""
    with suppress(OSError, ValueError):  # where it is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _shortened(line: str) -> str:
    """A line without its middle, where somebody has written a value of pages."""
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"


def _say(message: Warning | str, *_: object) -> None:
    with suppress(OSError):  # where nobody reads it the run goes on
        print(f"warning: {message}", file=sys.stderr)


class _Version(argparse.Action):
    """`--version`: read only where it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import version

        print(f"wsph {version('wsph')}")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="wsph", description="Solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp."
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        own = commands.add_parser(command.name, help=command.help)
        command.declare(own)
        own.set_defaults(act=command.act, commands=COMMANDS)
    return parser
