"""Quantities: exact decimal factors, dimensions, and what is refused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsph.units import Scales, quantity, unit


@pytest.mark.parametrize(
    ("text", "expected", "value"),
    [("90 us", "s", 9e-5), ("200 GPa", "Pa", 2e11), ("0.1 mm", "m", 1e-4), ("7.83 g/cm3", "kg/m3", 7830.0), ("1 1/s", "1/s", 1.0),
     ("3 kN/m^2", "Pa", 3e3), ("2.5e-3 s", "s", 2.5e-3), ("-8 MPa", "Pa", -8e6), ("10 km/h", "m/s", 10 / 3.6), ("1 N*m", "J", 1.0)],
)  # fmt: skip
def test_units_convert_in_decimal(text: str, expected: str, value: float) -> None:
    assert quantity(text, expected) == pytest.approx(value, rel=1e-15)


def test_a_tenth_of_a_millimetre_is_the_nearest_double() -> None:
    assert quantity("0.1 mm", "m") == 1e-4  # 0.1 * 1e-3 in binary is not


@pytest.mark.parametrize(
    ("value", "expected", "message"),
    [("2000", "kg/m3", "has no unit"), ("3 s", "m", "not in units of m"), ("3 mx", "m", "did you mean"), ("abc", "m", "not a number"),
     (True, "m", "not a number"), (math.nan, "m", "not a finite"), (math.inf, "m", "not a finite"), ("1e999 m", "m", "not a finite"),
     (None, "m", "not a number"), ("1 m/", "m", "cannot read")],
)  # fmt: skip
def test_what_is_no_quantity_is_refused_with_the_reason(value: object, expected: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        quantity(value, expected)


@given(st.floats(1e-9, 1e12), st.floats(1e-9, 1e9), st.floats(1e-3, 1e5))
def test_scales_are_consistent(length: float, time: float, density: float) -> None:
    scales = Scales(length, time, density)
    assert scales.of("Pa") == pytest.approx(scales.stress)
    assert scales.of("m/s") == pytest.approx(scales.velocity)
    assert scales.of("kg/m3") == density
    assert scales.of("") == 1.0


def test_unit_dimensions() -> None:
    assert unit("kg m^-1 s^-2")[1] == unit("Pa")[1]
