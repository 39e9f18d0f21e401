"""Numbers of pictures in units that read well, and the lines of charts."""

# pyright: strict

import numpy as np

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))

SCALED = ("Pa", "m", "s", "J", "J/m", "J/m2", "N", "N/m", "N/m2", "N m")
"""Units that take a prefix."""

COLOURS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours that the colour-blind tell apart (Okabe & Ito 2008), without yellow, which white swallows."""

STYLES = ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)), (0, (1, 2)), (0, (8, 3)))
"""Strokes, so that lines are told apart in grey too."""


def scaled(unit: str, largest: float) -> tuple[float, str]:
    """The factor with which numbers in an SI unit, of that size at most, are shown, and the unit then."""
    if unit not in SCALED or not np.isfinite(largest) or largest <= 0.0:
        return 1.0, unit
    size, prefix = next((each for each in PREFIXES if largest >= 0.9995 * each[0]), PREFIXES[-1])
    if (unit == "m" and 0.9995 <= largest < 1000.0) or (unit == "m" and size > 1.0):
        return 1.0, unit
    return 1.0 / size, f"{prefix}{unit}"


def shown_in(unit: str, largest: float) -> tuple[float, str]:
    """As `scaled`, for any unit: where it takes no prefix, very large and very small numbers have a power of ten."""
    if unit in SCALED:
        return scaled(unit, largest)
    plain = "" if unit == "1" else written(unit)
    if not np.isfinite(largest) or largest == 0.0 or 0.01 <= largest < 1e4:
        return 1.0, plain
    power = int(np.floor(np.log10(largest)))
    digits = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return 10.0**-power, f"10{digits} {plain}".strip()


def titled(name: str, unit: str) -> str:
    """A name with its unit in brackets, "[1]" of a plain number left out."""
    return name if unit in ("", "1") else f"{name} [{written(unit)}]"


def written(unit: str) -> str:
    """A unit with its powers raised."""
    return unit.replace("m2", "m²").replace("m3", "m³")


def time_label(time: float, longest: float) -> str:
    """A time [s] in the unit that suits the `longest` of its run."""
    factor, unit = scaled("s", longest)
    return f"t = {time * factor:.4g} {unit}"
