"""Quantities with units, and the scales that make the numbers inside a run of order one.

Scenes are SI; a string is a number with a unit ("90 us", "200 GPa", "0.5 mm"). The factor is applied in decimal, so
"0.1 mm" is the double nearest to 1e-4 and not a rounding away from it. Inside, a run is nondimensional: length is the
spacing, time the spacing over the wave speed, stress the density times the wave speed squared. A run then gives the
same answer in every unit system, and single precision keeps its seven digits from nanometres to kilometres.
"""

# pyright: strict

import difflib
import math
import numbers
import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, DecimalException

import numpy as np

MAX_POWER = 9

Dimension = tuple[int, int, int, int]
"""Exponents of kilogram, metre, second and kelvin."""

_BASE: dict[str, tuple[str, Dimension]] = {
    "m": ("1", (0, 1, 0, 0)),
    "in": ("0.0254", (0, 1, 0, 0)),
    "ft": ("0.3048", (0, 1, 0, 0)),
    "cc": ("1e-6", (0, 3, 0, 0)),
    "l": ("1e-3", (0, 3, 0, 0)),
    "L": ("1e-3", (0, 3, 0, 0)),
    "s": ("1", (0, 0, 1, 0)),
    "min": ("60", (0, 0, 1, 0)),
    "h": ("3600", (0, 0, 1, 0)),
    "day": ("86400", (0, 0, 1, 0)),
    "year": ("31557600", (0, 0, 1, 0)),
    "Hz": ("1", (0, 0, -1, 0)),
    "rpm": ("0.10471975511965977461542144610932", (0, 0, -1, 0)),
    "g": ("1e-3", (1, 0, 0, 0)),
    "t": ("1e3", (1, 0, 0, 0)),
    "lb": ("0.45359237", (1, 0, 0, 0)),
    "N": ("1", (1, 1, -2, 0)),
    "lbf": ("4.4482216152605", (1, 1, -2, 0)),
    "Pa": ("1", (1, -1, -2, 0)),
    "bar": ("1e5", (1, -1, -2, 0)),
    "atm": ("101325", (1, -1, -2, 0)),
    "psi": ("6894.757293168361336722673445346890694", (1, -1, -2, 0)),
    "ksi": ("6894757.293168361336722673445346890694", (1, -1, -2, 0)),
    "J": ("1", (1, 2, -2, 0)),
    "W": ("1", (1, 2, -3, 0)),
    "K": ("1", (0, 0, 0, 1)),
    "degC": ("1", (0, 0, 0, 1)),
    "degF": ("0.5555555555555555555555555555555556", (0, 0, 0, 1)),
    "rad": ("1", (0, 0, 0, 0)),
    "%": ("0.01", (0, 0, 0, 0)),
}
_PREFIX = {
    "": "1",
    "n": "1e-9",
    "u": "1e-6",
    "µ": "1e-6",
    "m": "1e-3",
    "c": "1e-2",
    "k": "1e3",
    "M": "1e6",
    "G": "1e9",
    "T": "1e12",
}
_UNPREFIXED = {
    "in",
    "ft",
    "cc",
    "min",
    "h",
    "day",
    "year",
    "rpm",
    "t",
    "lb",
    "lbf",
    "bar",
    "atm",
    "psi",
    "ksi",
    "degC",
    "degF",
    "rad",
    "%",
}
_ZERO = {"degC": Decimal("273.15"), "degF": Decimal("255.3722222222222222222222222222222")}
"""Kelvins at the zero of a scale, of a temperature by itself; in "J/degC" it is a difference."""
_UNITS: dict[str, tuple[Decimal, Dimension]] = {
    prefix + name: (Decimal(factor) * Decimal(scale), dimension)
    for name, (factor, dimension) in _BASE.items()
    for prefix, scale in _PREFIX.items()
    if not (prefix and name in _UNPREFIXED)
}
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")
_FACTOR = re.compile(r"([A-Za-zµ]+|%|1)(?:\^|\*\*)?([+-]?\d+)?")


def unit(text: str) -> tuple[Decimal, Dimension]:
    """Factor to SI and dimension of a unit such as "kg/m3", "1/s" or "m s^-1". Raises ValueError."""
    factor, dimension = Decimal(1), [0, 0, 0, 0]
    sign, rest = 1, _spelled(text)
    while rest:
        match = _FACTOR.match(rest)
        if not match:
            raise ValueError(f"cannot read the unit {text!r}")
        name, power = match[1], sign * int(match[2] or 1)
        if abs(power) > MAX_POWER:
            raise ValueError(f"the unit {text!r} has a power beyond {MAX_POWER}")
        if name != "1":
            if name not in _UNITS:
                raise ValueError(f"unknown unit {name!r}" + _instead(name))
            one, exponents = _UNITS[name]
            factor *= one**power
            dimension = [d + power * e for d, e in zip(dimension, exponents, strict=True)]
        rest = rest[match.end() :].lstrip()
        if rest:
            sign = -1 if rest[0] == "/" else 1
            rest = rest[1:].lstrip() if rest[0] in "/*·" else rest
            if not rest:
                raise ValueError(f"cannot read the unit {text!r}")
    return factor, (dimension[0], dimension[1], dimension[2], dimension[3])


_OTHERS = {
    "s": "sec secs second seconds S",
    "ms": "msec MS",
    "us": "usec",
    "h": "hr",
    "Hz": "hz",
    "m": "meter metre meters",
    "mm": "MM",
    "mm2": "Mm2",
    "in": "inch inches",
    "ft": "feet",
    "um": "micron",
    "MPa": "mpa MPA",
    "GPa": "gpa GPA",
    "kPa": "kpa KPa",
    "Pa": "pa PA",
    "psi": "PSI",
    "kg": "KG Kg",
    "g": "gr gram grams",
    "t": "ton tonne",
    "N": "newton",
    "J": "joule",
    "W": "watt",
    "degC": "C Celsius celsius",
    "degF": "F",
    "K": "Kelvin kelvin",
    "N (1 kgf = 9.80665 N)": "kgf",
    "rad (1 degree = 0.0174533 rad)": "deg",
}
_NAMES = {other: name for name, others in _OTHERS.items() for other in others.split()}
"""What is meant by other names."""


def _spelled(text: str) -> str:
    """A unit without blanks around it, its degrees in letters."""
    return text.strip().replace("°", "deg")


def _instead(name: str) -> str:
    """The unit that a name means that is none."""
    close = [_NAMES[name]] if name in _NAMES else difflib.get_close_matches(name, _UNITS, 1)
    return f"; did you mean {close[0]!r}?" if close else ""


def quantity(value: object, expected: str) -> float:
    """A scene's value in SI. `expected` is the unit that a bare number has ("" for a plain number).

    Raises ValueError where the value is no finite number, has no unit as a string, or one of another dimension.
    """
    if isinstance(value, str):
        match = _NUMBER.fullmatch(value)
        if not expected and not (match and _is_plain(match[2])):
            raise ValueError(f"{value!r} is a string; this is a plain number" + _in_si(match))
        if not match:
            raise ValueError(f'{value!r} is not a number with a unit, as in "1 {expected}"')
        if not match[2]:
            raise ValueError(
                f'{value!r} has no unit: write {match[1]} without quotes (in {expected}), or "{match[1]} {expected}"'
            )
        factor, dimension = unit(match[2])
        _, wanted = unit(expected)
        if dimension != wanted:
            raise ValueError(
                f"{value!r} is not in units of {expected or 'a plain number'}{_hint(match[2], dimension, wanted)}"
            )
        try:
            number = float(Decimal(match[1]) * factor + _ZERO.get(_spelled(match[2]), Decimal(0)))
        except (DecimalException, OverflowError):
            number = math.inf
    elif isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise ValueError(
            f"{value!r} is not a number" + (f' [{expected}], nor a string such as "1 {expected}"' if expected else "")
        )
    else:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{value!r} is not a finite number")
    return number


def _in_si(match: re.Match[str] | None) -> str:
    """What to write where a plain number is wanted and a string is given: of one with a unit the number in SI."""
    if match is None:
        return ""
    if not match[2]:
        return f": write {match[1]}"
    try:
        number, name = in_si(match[0])
    except ValueError as error:
        return f"; {error}"
    return f": write {number:.12g}, in {name}"


def in_si(text: str) -> tuple[float, str]:
    """The number of a string with any unit, in SI, and that SI unit. Raises ValueError as `quantity` does."""
    match = _NUMBER.fullmatch(text)
    if not match:
        raise ValueError(f'{text!r} is not a number, nor one with a unit, as in "1 MPa"')
    if not match[2]:
        raise ValueError(f'{text!r} has no unit: write {match[1]} without quotes (in SI), or as in "{match[1]} MPa"')
    name = _si_name(unit(match[2])[1])
    return quantity(text, name), name


_SI = ("Pa", "m/s", "m/s2", "kg/m3", "N", "J", "W", "N/m", "N/m3", "m2", "m3", "kg", "m", "s", "K", "1/s", "1")
"""Names of SI units, as messages tell them."""


def _si_name(dimension: Dimension) -> str:
    """The SI unit of a dimension."""
    known = next((name for name in _SI if unit(name)[1] == dimension), None)
    powers = zip(("kg", "m", "s", "K"), dimension, strict=True)
    return known or " ".join(f"{name}^{power}" for name, power in powers if power)


def _is_plain(text: str) -> bool:
    """Whether a unit is one of plain numbers: 1 %, 1 mm/m, 1 rad."""
    try:
        return bool(text) and unit(text)[1] == (0, 0, 0, 0)
    except ValueError:
        return False


def _hint(text: str, given: Dimension, wanted: Dimension) -> str:
    """What may have been meant where a value has another dimension than it should."""
    if given == (1, 1, -2, 0) and wanted == (1, -1, -2, 0):
        return ": a force is spread over an area, as in N/mm2; force = { ... } of a boundary takes it whole"
    if given == (1, 1, -2, 0) and wanted == (1, 0, -2, 0):
        return ": in 2D a force is per metre of depth, as in N/mm"
    if given == (1, 0, 0, 0) and wanted == (1, -3, 0, 0):
        return f": a density is a mass per volume, as in {text}/cm3"
    if given == (0, 0, 1, 0) and wanted == (0, 1, -1, 0):
        return ": ms are milliseconds; a velocity is in m/s" if text.strip() == "ms" else ": a velocity is in m/s"
    return ""


@dataclass(frozen=True)
class Scales:
    """SI values of the units inside a run: `length` [m], `time` [s], `density` [kg/m3]."""

    length: float
    time: float
    density: float

    def of(self, unit_text: str) -> float:
        """SI value of one inner unit of the quantity whose SI unit is `unit_text`."""
        _, (kilograms, metres, seconds, _) = unit(unit_text)  # a temperature stays in kelvins
        # Multiplied out of a mass, a stress would lose the exponent range at a nanometre: m^3 is 1e-27.
        return self.density**kilograms * self.length ** (metres + 3 * kilograms) * self.time**seconds

    @property
    def velocity(self) -> float:
        """[m/s]"""
        return self.length / self.time

    @property
    def stress(self) -> float:
        """[Pa]"""
        return self.density * self.velocity**2


def looks_like_quantity(text: str) -> bool:
    """A number followed by a unit's name, as in "1 m/s"; "2 * x" and "1e3" are not."""
    match = _NUMBER.fullmatch(text)
    return bool(match and re.match(r"(?!x\b|y\b|z\b|t\b|and\b|or\b)[A-Za-zµ°%]|1\s*/\s*[A-Za-z]", match[2]))


def rounded(place: Iterable[float]) -> list[float]:
    """A position as messages tell it: six digits of each coordinate, and no negative zero."""
    return [float(f"{x:.6g}") + 0.0 for x in place]


def rounded_down(number: float, digits: int) -> str:
    """So many digits of a positive number, none of them rounded up: what a message suggests has to do."""
    unit = 10.0 ** (math.floor(math.log10(number)) + 1 - digits)
    return f"{math.floor(number / unit * (1.0 + 1e-9)) * unit:.{digits}g}"
