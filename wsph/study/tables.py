"""Study files."""

# pyright: strict

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationError

from wsph.errors import Fault, SceneError
from wsph.quantities import Model, as_tuple
from wsph.scene.lines import line_of, lines
from wsph.scene.load import load
from wsph.scene.messages import of_validation
from wsph.scene.scene import Scene
from wsph.study.oracle import Oracle


class Variant(Model):
    """One of the things compared: a name, and the dotted overrides that make it."""

    name: Annotated[str, Field(min_length=1)]
    set: dict[str, object] = {}


class Study(Model):
    """A study file."""

    schema_: Literal[1] = Field(alias="schema")
    title: str = ""
    scene: str
    variants: Annotated[tuple[Variant, ...], BeforeValidator(as_tuple), Field(min_length=1)] = (Variant(name="scene"),)
    grid: dict[str, Annotated[tuple[object, ...], BeforeValidator(as_tuple), Field(min_length=1)]] = {}
    oracle: Oracle | None = None


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
        study = Study(**data)
    except ValidationError as error:
        where = lines(text)
        faults = [of_validation(e, Study) for e in error.errors(include_url=False)]
        raise SceneError(str(path), [Fault(line_of(where, f.key), f.key, f.message) for f in faults]) from None
    return study, load(path.parent / study.scene)
