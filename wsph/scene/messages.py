"""Faults that pydantic finds in a table, in the words of its author."""

# pyright: strict

import difflib
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from wsph.errors import Fault

_TYPES = {"tuple_type": "a list", "dict_type": "a table", "model_type": "a table", "string_type": "a string",
          "int_type": "a whole number", "bool_type": "true or false"}  # fmt: skip

LISTS_OF_TABLES = ("bodies", "boundary", "contact", "tools", "sections", "probes", "steps")
"""Tables of a scene that are lists of tables."""


def nearest(name: str, names: Iterable[str], otherwise: str = "") -> str:
    """ "did you mean 'x'?" where a name is near, or else `otherwise`."""
    close = difflib.get_close_matches(name, list(names), 1)
    return f"did you mean {close[0]!r}?" if close else otherwise


def none_of(given: object, allowed: Sequence[str]) -> str:
    """The message for a value that is none of some names, with the nearest of them."""
    *most, last = map(repr, allowed)
    hint = nearest(str(given), allowed)
    return f"{given!r} is none of {', '.join(most)}{' or ' if most else ''}{last}" + (f"; {hint}" if hint else "")


LARGE = 10.0
"""The longest side of a part [m] beyond which its file may have been in millimetres."""


def size_in_words(name: str, sides: Iterable[float], *, unscaled: bool) -> str:
    """How large a body is, `sides` [m]; with a question where it is large and no scale was given for its file."""
    lengths = list(sides)
    said = f"{name!r} is {' x '.join(f'{side:.4g}' for side in lengths)} m large"
    return said + (
        "; is its file in millimetres? Write scale = 0.001" if unscaled and max(lengths, default=0.0) > LARGE else ""
    )


def of_validation(error: ErrorDetails, root: type[BaseModel]) -> Fault:
    """A pydantic error in the words of a scene's author."""
    keys = [str(k) for k in scene_path(error["loc"])]
    key, kind, given, context = ".".join(keys), error["type"], error.get("input"), error.get("ctx", {})
    if kind == "union_tag_not_found":
        return Fault(0, f"{key}.type", "is missing")
    if kind == "union_tag_invalid":
        names = context["expected_tags"]
        hint = nearest(context["tag"], [name.strip("' ") for name in names.split(",")])
        return Fault(0, f"{key}.type", f"{context['tag']!r} is none of {names}" + (f"; {hint}" if hint else ""))
    if kind == "extra_forbidden":
        names = _known_keys(error["loc"][:-1], root)
        return Fault(0, key, "unknown key; " + nearest(keys[-1], names, f"known: {', '.join(names)}"))
    if kind == "missing":
        return Fault(0, key, "is missing")
    if kind == "value_error":
        return Fault(0, key, str(context["error"]))
    if kind == "literal_error":
        allowed = context["expected"]
        hint = nearest(str(given), [v.strip("'") for v in allowed.replace(" or ", ", ").split(", ")])
        return Fault(0, key, f"{given!r} is none of {allowed}" + (f"; {hint}" if hint else ""))
    if kind == "tuple_type" and key in LISTS_OF_TABLES:
        return Fault(0, key, f"must be a list of tables: write [[{key}]]")
    if kind in _TYPES or kind.startswith("model_"):
        return Fault(0, key, f"{given!r} must be {_TYPES.get(kind, 'a table')}")
    message = error["msg"].replace("Input should be", "must be").replace("Tuple", "List")
    return Fault(0, key, f"{given!r}: {message}" if not isinstance(given, dict) else message)


def scene_path(path: tuple[str | int, ...]) -> list[str | int]:
    """The keys of the scene in a path of pydantic's, which also names members of unions and validators."""
    names = [str(k) for k in path]
    kept: list[str | int] = []
    for k, name in enumerate(names):
        # What follows `shape`, or a number in `shapes`, is the type that the shape names itself.
        tag = k > 0 and (names[k - 1] == "shape" or (k > 1 and names[k - 2] == "shapes"))
        if name == "[key]":
            continue
        if not tag and name not in ("float", "int", "str", "Function") and "function-" not in name:
            kept.append(path[k])
    return kept


def _known_keys(path: tuple[str | int, ...], root: type[BaseModel]) -> list[str]:
    """The keys that the table at pydantic's `path` can have."""
    models: list[Any] = [root]
    for key in (str(k) for k in path):
        fields = {field.alias or name: field for name, field in models[0].model_fields.items()}
        tagged = [m for m in models if "type" in m.model_fields and key in _walk(m.model_fields["type"].annotation)]
        if tagged:
            models = tagged
        elif key in fields:
            found = [m for m in _walk(fields[key].annotation) if isinstance(m, type) and issubclass(m, BaseModel)]
            models = found or models
    return [field.alias or name for name, field in models[0].model_fields.items()]


def _walk(annotation: Any) -> Iterator[Any]:
    yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from _walk(argument)
