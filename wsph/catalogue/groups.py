"""Lists of the names that a scene can use beside plugins: formulations, parts, formats, smoothing functions, shapes;
and of the scenes that ship.

Each list is read from the table that a scene's key is looked up in, and says of an entry what its own docstring says.
"""

# pyright: strict

import dataclasses
import importlib.util
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, get_args

from wsph.catalogue.docstrings import attribute_docstrings, first_sentence
from wsph.plugins import registry

if TYPE_CHECKING:
    from wsph.protocols import Traits


@dataclass(frozen=True)
class Row:
    """An entry: its name as scenes write it, the first sentence of its docstring, what else there is to say of it in words,
    and the same as data; the object whose docstring says more, where it stands, and an example of its use in a scene."""

    name: str
    description: str
    words: tuple[str, ...] = ()
    data: Mapping[str, object] = field(default_factory=dict[str, object])
    described: object = None
    source: str = ""
    example: str = ""


def formulations() -> list[Row]:
    """Formulations: for integrators of how many sets, what they can do, and which parts they take."""
    from wsph.parts.table import PARTS
    from wsph.plugins.formulations import FORMULATIONS

    rows: list[Row] = []
    for each in FORMULATIONS:
        parts = [key for key, part in PARTS.items() if part.fits(each.traits)]
        words = (
            *in_words(each.traits),
            f"support by default {each.traits.support:g} spacings, at most {each.traits.supports[1]:g}",
            f"takes {', '.join(parts) or 'none of the parts'}",
        )
        data = {"sets": each.sets, "traits": dataclasses.asdict(each.traits), "parts": parts}
        example = f'[run]\nformulation = "{each.name}"'
        said = f"for integrators of {_sets(each.sets)}"
        rows.append(Row(each.name, said, words, data, source=f"wsph, {each.target}", example=example))
    return rows


def parts() -> list[Row]:
    """Optional parts of a body, and the formulations that take them."""
    from wsph.parts.table import PARTS
    from wsph.plugins.formulations import FORMULATIONS

    rows: list[Row] = []
    for key, part in PARTS.items():
        takers = [each for each in FORMULATIONS if part.fits(each.traits)]
        words = "; ".join(f"{each.name} ({_sets(each.sets)})" for each in takers)
        data = {"formulations": [{"name": each.name, "sets": each.sets} for each in takers]}
        rows.append(Row(key, sentence(part), (f"taken by {words or 'no formulation'}",), data))
    return rows


def formats() -> list[Row]:
    """Formats of frames, the files that they write, and whether what they need is installed."""
    from wsph.output.formats import FORMATS

    rows: list[Row] = []
    for each in FORMATS:
        files = [f"frames/*.{each.suffix}", *([each.listing] if each.listing else [])]
        joined = [f"frames/*.{each.joins}"] if each.joins and each.joins != each.suffix else []
        installed = not each.needs or importlib.util.find_spec(each.needs) is not None
        missing = () if installed else (f'needs {each.needs}: pip install "wsph[{each.name}]"',)
        data = {"files": files, "joined": joined, "needs": each.needs, "installed": installed}
        words = (f"writes {' and '.join(files)}", *(f"parts are joined by {name}" for name in joined), *missing)
        example = f'[output]\nformats = ["{each.name}"]\nevery = "1 ms"'
        kind = type(each)
        rows.append(Row(each.name, sentence(kind), words, data, kind, f"wsph, {kind.__module__}", example))
    return rows


def kernels() -> list[Row]:
    """Smoothing functions, for `run.kernel`."""
    from wsph.sph.smoothing import SMOOTHING

    return [
        Row(name, sentence(made), (), {}, made, "wsph, wsph.sph.smoothing", f'[run]\nkernel = "{name}"')
        for name, made in SMOOTHING.items()
    ]


def fields() -> list[Row]:
    """Fields of frames and probes."""
    from wsph.output import fields as declared

    rows: list[Row] = []
    for name in (*declared.known(("dissipation",), 3, ("damage",)),):
        said = declared.said(name) or f"component of the {name.rpartition('_')[0]}"
        unit = declared.UNITS.get(declared.primitive(name), declared.ON_SURFACES.get(name, "1"))
        example = f'[output]\nfields = ["{name}"]\nevery = "1 ms"'
        rows.append(
            Row(name, f"{said} [{unit}]", (), {"unit": unit}, source="wsph, wsph.output.fields", example=example)
        )
    return [
        *rows,
        Row(
            "internals",
            "those of a material, as plastic_strain: wsph list MATERIAL names them",
            (),
            {},
            None,
            "a plugin",
        ),
    ]


def tables() -> list[Row]:
    """Tables of a scene."""
    from wsph.catalogue.tables import places
    from wsph.parts.table import PARTS

    # Parts and shapes have lists of their own.
    others = {path: schema for path, schema in places() if ".shape." not in path}
    shown = [path for path in others if path.removeprefix("bodies.") not in PARTS]
    return [Row(path, first_sentence(str(others[path]["description"]))) for path in shown]


def examples() -> list[Row]:
    """The scenes that ship with wsph."""
    from wsph.catalogue import shipped

    return [
        Row(name, shipped.about(name), source="wsph, examples", example=f"# wsph new example {name}")
        for name in shipped.names()
    ]


def shapes() -> list[Row]:
    """Shapes of bodies, for `type`, and their other keys."""
    from wsph.geometry.shapes.combined import Shape
    from wsph.geometry.shapes.shape import BaseShape

    rows: list[Row] = []
    for kind in get_args(get_args(Shape)[0]):
        own = [name for name in kind.model_fields if name not in BaseShape.model_fields and name != "type"]
        keys = [kind.model_fields[name].alias or name for name in (*own, *BaseShape.model_fields)]
        names = get_args(kind.model_fields["type"].annotation)
        rows += [Row(name, sentence(kind), (f"keys {', '.join(keys)}",), {"keys": keys}) for name in names]
    return rows


GROUPS: dict[str, Callable[[], list[Row]]] = {
    each.__name__: each for each in (formulations, parts, formats, fields, kernels, shapes, tables, examples)
}
"""The lists by the names that `wsph list` takes, beside those of plugins."""


def every() -> list[str]:
    """The names of all lists, those of plugins first."""
    return [*registry.GROUPS, *GROUPS]


def sentence(described: object) -> str:
    """The first sentence of a docstring, on one line."""
    return first_sentence(inspect.getdoc(described) or "")


def in_words(traits: "Traits") -> list[str]:
    """The abilities of a formulation, in the words that `Traits` has for them."""
    said = attribute_docstrings(type(traits))
    held = [name for name, value in dataclasses.asdict(traits).items() if value is True]
    return [said[name].removeprefix("Whether ").partition(": ")[0].removesuffix(".") for name in held]


def _sets(count: int) -> str:
    return f"{count} set" if count == 1 else f"{count} sets"
