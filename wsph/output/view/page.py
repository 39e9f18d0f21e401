"""A page: the image of bodies with axes, a bar of its colours, time and range, each in a place of its own."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wsph.output.fields import AXES
from wsph.output.view.labels import scaled, shown_in, titled
from wsph.output.view.packages import DPI, figure, matplotlib, ticks
from wsph.output.view.window import Window

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HIGHEST, NARROWEST = 8.6, 5.6, 4.6
"""Of a page, of the image on it, and the least width of a page [inches]."""

UPRIGHT = 0.4
"""From this height of an image, over its width, on the bar stands beside it, and otherwise under it."""

NOTHING = 1e-12
"""Part of the largest value from which on a value is not nothing."""

SMALL, USUAL, LARGE = 8.5, 9.5, 11.0
"""Sizes of letters [points]."""


@dataclass(frozen=True)
class Legend:
    """The words of a page: the `name` and `unit` of what is shown, `limits` of the colours and `ends`, the least and the
    largest value, both SI, a `title`, and the colours' name."""

    name: str
    unit: str
    limits: tuple[float, float]
    ends: tuple[float, float]
    title: str
    colours: str


@dataclass(frozen=True)
class Frame:
    """Where the image is on its page: margins and sizes [inches]."""

    left: float
    bottom: float
    width: float
    height: float
    page: tuple[float, float]
    upright: bool

    @classmethod
    def of(cls, window: Window) -> "Frame":
        """The places for an image of a window."""
        upright, angle = window.aspect >= UPRIGHT, window.axes is None
        left, right = (0.95, 1.45 if upright else 0.4) if not angle else (0.95, 1.9 if upright else 0.95)
        bottom = (0.6 if not angle else 0.75) + (0.0 if upright else 0.75)
        top = 0.65
        width = WIDTH - left - right
        height = width * window.aspect
        if height > HIGHEST:
            width, height = width * HIGHEST / height, HIGHEST
        page = max(left + width + right, NARROWEST)
        left += 0.5 * (page - left - width - right)
        return cls(left, bottom, width, height, (page, bottom + height + top), upright)

    @property
    def pixels(self) -> tuple[int, int]:
        """Of the image."""
        return max(round(self.width * DPI), 1), max(round(self.height * DPI), 1)

    def place(self, left: float, bottom: float, width: float, height: float) -> tuple[float, float, float, float]:
        """A rectangle [inches] in parts of the page."""
        return left / self.page[0], bottom / self.page[1], width / self.page[0], height / self.page[1]


def page(window: Window, legend: Legend, image: Callable[[tuple[int, int]], np.ndarray]) -> "Figure":
    """The figure of an image that is made for a number of pixels."""
    frame = Frame.of(window)
    made = figure(*frame.page)
    axes = made.add_axes(frame.place(frame.left, frame.bottom, frame.width, frame.height))
    factor, unit = scaled("m", max(window.width, window.height))
    left, right, bottom, top = (factor * each for each in window.extent)
    axes.imshow(image(frame.pixels), extent=(left, right, bottom, top), aspect="auto", interpolation="antialiased")
    said: list[str] = []
    if window.axes is not None:
        _flat_axes(axes, window.axes, frame, unit)
    else:
        axes.set_axis_off()
        said = _edges(axes, window, frame, factor, unit)
    _bar(made, frame, legend)
    inner = frame.place(frame.left if window.axes else 0.3, frame.bottom + frame.height, 0.0, 0.0)
    made.text(inner[0], inner[1] + 0.38 / frame.page[1], legend.title, fontsize=LARGE, va="baseline")
    largest = max(map(abs, legend.ends))
    scale, named = shown_in(legend.unit, largest)
    least, most = (value * scale if abs(value) > NOTHING * largest else 0.0 for value in legend.ends)
    values = f"from {least:.4g} to {most:.4g}{f' {named}' if named else ''}"
    words = ",  ".join([values, *said])
    made.text(inner[0], inner[1] + 0.14 / frame.page[1], words, fontsize=SMALL, color="#404040", va="baseline")
    return made


def _flat_axes(axes: Any, along: tuple[int, int], frame: Frame, unit: str) -> None:
    axes.set_xlabel(titled(AXES[along[0]], unit), fontsize=USUAL)
    axes.set_ylabel(titled(AXES[along[1]], unit), fontsize=USUAL)
    axes.xaxis.set_major_locator(ticks(max(1, min(9, int(frame.width / 0.75)))))
    axes.yaxis.set_major_locator(ticks(max(1, min(9, int(frame.height / 0.4)))))
    axes.tick_params(labelsize=SMALL)


def _bar(made: Any, frame: Frame, legend: Legend) -> None:
    """The bar of the colours, with its unit; a pointed end says that values go on beyond it."""
    mpl: Any = matplotlib()
    low, high = legend.limits
    factor, unit = shown_in(legend.unit, max(abs(low), abs(high)))
    slack = 1e-9 * (high - low)
    below, above = legend.ends[0] < low - slack, legend.ends[1] > high + slack
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[below, above]
    colours = mpl.cm.ScalarMappable(mpl.colors.Normalize(low * factor, high * factor), legend.colours)
    if frame.upright:
        height = max(0.8 * frame.height, min(frame.height, 2.0))
        right = frame.page[0] - 1.25
        place = frame.place(right, frame.bottom + 0.5 * (frame.height - height), 0.17, height)
    else:
        width = min(frame.width, 5.0)
        place = frame.place(frame.left + 0.5 * (frame.width - width), 0.52, width, 0.15)
    axes = made.add_axes(place)
    orientation = "vertical" if frame.upright else "horizontal"
    bar = made.colorbar(colours, cax=axes, orientation=orientation, extend=extend, extendfrac=0.03)
    bar.set_label(titled(legend.name, unit), fontsize=USUAL)
    bar.locator = ticks(6)
    bar.update_ticks()
    bar.ax.tick_params(labelsize=SMALL)


def _edges(axes: Any, window: Window, frame: Frame, factor: float, unit: str) -> list[str]:
    """Axes of what is seen at an angle: three edges of its box that nothing hides, with their ticks outside. Returns what is
    to be said of edges too short for ticks."""
    said: list[str] = []
    eye = window.towards > 0.0
    near, far = np.where(eye, window.high, window.low), np.where(eye, window.low, window.high)
    inch = frame.width / (window.width * factor)
    for axis in range(3):
        start = near.copy()
        start[2] = far[2]
        if axis == 2:
            sides = [np.array([far[0], near[1], 0.0]), np.array([near[0], far[1], 0.0])]
            start = min(sides, key=lambda side: float(side @ window.right))
        ends = np.stack([start, start])
        ends[:, axis] = window.low[axis], window.high[axis]
        if window.high[axis] > window.low[axis]:
            middle = window.onto(0.5 * (window.low + window.high)[None])[0]
            low, high = _zeroed(ends[:, axis]) * factor
            label = titled(AXES[axis], unit)
            if not _edge(axes, window.onto(ends) * factor, (low, high), middle * factor, inch, label):
                said.append(f"{AXES[axis]} from {low:.4g} to {high:.4g} {unit}")
    return said


def _zeroed(ends: np.ndarray) -> np.ndarray:
    """Ends of an axis, of which one is zero where it is but the rounding of a cut."""
    return np.where(np.abs(ends) > NOTHING * np.abs(ends).max(), ends, 0.0)


def _edge(
    axes: Any, ends: np.ndarray, values: tuple[float, float], middle: np.ndarray, inch: float, label: str
) -> bool:
    """An axis between `ends` (2, 2) on the page, of what goes there from one of the `values` to the other; `inch` in one
    unit of the page. Returns whether it has ticks."""
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along)) * inch
    out = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    out *= np.sign(out @ (ends.mean(0) - middle)) or 1.0
    sides = {
        "ha": "right" if out[0] < -0.35 else "left" if out[0] > 0.35 else "center",
        "va": "top" if out[1] < -0.35 else "bottom" if out[1] > 0.35 else "center",
    }
    axes.plot(*ends.T, color="black", linewidth=0.8, clip_on=False)
    found = ticks(max(1, int(length / 0.5))).tick_values(*values) if length > 0.5 else []
    share = (np.asarray(found) - values[0]) / (values[1] - values[0])
    inside = (share * length > 0.15) & ((1.0 - share) * length > 0.15)
    words = [f"{tick:.6g}" for tick in np.asarray(found)[inside]]
    for part, word in zip(share[inside], words, strict=True):
        foot = ends[0] + part * along
        tip = foot + 0.06 / inch * out
        axes.plot(*np.stack([foot, tip]).T, color="black", linewidth=0.8, clip_on=False)
        axes.text(*(foot + 0.1 / inch * out), word, fontsize=SMALL, **sides)
    if not words:
        label = label.partition(" ")[0]
    wide = max([0, *map(len, words)])
    away = 0.14 + (0.075 * wide + 0.06) * abs(out[0]) + 0.2 * abs(out[1]) if words else 0.12
    axes.text(*(ends.mean(0) + away / inch * out), label, fontsize=USUAL, **sides)
    return bool(words)
