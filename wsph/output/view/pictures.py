"""Pictures of a run: one frame as a figure, or many with one range of colours and one window."""

# pyright: strict
# pyright: reportUnknownMemberType=false

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wsph.errors import OutputError
from wsph.output.fields import AXES
from wsph.output.view import recorded
from wsph.output.view.bodies import Drawn, drawn, image, paint, point_at
from wsph.output.view.curves import along
from wsph.output.view.labels import scaled, time_label, titled
from wsph.output.view.look import Look, Plane, chosen
from wsph.output.view.movie import MOVIES, writer
from wsph.output.view.packages import pyvista
from wsph.output.view.page import Legend, page
from wsph.output.view.recorded import Shot
from wsph.output.view.scalars import Scalar, scalar
from wsph.output.view.window import window

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pyvista import Plotter

USUAL = 99.5
"""Colours go up to twice as far as this part of the values does [%]: one particle does not leave all others alike."""


@dataclass(frozen=True)
class Range:
    """What frames have in common: `ends` of their values, and how far `usual` ones go, SI; `bounds` (6,) [m] of all, and the
    `longest` time [s]."""

    ends: tuple[float, float]
    usual: tuple[float, float]
    bounds: tuple[tuple[float, ...], ...]
    longest: float
    flat: int

    @classmethod
    def of(cls, shot: Shot, shown: Scalar, bounds: tuple[float, ...]) -> "Range":
        """That of one frame."""
        there = shown.finite
        low, high = float(there.min()), float(there.max())
        few, many = (float(each) for each in np.percentile(there, (100.0 - USUAL, USUAL)))
        return cls(
            (low, high), (high - 2.0 * (high - few), low + 2.0 * (many - low)), (bounds,), abs(shot.time), shot.flat
        )

    def joined(self, other: "Range") -> "Range":
        """That of both."""
        ends, usual = (
            (min(a[0], b[0]), max(a[1], b[1])) for a, b in ((self.ends, other.ends), (self.usual, other.usual))
        )
        longest, flat = max(self.longest, other.longest), max(self.flat, other.flat)
        return Range(ends, usual, self.bounds + other.bounds, longest, flat)

    def limits(self, asked: tuple[float, float] | None) -> tuple[float, float]:
        """From where to where colours go: as asked, or over the usual values."""
        if asked is not None:
            return asked
        low, high = self.ends
        if high - low <= 1e-12 * max(abs(high), abs(low)):
            margin = 0.05 * max(abs(high), abs(low)) or 1.0
            return low - margin, high + margin
        bottom, top = max(low, self.usual[0]), min(high, self.usual[1])
        return (low if bottom >= high else bottom), (high if top <= low else top)


@dataclass(frozen=True)
class Prepared:
    """A frame ready to be drawn."""

    shot: Shot
    shown: Scalar
    bodies: Drawn | None
    """None where it is a curve."""

    @property
    def range(self) -> Range:
        """What it spans."""
        bounds = tuple(self.shot.grid.bounds) if self.bodies is None else self.bodies.bounds
        return Range.of(self.shot, self.shown, bounds)


def prepared(shot: Shot, look: Look) -> Prepared:
    """A frame with all but the words of its picture. Raises OutputError for what it does not have."""
    shot = look.prepared(shot)
    shown = scalar(shot, look.field, look.smooth)
    if _is_curve(shot):
        return Prepared(shot, shown, None)
    return Prepared(shot, shown, drawn(shot, shown, look))


def _is_curve(shot: Shot) -> bool:
    ends = np.reshape(shot.grid.bounds, (3, 2))
    return bool((ends[1:, 1] == ends[1:, 0]).all())


def figure(frame: Prepared, look: Look, whole: Range) -> "Figure":
    """The figure of a frame, with what it has in common with others. Raises OutputError where nothing is a number."""
    own, limits = frame.range, whole.limits(look.limits)
    title = ",  ".join([time_label(frame.shot.time, whole.longest), *_said(look, frame.shot)])
    if frame.bodies is None:
        ends = min(each[0] for each in whole.bounds), max(each[1] for each in whole.bounds)
        return along(frame.shot, frame.shown, limits, ends, title)
    bodies = frame.bodies
    seen = window(whole.bounds, look.direction(frame.shot))
    legend = Legend(frame.shown.name, frame.shown.unit, limits, own.ends, title, look.colours)
    flat = whole.flat < 3 or look.slice is not None
    return page(seen, legend, lambda pixels: image(bodies, look, limits, seen, pixels, flat))


def plotter(shot: Shot, look: Look) -> "Plotter":
    """A frame to turn with the mouse, in a window or a notebook, by its `show()`. Raises OutputError for what it lacks."""
    frame = prepared(shot, look)
    grid = frame.shot.grid.copy()
    name = f"{frame.shown.name} [{frame.shown.unit}]" if frame.shown.unit else frame.shown.name
    (grid.cell_data if frame.shown.in_cells else grid.point_data)[name] = frame.shown.values
    made = pyvista().Plotter()
    limits = list(frame.range.limits(look.limits))
    made.add_mesh(
        grid, scalars=name, cmap=look.colours, clim=limits, show_edges=look.mesh, render_points_as_spheres=True
    )
    made.add_text(f"t = {frame.shot.time:.6g} s", font_size=8)
    if frame.shot.flat < 3:
        made.view_xy()
    return made


def _said(look: Look, shot: Shot) -> list[str]:
    """What the options make of a picture, in words."""
    said = [] if look.body is None else [look.body]
    if look.warp is not None:
        said.append(f"displacements × {look.warp:g}")
    for kind, plane in (("slice at", look.slice), ("cut at", look.clip)):
        if plane is not None:
            said.append(f"{kind} {_place(plane, shot)}")
    return said


def _place(plane: Plane, shot: Shot) -> str:
    at = plane.origin(shot.grid.bounds)[plane.axis]
    ends = shot.grid.bounds[2 * plane.axis : 2 * plane.axis + 2]
    factor, unit = scaled("m", max(map(abs, ends)))
    return f"{AXES[plane.axis]} = {at * factor:.4g} {unit}"


def picture(shot: Shot, look: Look) -> "Figure":
    """The figure of a frame by itself."""
    frame = prepared(shot, look)
    return figure(frame, look, frame.range)


def save_figure(made: "Figure", path: str | Path) -> None:
    """Save a figure as .png, or another kind that matplotlib writes. Raises OutputError."""
    if Path(path).suffix not in (".png", ".pdf", ".svg"):
        raise OutputError(f"{path}: a picture is .png, .pdf or .svg")
    try:
        made.savefig(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error


def view(folder: Path, look: Look, save: Path | None, time: str | None = None) -> None:
    """Show a frame of a run, or save it, or many as a movie. `time`: the nearest to one, or a range. Raises OutputError."""
    found = recorded.frames(folder)
    moving = save is not None and save.suffix in MOVIES
    those = [found[k] for k in chosen(np.array([each for each, _ in found]), time, moving)]
    if save is None:
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or sys.platform in ("win32", "darwin")):
            raise OutputError("there is no display to show a picture on; save it with --save FILE.png")
        _show(recorded.read(*those[-1]), look)
    elif not moving and save.suffix not in (".png", ".pdf", ".svg"):
        raise OutputError(f"{save}: a picture is .png, .pdf or .svg, a movie {' or '.join(MOVIES)}")
    elif moving:
        _animate(those, look, save)
    else:
        whole = None
        for each in those[:-1]:
            whole = _with(whole, prepared(recorded.read(*each), look).range)
        frame = prepared(recorded.read(*those[-1]), look)
        save_figure(figure(frame, look, _with(whole, frame.range)), save)


def _with(whole: Range | None, own: Range) -> Range:
    return own if whole is None else whole.joined(own)


def _animate(those: Sequence[tuple[float, Path]], look: Look, save: Path) -> None:
    """Save frames as a movie, with one range of colours and one window. Each is read twice, and none is kept."""
    movie = writer(save)
    make: Callable[[tuple[float, Path]], Prepared] = lambda each: prepared(recorded.read(*each), look)  # noqa: E731
    whole = None
    for each in those:
        whole = _with(whole, make(each).range)
    if whole is not None:
        common = whole
        movie(figure(make(each), look, common) for each in those)


def _show(shot: Shot, look: Look) -> None:
    """A window to turn the bodies in."""
    frame = prepared(shot, look)
    if frame.bodies is None:
        raise OutputError("a curve is no body to turn: save it with --save FILE.png")
    whole = frame.range
    seen, flat = window(whole.bounds, look.direction(frame.shot)), whole.flat < 3 or look.slice is not None
    plotter = pyvista().Plotter(window_size=[1000, 700])
    paint(plotter, frame.bodies, look, whole.limits(look.limits), flat, seen.width / 900)
    plotter.add_scalar_bar(title=titled(frame.shown.name, frame.shown.unit), vertical=True, position_x=0.88)
    plotter.show_bounds(xtitle="x [m]", ytitle="y [m]", ztitle="z [m]", location="outer")
    plotter.add_text(time_label(shot.time, shot.time), font_size=10)
    point_at(plotter, seen)
    plotter.show()
