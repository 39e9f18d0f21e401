"""What hostile cases are made of: a small body, commands in this process and in one of their own, and their answers."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from wsph.cli import main

BODY = """
schema = 1
dim = 2
[run]
integrator = "leapfrog"
end = 0.2
dt = 0.02
[[bodies]]
name = "b"
shape = { type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }
spacing = 0.25
state = "strain"
velocity = ["0.01*x", "0"]
material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.3 }
"""
ALL = '[output]\nevery = 5\nformats = ["vtu", "xdmf", "npz"]\n'


@dataclass(frozen=True)
class Answer:
    """What a command came to: its exit code and all that it said."""

    code: int
    said: str


@dataclass(frozen=True)
class Hostile:
    """A case: what is done in a folder, the exit `codes` that are right, and a pattern of what is said."""

    name: str
    done: Callable[[Path], Answer]
    codes: tuple[int, ...]
    says: str = ""


CASES: list[Hostile] = []


def case(name: str, says: str, *codes: int) -> Callable[[Callable[[Path], Answer]], None]:
    """Decorator: a case that a function does; exit code 2 where none is given."""
    return lambda done: CASES.append(Hostile(name, done, codes or (2,), says))


def told(*arguments: str | Path) -> Answer:
    """The answer of a command in this process."""
    said = StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        code = main([str(each) for each in arguments])
    return Answer(code, said.getvalue())


def run(folder: Path, text: str, *arguments: str | Path, out: str | Path = "out") -> Answer:
    """Run a scene."""
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return told("run", folder / "scene.toml", "-o", folder / out, *arguments)


def process(folder: Path, text: str, *arguments: str, **keys: Any) -> "subprocess.Popen[str]":
    """A run in a process of its own."""
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "wsph.cli",
        "run",
        str(folder / "scene.toml"),
        "-o",
        str(folder / "out"),
        *arguments,
    ]
    # Where the tests run as under nohup, their children are not to.
    usual = {"preexec_fn": lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL)} if os.name == "posix" else {}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(command, **{**pipes, **usual, **keys})


def scene_case(name: str, says: str, text: str, *codes: int) -> None:
    """A case that is a scene."""
    case(name, says, *codes)(lambda folder: run(folder, text))


def probe(**keys: str) -> str:
    """The body with a probe."""
    keys = {"name": '"p"', "fields": '["velocity_x"]', **keys}
    return BODY + "[[probes]]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())


def named(name: str) -> str:
    """The body by another name, with frames in every format."""
    return BODY.replace('name = "b"', f"name = {name}") + ALL
