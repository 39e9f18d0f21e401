"""Grids: a spacing that does not divide what it has to names those that do."""

import pytest

from tests.scenes import box, cube, shape
from wsph.geometry.grid import plan


def test_a_spacing_that_does_not_fit_names_the_two_that_do() -> None:
    with pytest.raises(ValueError, match=r"nearest that do: 0\.333333333333 m, 0\.5 m"):
        plan(shape(**cube(1)), 0.4)


SQUARE = box(4.0, 4.0)


HOLE = box((1.0, 3.0), (1.0, 2.0))


def test_a_hole_off_the_lines_names_what_fits() -> None:
    with pytest.raises(ValueError, match=r"0\.3 m does not divide what lies between 0 m and 1 m"):
        plan(shape(type="difference", shapes=[SQUARE, HOLE]), 0.3)
