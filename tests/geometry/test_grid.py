"""Grids: a spacing that does not divide what it has to names those that do."""

import pytest

from tests.scenes import box, cube, shape
from wsph.geometry.grid import plan
from wsph.geometry.shapes.box import Box


def test_a_spacing_that_does_not_fit_names_the_two_that_do() -> None:
    with pytest.raises(ValueError, match=r"nearest that do: 0\.333333333333 m, 0\.5 m"):
        plan(shape(**cube(1)), 0.4)


SQUARE = box(4.0, 4.0)


HOLE = box((1.0, 3.0), (1.0, 2.0))


def test_a_hole_off_the_lines_names_what_fits() -> None:
    with pytest.raises(ValueError, match=r"0\.3 m does not divide what lies between 0 m and 1 m"):
        plan(shape(type="difference", shapes=[SQUARE, HOLE]), 0.3)


def test_the_neighbours_that_are_offered_divide_every_edge() -> None:
    """100 x 20 x 10 mm at 3 mm: 2.5 and 3.33 mm divide all three edges, 2.94 and 3.03 mm only the first."""
    block = Box(type="box", min=(0.0, 0.0, 0.0), max=(0.1, 0.02, 0.01))
    with pytest.raises(
        ValueError, match=r"0\.003 m does not divide .*; the nearest that do: 0\.0025 m, 0\.00333333333333 m"
    ):
        plan(block, 0.003)
    for spacing in (0.0025, 0.01 / 3.0):
        assert plan(block, spacing).count.min() > 0
