"""What of a scene has numbers that people read off, by name: boundaries and sections, beside contacts and tools."""

# pyright: strict

import re
from collections import Counter
from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from wsph.boundary.tables import Boundary
from wsph.declarations import example
from wsph.quantities import Model, Point, Unit, as_tuple, file_name

NUMBERS = ("force", "torque", "work")
"""Fields of a probe `of` a boundary, a contact, a tool or a section."""


class Section(Model):
    """A plane through a body in its reference configuration: a `point` on it and a `normal` of any length. Its force is what
    the part of the body on the side that the normal points to does to the other."""

    model_config = example({"name": "root", "body": "bar", "point": ["10 mm", 0.0], "normal": [1.0, 0.0]})
    name: Annotated[str, AfterValidator(file_name)]
    """of its numbers in history.csv"""
    body: str
    """that it cuts"""
    point: Point
    """on the plane, in the reference"""
    normal: Annotated[
        tuple[Annotated[float, Unit("")], ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=3)
    ]
    """of any length; its side acts on the other"""


def boundary_names(boundaries: Sequence[Boundary]) -> tuple[str, ...]:
    """The names of boundaries: the given ones, or BODY-1, BODY-2, ... in the order of the file among those of a body."""
    seen = Counter[str]()
    found: list[str] = []
    for boundary in boundaries:
        seen[boundary.body] += 1
        body = re.sub(r"^[.-]|[^A-Za-z0-9_.-]", "_", boundary.body)
        found.append(boundary.name or f"{body}-{seen[boundary.body]}")
    return tuple(found)
