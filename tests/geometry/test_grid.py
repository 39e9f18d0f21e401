"""Grids: a spacing that does not divide what it has to names those that do."""

import pytest
from pydantic import TypeAdapter

from wsph.geometry.grid import plan
from wsph.geometry.shapes.box import Box
from wsph.geometry.shapes.combined import Shape


def box(dim: int, edge: float = 1.0) -> Box:
    """A cube."""
    return Box(type="box", min=[0.0] * dim, max=[edge] * dim)


def test_a_spacing_that_does_not_fit_names_the_two_that_do() -> None:
    with pytest.raises(ValueError, match=r"nearest that do: 0\.333333333333 m, 0\.5 m"):
        plan(box(1), 0.4)


def shape(**data: object) -> object:
    """A shape from a scene's data."""
    return TypeAdapter(Shape).validate_python(data)


SQUARE = {"type": "box", "min": [0.0, 0.0], "max": [4.0, 4.0]}


HOLE = {"type": "box", "min": [1.0, 1.0], "max": [3.0, 2.0]}


def test_a_hole_off_the_lines_names_what_fits() -> None:
    with pytest.raises(ValueError, match=r"0\.3 m does not divide what lies between 0 m and 1 m"):
        plan(shape(type="difference", shapes=[SQUARE, HOLE]), 0.3)
