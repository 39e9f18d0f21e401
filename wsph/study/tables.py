"""Study files.

schema = 1
scene = "../shock_bar.toml"
set = { "run.end" = "8 ms" }      # what all rows change of it
[[variants]]                      # what is compared; every one at every place of the grid
name = "tsph"
set = { "run.cfl" = 1.0 }
grid = { "bodies.0.spacing" = [0.01] }     # its own values of the grid, where others would be too dear
[grid]
"bodies.0.spacing" = [0.04, 0.02, 0.01]    # "bodies.0.spacing, bodies.1.spacing" changes both at once
[oracle]                          # the exact answer, an expression of x, y, z, t
probe = "fixed-end"               # or field = "velocity_x" at the end of the run
column = "stress_xx"
exact = "-8e5*(t > 5e-3 and t <= 7.5e-3)"   # or reference = "file.csv": a time and a value a row
norm = 1
"""

# pyright: strict

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError

from wsph.errors import Fault, SceneError
from wsph.quantities import Model, Strings, as_tuple
from wsph.scene.lines import line_of, lines
from wsph.scene.load import load
from wsph.scene.messages import of_validation
from wsph.scene.scene import Scene
from wsph.study.oracle import Oracle

Grid = dict[str, Annotated[tuple[object, ...], BeforeValidator(as_tuple), Field(min_length=1)]]
"""Values by the dotted key that takes them, or by several with commas between, all of which take the same."""


class Variant(Model):
    """One of the things compared: a name, the dotted overrides that make it, and where its grid is not that of all."""

    name: Annotated[str, Field(min_length=1)]
    set: dict[str, object] = {}
    grid: Grid = {}


def _distinct(variants: tuple[Variant, ...]) -> tuple[Variant, ...]:
    names = [variant.name for variant in variants]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"two variants are named {twice!r}: rows are told apart by that name")
    return variants


Variants = Annotated[tuple[Variant, ...], BeforeValidator(as_tuple), Field(min_length=1), AfterValidator(_distinct)]


class Study(Model):
    """A study file. `judged`: the PROBE.COLUMN whose estimates and bars the rows have; by default that of the oracle, and
    without one all columns of all probes."""

    schema_: Literal[1] = Field(alias="schema")
    title: str = ""
    scene: str
    set: dict[str, object] = {}
    variants: Variants = (Variant(name="scene"),)
    grid: Grid = {}
    oracle: Oracle | None = None
    judged: Strings = ()


def load_study(path: Path) -> tuple[Study, Scene]:
    """Read a study and its scene. Raises SceneError with every fault of the study, then of the scene."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        data = tomllib.loads(text)
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(str(path), [Fault(0, "", f"cannot be read: {error}")]) from None
    except tomllib.TOMLDecodeError as error:
        raise SceneError(str(path), [Fault(0, "", f"is not TOML: {error}")]) from None
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        where = lines(text)
        faults = [of_validation(e, Study) for e in error.errors(include_url=False)]
        raise SceneError(str(path), [Fault(line_of(where, f.key), f.key, f.message) for f in faults]) from None
    return study, load(path.parent / study.scene)
