"""What a picture shows of a frame: the options of `wsph view`, and the words that they are given in."""

# pyright: strict

import re
from dataclasses import dataclass

import numpy as np

from wsph.errors import OutputError
from wsph.output.fields import AXES
from wsph.output.view.recorded import Shot
from wsph.units import quantity, unit

CAMERAS = {
    "xy": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "xz": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "yz": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "iso": ((1.0, -1.6, 0.9), (0.0, 0.0, 1.0)),
}
"""From where one looks, and what is up, by name."""

NUMBER = r"[-+]?[\d.]+(?:e[-+]?\d+)?"
"""A number as options have it."""

COLOURS = ("viridis", "cividis", "gray")
"""Colours whose lightness alone says how much."""


@dataclass(frozen=True)
class Plane:
    """A plane across an axis, at a coordinate [m] or in the middle of what is cut; of a clip the side that is kept is that
    `above` it or the other."""

    axis: int
    at: float | None = None
    above: bool = True

    def origin(self, bounds: tuple[float, ...]) -> list[float]:
        """A point on it. Raises OutputError where it does not meet the bounds (6,) [m]."""
        low, high = bounds[2 * self.axis : 2 * self.axis + 2]
        middle = [0.5 * (bounds[2 * k] + bounds[2 * k + 1]) for k in range(3)]
        if self.at is not None:
            if not low <= self.at <= high:
                raise OutputError(
                    f"{AXES[self.axis]} = {self.at:g} m does not meet the body, which is from {low:g} to {high:g} m"
                )
            middle[self.axis] = self.at
        return middle


@dataclass(frozen=True)
class Look:
    """The field of a picture, "" for the velocity or the first that there is, and how it is shown: one `body`,
    displacements times `warp`, a `camera` by name, a `slice` or a `clip`, values from and to (SI) in `limits`, `smooth`:
    as recovered at nodes, `mesh`: with the edges of the cells; what is damaged beyond `broken` is left out."""

    field: str = ""
    body: str | None = None
    warp: float | None = None
    camera: str | None = None
    slice: Plane | None = None
    clip: Plane | None = None
    limits: tuple[float, float] | None = None
    smooth: bool = False
    mesh: bool = False
    colours: str = "viridis"
    broken: float | None = None

    def prepared(self, shot: Shot) -> Shot:
        """A frame with the body and the displacements that are asked for."""
        if self.body is not None:
            shot = shot.body(self.body)
        if self.warp is not None:
            shot = shot.warped(self.warp)
        return shot if self.broken is None else shot.whole(self.broken)

    def direction(self, shot: Shot) -> str:
        """The name of the camera: as asked, along the normal of a slice, on flat bodies from above, else at an angle."""
        if self.camera is not None:
            return self.camera
        if self.slice is not None and shot.flat == 3:
            return {0: "yz", 1: "xz", 2: "xy"}[self.slice.axis]
        return "iso" if shot.flat == 3 else "xy"


def plane(text: str, cut: str = "=") -> Plane:
    """A plane from "x" or "x=0.5"; with `cut` "<>" from "x", "x<0.5" or "x>5 mm". Raises OutputError."""
    match = re.fullmatch(rf"([xyz])(?:\s*([{cut}])\s*(.+))?", text.strip())
    if match is None:
        raise OutputError(f"{text!r} is no plane: write an axis, or as {'z=5 mm' if cut == '=' else 'z<5 mm'}")
    at = None if match[3] is None else number(match[3], "m", text)
    return Plane(AXES.index(match[1]), at, match[2] != "<")


def span(text: str, of: str | None = None) -> tuple[float, float]:
    """Two numbers from "LOW:HIGH" in SI, with or without a unit, whichever or that `of` a kind; a unit of the second alone
    is that of both. Raises OutputError."""
    low, colon, high = text.partition(":")
    if not colon:
        raise OutputError(f"{text!r} is no range: write it as LOW:HIGH")
    if re.fullmatch(rf"\s*{NUMBER}\s*", low, re.IGNORECASE):
        low += re.sub(rf"^\s*{NUMBER}", " ", high, flags=re.IGNORECASE)
    ends = (number(low, of, text), number(high, of, text))
    if ends[0] >= ends[1]:
        raise OutputError(f"{text!r}: the first is to be less than the second")
    return ends


def number(text: str, of: str | None, whole: str) -> float:
    """A number in SI, with or without a unit, that is to be one `of` a kind. Raises OutputError that names the `whole`."""
    match = re.fullmatch(rf"\s*({NUMBER})\s*(.*?)\s*", text, re.IGNORECASE)
    try:
        if match is None:
            raise ValueError(f"{text!r} is no number")
        if not match[2]:
            return float(match[1])
        return quantity(f"{match[1]} {match[2]}", of) if of else float(match[1]) * float(unit(match[2])[0])
    except ValueError as error:
        raise OutputError(f"{whole!r}: {error}") from None


def chosen(times: np.ndarray, text: str | None, whole_run: bool) -> list[int]:
    """Which of the frames at `times` [s] a text names: all or the last where there is none, the nearest to a time, those in
    a range. Raises OutputError for a range without frames."""
    if text is None:
        return list(range(len(times))) if whole_run else [len(times) - 1]
    if ":" not in text:
        return [int(np.abs(times - number(text, "s", text)).argmin())]
    low, high = span(text, "s")
    slack = 1e-9 * max(abs(low), abs(high))
    found = np.flatnonzero((times >= low - slack) & (times <= high + slack)).tolist()
    if not found:
        raise OutputError(
            f"no frame from {low:g} to {high:g} s; there are {len(times)} from {times[0]:g} to {times[-1]:g} s"
        )
    return found
