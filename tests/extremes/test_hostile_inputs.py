"""Inputs that nobody means well: each is refused by name, or is right; none is silent, none leaves a traceback.

One scene runs; every entry changes it. The tables are to be extended with whatever else is found.
"""

import os
import re
from pathlib import Path

import pytest

from tests.distributions import install
from wsph.cli import main

SHAPE = 'shape = { type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }'
MATERIAL = 'material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.3 }'
BASE = f"""schema = 1
dim = 2
title = "t"
[run]
integrator = "leapfrog"
formulation = "stress-points"
end = 0.1
cfl = 0.3
[[bodies]]
name = "b"
{SHAPE}
spacing = 0.25
state = "strain"
velocity = ["0.01*x", 0.0]
{MATERIAL}
"""
SQUARE = '{ type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }'
END, CFL, NAME, STATE = "end = 0.1", "cfl = 0.3", 'name = "b"', 'state = "strain"'


def polygon(*points: tuple[float, float]) -> str:
    """The key of a polygon."""
    return f'shape = {{ type = "polygon", points = {[list(point) for point in points]} }}'


def nested(depth: int) -> str:
    """Unions in unions, of the same square."""
    return "shape = " + '{ type = "union", shapes = [' * depth + SQUARE + f", {SQUARE}] }}" * depth


# What stands in the scene, what stands in its place, the exit code, and what is said. "" stands before the end.
SCENES: dict[str, tuple[str, str, int, str]] = {
    # numbers
    "nan": (END, "end = nan", 2, "run.end: nan is not a finite number"),
    "nan in a string": (END, 'end = "nan s"', 2, "run.end: "),
    "infinity with a unit": (MATERIAL, MATERIAL.replace("density = 1.0", 'density = "inf kg/m3"'), 2, "density"),
    "an expression that is no number": ('"0.01*x"', '"0/0"', 2, "initial velocity, or a value prescribed at t = 0, is not finite"),
    "a number that overflows": ('"0.01*x"', '"1e308*x*1e10"', 2, "no number that can be computed with"),
    "a root of what is below zero, later": ("", '[[boundary]]\nbody = "b"\nface = "+x"\nvelocity = { x = "sqrt(0.05-t)" }\n', 3, "is not finite"),
    "a power of powers": ("", '[functions.f]\nexpression = "10^10^10^10"\n[[boundary]]\nbody = "b"\nface = "-x"\nvelocity = { x = "f" }\n', 2, "is not finite"),
    "a modulus of 1e308": (MATERIAL, MATERIAL.replace("youngs_modulus = 1.0", "youngs_modulus = 1e308"), 2, "material 'elastic'|too far out"),
    "a density of 1e-308": (MATERIAL, MATERIAL.replace("density = 1.0", "density = 1e-308"), 2, "too far out to compute with"),
    "the smallest modulus": (MATERIAL, MATERIAL.replace("youngs_modulus = 1.0", "youngs_modulus = 5e-324"), 2, "not finite and above zero"),
    "a time step of 5e-324 s": (CFL, "dt = 5e-324", 2, "run"),
    "negative zero": ("spacing = 0.25", "spacing = -0.0", 2, "bodies.0.spacing: -0.0 is not above zero"),
    "a coordinate of negative zero": ("min = [0.0, 0.0]", "min = [-0.0, -0.0]", 0, "completed: "),
    "a whole number of 400 digits": (END, "end = " + "9" * 400, 2, "run.end: "),
    "an exponent without end": (END, 'end = "1e999999999999999999999 s"', 2, "run.end: "),
    "a power of a unit without end": (END, 'end = "0.1 s^99999999999999999999"', 2, "run.end: "),
    "a turn of 1e308 degrees": ("max = [1.0, 1.0] }", "max = [1.0, 1.0], rotate = 1e308 }", 2, "rotate: 1e\\+308 is beyond 3600 degrees"),
    "a lattice turned by 1e300 degrees": ("spacing = 0.25", "spacing = 0.25\nlattice_rotate = 1e300", 2, "lattice_rotate: .* beyond 3600 degrees"),
    "a date": (END, "end = 2026-11-29", 2, "run.end: "),
    "a truth for a number": ("dim = 2", "dim = true", 2, "dim: True must be a whole number"),
    # names
    "a name of 10,000 characters": (NAME, f'name = "{"n" * 10000}"', 2, "bodies.0.name: .* at most 100 characters"),
    "an integrator of 10,000 characters": ('"leapfrog"', f'"{"l" * 10000}"', 2, "run.integrator: no entry named"),
    "a name with a line in it": (NAME, 'name = "a\\nb"', 2, "bodies.0.name: .* cannot be printed"),
    "a name that turns the line about": (NAME, 'name = "a\\u202Eb"', 2, "bodies.0.name: .* cannot be printed"),
    "a name with a NUL": (NAME, 'name = "a\\u0000b"', 2, "bodies.0.name: .* cannot be printed"),
    "a blank name": (NAME, 'name = "  "', 2, "bodies.0.name: .* blanks at its ends"),
    "a name in another script": (NAME, 'name = "стержень 棒"', 0, "completed: "),
    "a probe named as the folder above": ("", '[[probes]]\nname = ".."\nat = [[0.5, 0.5]]\nfields = ["velocity"]\n', 2, "probes.0.name: "),
    "a function named as an axis": ("", '[functions.x]\nexpression = "1"\n', 2, "functions.x: 'x' is a name of the expressions"),
    "a key of Python's": (END, "end = 0.1\n__class__ = 3", 2, "run.__class__: unknown key"),
    "a key without a name": (END, 'end = 0.1\n"" = 3', 2, "unknown key"),
    # shapes
    "sides that cross": (SHAPE, polygon((0, 0), (1, 1), (1, 0), (0, 1)), 2, "bodies.0.shape: it crosses itself: side 1 from .* meets side 3"),
    "a star drawn in one line": (SHAPE, polygon((0, 1), (0.59, -0.81), (-0.95, 0.31), (0.95, 0.31), (-0.59, -0.81)), 2, "it crosses itself"),
    "a polygon of one point": (SHAPE, polygon((0, 0), (0, 0), (0, 0)), 2, "its points enclose no area"),
    "a polygon on a line": (SHAPE, polygon((0, 0), (1, 1), (2, 2)), 2, "its points enclose no area"),
    "a polygon that goes around twice": (SHAPE, polygon((0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (1, 0), (1, 1), (0, 1)), 2, "leaves no cell inside the shape"),
    "a polygon that is closed by its first point": (SHAPE, polygon((0, 0), (1, 0), (1, 1), (0, 1), (0, 0)), 0, "25 particles"),
    "sixty unions in each other": (SHAPE, nested(60), 0, "25 particles"),
    "four hundred unions in each other": (SHAPE, nested(400), 2, "is nested too deeply to be read"),
    "a union of nothing": (SHAPE, 'shape = { type = "union", shapes = [] }', 2, "bodies.0.shape.shapes: "),
    "a difference that leaves nothing": (SHAPE, f'shape = {{ type = "difference", shapes = [{SQUARE}, {{ type = "disc", center = [0.5, 0.5], radius = 2.0 }}] }}', 2, "leaves no cells inside the shape"),
    "a disc smaller than a cell": (SHAPE, 'shape = { type = "disc", center = [0.0, 0.0], radius = 1e-6 }', 2, "bodies.0.spacing: 0.25 m is larger than the shape, which is 2e-06 m"),
    "a ring without width": (SHAPE, 'shape = { type = "ring", center = [0.0, 0.0], inner = 1.0, outer = 1.0 }', 2, "inner 1 m must lie below outer 1 m"),
    "a box at the end of the numbers": (SHAPE, 'shape = { type = "box", min = [1e15, 0.0], max = [1000000000000001.0, 1.0] }', 2, "is lost in the rounding of coordinates of 1e\\+15 m"),
    "a box of 1e308 m": (SHAPE + "\nspacing = 0.25", SHAPE.replace("1.0, 1.0]", "1e308, 1e308]") + "\nspacing = 1e307", 2, "too far out to compute with"),
    "more cells than there are numbers": ("spacing = 0.25", "spacing = 1e-300", 2, "is too small for a body of 1 m"),
    "a crack without length": (STATE, STATE + "\ncracks = [{ from = [0.5, 0.5], to = [0.5, 0.5] }]", 2, "from and to are the same point"),
    "a crack of 1e-10 m": (STATE, STATE + "\ncracks = [{ from = [0.5, 0.5], to = [0.5000000001, 0.5] }]", 2, "bodies.0.cracks: "),
    "a crack beside the body": (STATE, STATE + "\ncracks = [{ from = [5.0, 0.5], to = [6.0, 0.5] }]", 2, "part no cells of the body"),
    "a map to one line": (STATE, STATE + '\nmap = ["0*x", "y"]', 2, "bodies.0.map: "),
    "a map to nowhere": (STATE, STATE + '\nmap = ["0/0", "y"]', 2, "bodies.0.map: .*not finite"),
    # tables
    "no body": (BASE[BASE.index("[[bodies]]") :], "bodies = []\n", 2, "bodies: "),
    "an empty file": (BASE, "", 2, "is missing|schema"),
    "an empty material": (MATERIAL, "material = {}", 2, "bodies.0.material.model: "),
    "a material that is a word": (MATERIAL, 'material = "elastic"', 2, "bodies.0.material: "),
    "an empty boundary": ("", "[[boundary]]\n", 2, "boundary.0"),
    "a boundary that prescribes nothing": ("", '[[boundary]]\nbody = "b"\nface = "+x"\ntraction = {}\n', 2, "nothing is prescribed"),
    "an empty probe": ("", "[[probes]]\n", 2, "probes.0"),
    "an empty function": ("", "[functions.f]\n", 2, "functions.f: either a table"),
    "a face that is on no body": ("", '[[boundary]]\nbody = "b"\nface = "+q"\nfixed = ["x"]\n', 2, "'\\+q' is no face"),
    "a region that is nowhere": ("", '[[boundary]]\nbody = "b"\nwhere = "x < 0/0"\nfixed = ["x"]\n', 2, "selects no particle of 'b'"),
    "a region in Python": ("", '[[boundary]]\nbody = "b"\nwhere = "__import__(\'os\')"\nfixed = ["x"]\n', 2, "boundary.0.where: "),
    "a list in lists": ("spacing = 0.25", "spacing = " + "[" * 3000 + "]" * 3000, 2, "is nested too deeply to be read"),
    "the same key twice": (END, "end = 0.1\nend = 0.2", 2, "is not TOML"),
    "a memory beyond the machine": (SHAPE + "\nspacing = 0.25", SHAPE.replace("1.0, 1.0]", "1e6, 1e6]") + "\nspacing = 1.0", 2, "bodies.0.spacing: gives 1e\\+12 particles"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(SCENES))
def test_a_scene_is_refused_by_name_or_right(name: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old, new, code, words = SCENES[name]
    assert old in BASE
    (here / "s.toml").write_text(BASE.replace(old, new) if old else BASE + new)
    expect(capsys, ["run", "s.toml", "-o", "out"], code, words)
    # What a run that became unstable has come to is written; of a refusal nothing is.
    assert (here / "out").exists() == (code in (0, 3))


def expect(capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, words: str) -> None:
    """The command ends with a code and says some words, a line each."""
    assert main(arguments) == code
    said = capsys.readouterr()
    text = said.out + said.err
    assert re.search(words, text), text
    assert "Traceback" not in text
    assert all(line.startswith(("error: ", "warning: ")) for line in said.err.splitlines())
    assert all(len(line) < 2100 for line in text.splitlines())


COMMANDS: dict[str, tuple[list[str], int, str]] = {
    "a folder as scene": (["run", "folder"], 2, "folder: cannot be read: .*Is a directory"),
    "a scene that is not there": (["check", "nothing.toml"], 2, "nothing.toml: no such file"),
    "bytes as scene": (["run", "bytes.toml"], 2, "bytes.toml: cannot be read"),
    "a link to itself": (["run", "loop.toml"], 2, "loop.toml: cannot be read"),
    "a path with a NUL": (["run", "a\0b"], 2, "cannot be read: embedded null"),
    "a name longer than names are": (["run", "n" * 300 + ".toml"], 2, "cannot be read"),
    "a file as folder": (["run", "s.toml", "-o", "bytes.toml"], 2, "is a file, not a folder"),
    "a folder in a file": (["run", "s.toml", "-o", "bytes.toml/x"], 2, "cannot be written"),
    "a folder of the system": (["run", "s.toml", "-o", "/proc/x"], 2, "cannot be written"),
    "a key a thousand tables deep": (["run", "s.toml", "--set", ".".join("a" * 1000) + "=3"], 2, "leads more than 50 tables deep"),
    "a superscript as number of a body": (["run", "s.toml", "--set", "bodies.\u00b2.spacing=3"], 2, "there is no entry"),
    "two values in one": (["run", "s.toml", "--set", 'title="a"\nx=3'], 2, "gives more than one value"),
    "a value in brackets without end": (["run", "s.toml", "--set", "title=" + "[" * 3000], 2, "is nested too deeply"),
    "to resume from a file": (["run", "s.toml", "-o", "bytes.toml", "--resume"], 2, "is a file, not a folder"),
    "a study of a scene": (["study", "s.toml"], 2, "unknown key"),
    "a picture of a file": (["view", "bytes.toml"], 2, "no frames.pvd"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(COMMANDS))
def test_a_command_is_refused_by_name(name: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "s.toml").write_text(BASE)
    (here / "folder").mkdir()
    (here / "bytes.toml").write_bytes(bytes(range(256)))
    os.symlink("loop.toml", here / "loop.toml")
    arguments, code, words = COMMANDS[name]
    expect(capsys, arguments, code, words)
    assert sorted(path.name for path in here.iterdir()) == ["bytes.toml", "folder", "loop.toml", "s.toml"]


LAW = """
from dataclasses import dataclass, field
import warp as wp

@dataclass(frozen=True)
class Plugin:
    density: float = 1.0

    def moduli(self):
        return 1.0, 0.5

    def rate(self, space, Params):
        tensor = space.tensor

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            return p.elastic_shear * (L + wp.transpose(L))

        return law

    """
METHOD = """
class Plugin:
    formulations, order, evaluations = ("stress-points",), 1, 1

    def __init__(self, system):
        self.system, self.state, self.k = system, system.state, system.new()

    def limit(self):
        return 0.5, "as it says"

    def step(self):
        s, y = self.system, self.state
        s.rate(y, self.k)
        s.combine(y, plain=[(1.0, y)], timed=[(1.0, self.k)])
        s.accept(y)

    """
# A member more, or one in place of another, the exit code and what is said beside the plugin's distribution.
MATERIALS: dict[str, tuple[str, int, str]] = {
    "internals in a list": ("internals = ['a']", 2, "internals are .'a'.: a mapping"),
    "an internal that is nan": ("internals = {'a': float('nan')}", 2, "'a' begins with nan"),
    "an internal in parsecs": ("internals = {'a': (0.0, 'parsec')}", 2, "unknown unit 'parsec'"),
    "a derived property that is not there": ("derived = {'nothing': 'Pa'}", 2, "cannot be read: AttributeError"),
    "flows that are a number": ("flows = 3", 2, "flows = 3"),
    "relaxes that is a word": ("relaxes = 'no'", 2, "relaxes is 'no': True or False"),
    "a time step that is nan": ("def time_step(self): return float('nan')", 2, "time_step.. gives nan"),
    "a time step that raises": ("def time_step(self): return 1 / 0", 2, "ZeroDivisionError"),
    "a law that ends the process": ("def rate(self, space, Params): raise SystemExit(9)", 2, "SystemExit: 9"),
    "fields that end the process": ("def __post_init__(self): raise SystemExit(3)", 2, "refuses its fields"),
    "a law that asks for all memory": ("def rate(self, space, Params): raise MemoryError('all of it')", 1, "out of memory: all of it"),
    "values that cannot be kept": ("__hash__ = None", 2, "unhashable"),
}  # fmt: skip
INTEGRATORS: dict[str, tuple[str, int, str]] = {
    "formulations that are a word": ("formulations = 'stress-points'", 2, "formulations are 'stress-points': a tuple"),
    "evaluations that are a word": ("evaluations = 'four'", 2, "evaluations is 'four': a whole number"),
    "publish raises": ("def publish(self): raise KeyError('p')", 2, "KeyError"),
    "fresh raises": ("fresh = property(lambda self: 1 / 0)", 2, "ZeroDivisionError"),
    "a limit of -1": ("def limit(self): return -1.0, 'x'", 2, "limit.. gives -1.0"),
    "a limit without end": ("def limit(self): return self.limit()", 2, "RecursionError"),
    "a step that ends the process": ("def step(self): raise SystemExit(4)", 2, "SystemExit: 4"),
    "a step with nothing": ("def step(self): self.system.combine(None, plain=[(1.0, None)])", 2, "AttributeError"),
    "a step past the system": ("def step(self): self.state.buffer.numpy()[:] = 1.0", 2, "never calls accept"),
    "the machine fails": ("def begin(self): raise OSError(28, 'No space left on device')", 1, "the machine failed: .*No space left"),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "name"), [("material", name) for name in MATERIALS] + [("integrator", name) for name in INTEGRATORS])  # fmt: skip
def test_a_plugin_is_named(kind: str, name: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cases, code = (MATERIALS, LAW) if kind == "material" else (INTEGRATORS, METHOD)
    member, exit_code, words = cases[name]
    install(here, "odd-plugin", kind, f"odd_{kind}_{list(cases).index(name)}", code + member + "\n")
    old, new = (MATERIAL, 'material = { model = "broken" }') if kind == "material" else ('"leapfrog"', '"broken"')
    (here / "s.toml").write_text(BASE.replace(old, new))
    expect(capsys, ["run", "s.toml", "-o", "out"], exit_code, words)
    assert not (here / "out").exists()


def test_the_plugins_that_are_changed_run(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without which the tests above would show nothing."""
    install(here, "odd-plugin", "material", "odd_law", LAW)
    (here / "s.toml").write_text(BASE.replace(MATERIAL, 'material = { model = "broken" }'))
    expect(capsys, ["run", "s.toml", "-o", "one"], 0, "completed")
    install(here, "odd-plugin", "integrator", "odd_method", METHOD)
    (here / "s.toml").write_text(BASE.replace('"leapfrog"', '"broken"'))
    expect(capsys, ["run", "s.toml", "-o", "two"], 0, "completed")
