"""Curves: a field along a bar, and what probes and the ledger recorded over time."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wsph.output.view.labels import COLOURS, STYLES, scaled, shown_in, titled
from wsph.output.view.packages import figure, ticks
from wsph.output.view.recorded import Shot
from wsph.output.view.scalars import Scalar

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALL, USUAL, LARGE = 8.5, 9.5, 11.0
"""Sizes of letters [points]."""


@dataclass(frozen=True)
class Mark:
    """A number that is known of a column, its "mean", "final" or "peak", in its unit, its "arrival" [s] or "frequency" [Hz],
    and half the width of its error bar, None where it has none."""

    quantity: str
    value: float
    half_width: float | None


def along(shot: Shot, shown: Scalar, limits: tuple[float, float], ends: tuple[float, float], title: str) -> "Figure":
    """The figure of a field along x, a line a body; `ends` [m] of the axis."""
    places = np.asarray(shot.grid.cell_centers().points if shown.in_cells else shot.grid.points, float)[:, 0]
    data = shot.grid.cell_data if shown.in_cells else shot.grid.point_data
    body = np.asarray(data["body"]) if "body" in data else np.zeros(len(places), int)
    made = figure(8.0, 4.2)
    axes = made.add_axes((0.11, 0.13, 0.86, 0.75))
    across, length = scaled("m", ends[1] - ends[0])
    factor, unit = shown_in(shown.unit, max(map(abs, limits)))
    numbers = np.unique(body[np.isfinite(shown.values)])
    for k, number in enumerate(numbers):
        mine = np.flatnonzero((body == number) & np.isfinite(shown.values))
        mine = mine[np.argsort(places[mine], kind="stable")]
        name = shot.bodies[number] if number < len(shot.bodies) else str(number)
        axes.plot(places[mine] * across, shown.values[mine] * factor, label=name, **_stroke(k))
    room = 0.05 * (limits[1] - limits[0])
    axes.set_xlim(ends[0] * across, ends[1] * across)
    axes.set_ylim((limits[0] - room) * factor, (limits[1] + room) * factor)
    _dress(axes, titled("x", length), titled(shown.name, unit))
    axes.set_title(title, loc="left", fontsize=LARGE)
    if len(numbers) > 1:
        axes.legend(fontsize=SMALL, frameon=False, loc="best")
    return made


def over_time(
    times: np.ndarray,
    columns: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    title: str,
    across: tuple[str, str] = ("time", "s"),
    bars: Mapping[str, float] | None = None,
    marks: Mapping[str, Mark] | None = None,
) -> "Figure":
    """The figure of columns over `times` [s], a panel for each unit; units of the columns by name, SI. `across`: the name
    and the unit of what they are drawn over, where that is another; `bars`: the half width of a band about a column, in its
    unit; `marks`: of columns that one number is known of."""
    panels: dict[str, list[str]] = {}
    for name in columns:
        panels.setdefault(units.get(name, ""), []).append(name)
    heights = [2.6 if len(panels) > 1 else 3.6] * len(panels)
    above = 0.5 + 0.17 * title.count("\n")
    page = sum(heights) + 0.45 * (len(heights) - 1) + 0.6 + above
    made = figure(8.0, page)
    shown, of_time = shown_in(across[1], float(np.abs(times).max(initial=0.0)))
    bottom, beside = page - above, any(len(names) > 1 for names in panels.values())
    for number, (unit, names) in enumerate(panels.items()):
        bottom -= heights[number]
        # The names have a column of their own beside the lines.
        axes = made.add_axes((0.11, bottom / page, 0.62 if beside else 0.86, heights[number] / page))
        largest = max((float(np.nanmax(np.abs(columns[name]), initial=0.0)) for name in names), default=0.0)
        factor, written = shown_in(unit, largest)
        for k, name in enumerate(names):
            axes.plot(times * shown, columns[name] * factor, label=name, **_stroke(k))
            if (bar := (bars or {}).get(name, 0.0)) > 0.0:
                low, high = (columns[name] - bar) * factor, (columns[name] + bar) * factor
                axes.fill_between(times * shown, low, high, color=_stroke(k)["color"], alpha=0.25, linewidth=0.0)
            if marks and name in marks:
                _mark(axes, marks[name], _stroke(k)["color"], shown, factor)
        last = number == len(panels) - 1
        _dress(axes, titled(across[0], of_time) if last else "", titled(_shared(names) or title, written))
        if len(names) > 1:
            place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.02), "borderaxespad": 0.0}
            axes.legend(fontsize=SMALL, frameon=False, **place)
        if number == 0:
            axes.set_title(title, loc="left", fontsize=LARGE)
        bottom -= 0.45
    return made


def _mark(axes: Any, mark: Mark, color: str, across: float, up: float) -> None:
    """A number with its bar as a line with a band: level, or of a time upright; a frequency has no place on the axes."""
    if mark.quantity == "frequency":
        return
    upright = mark.quantity == "arrival"
    line, band, factor = (axes.axvline, axes.axvspan, across) if upright else (axes.axhline, axes.axhspan, up)
    line(mark.value * factor, color=color, linewidth=0.9, linestyle=":")
    if mark.half_width:
        low, high = mark.value - mark.half_width, mark.value + mark.half_width
        band(low * factor, high * factor, color=color, alpha=0.25, linewidth=0.0)


def _shared(names: list[str]) -> str:
    """What the names of columns begin with: "velocity" of its components."""
    first = {name.partition("_")[0] for name in names}
    return names[0] if len(names) == 1 else first.pop() if len(first) == 1 else ""


def _stroke(k: int) -> dict[str, Any]:
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": STYLES[k % len(STYLES)], "linewidth": 1.6}


def _dress(axes: Any, across: str, up: str) -> None:
    axes.set_xlabel(across, fontsize=USUAL)
    axes.set_ylabel(up, fontsize=USUAL)
    axes.tick_params(labelsize=SMALL)
    axes.yaxis.set_major_locator(ticks(6))
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
