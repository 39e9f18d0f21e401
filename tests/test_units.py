"""Quantities: exact decimal factors, dimensions, and what is refused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsph.units import Scales, in_si, quantity, unit


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


@pytest.mark.parametrize(
    ("text", "expected", "value"),
    [("20 degC", "K", 293.15), ("20 °C", "K", 293.15), ("68 degF", "K", 293.15), ("300 K", "K", 300.0), ("450 J/kg/degC", "J/kg/K", 450.0),
     ("1e-5 1/degC", "1/K", 1e-5), ("7.85 g/cc", "kg/m3", 7850.0), ("0.5 in", "m", 0.0127), ("1 psi", "Pa", 4.4482216152605 / 0.0254**2),
     ("30 ksi", "Pa", 3e4 * 4.4482216152605 / 0.0254**2), ("1 atm", "Pa", 101325.0), ("3000 rpm", "1/s", 100.0 * math.pi), ("2 rad/s", "1/s", 2.0),
     ("0.5 %", "", 0.005), ("2 mm/m", "", 0.002), ("5 ms", "s", 5e-3), ("1 mL", "m3", 1e-6), ("1 lb", "kg", 0.45359237)],
)  # fmt: skip
def test_units_of_other_habits_are_read(text: str, expected: str, value: float) -> None:
    assert quantity(text, expected) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "expected", "message"),
    [("5 sec", "s", "did you mean 's'"), ("20 C", "K", "did you mean 'degC'"), ("2 kN", "Pa", "a force is spread over an area"), ("7.8 g", "kg/m3", "as in g/cm3"),
     ("5 ms", "m/s", "ms are milliseconds"), ("1 min", "m", "not in units of m"), ("10 mpa", "Pa", "did you mean 'MPa'"), ("1 m", "", "this is a plain number")],
)  # fmt: skip
def test_what_was_meant_is_said(value: object, expected: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        quantity(value, expected)


def test_a_milli_inch_is_no_minute() -> None:
    assert quantity("1 min", "s") == 60.0
    assert unit("min")[1] == (0, 0, 1, 0)


@pytest.mark.parametrize(
    ("text", "number", "name"),
    [("-5 MPa", -5e6, "Pa"), ("2 km/h", 2 / 3.6, "m/s"), ("3 kN/mm", 3e6, "N/m"), ("20 degC", 293.15, "K"),
     ("2 kg m2/s", 2.0, "kg^1 m^2 s^-1"), ("5 %", 0.05, "1")],
)  # fmt: skip
def test_a_string_is_converted_whatever_its_unit_is(text: str, number: float, name: str) -> None:
    assert in_si(text) == (pytest.approx(number, rel=1e-15), name)


@pytest.mark.parametrize(("given", "written"), [("-5 MPa", "-5000000, in Pa"), ("2 mm", "0.002, in m"), ("7", "7")])
def test_a_plain_number_is_offered_in_si(given: str, written: str) -> None:
    with pytest.raises(ValueError, match=f"this is a plain number: write {written}$"):
        quantity(given, "")
