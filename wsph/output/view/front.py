"""The picture of a study: error against work."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.view.curves import LARGE, SMALL, USUAL
from wsph.output.view.labels import COLOURS, STYLES
from wsph.output.view.packages import figure, matplotlib
from wsph.output.view.pictures import save_figure

Row = Mapping[str, str | int | float | None]

MARKS = ("o", "s", "^", "D", "v", "P", "X")
FILLED = (True, False)

LINE = 0.21
"""Height of a line of names under the chart [inches]."""


@dataclass(frozen=True)
class Points:
    """The rows of a variant by rising work (n,): `errors`, the ends of their `bars`, not a number where there is none, and
    `particles`."""

    work: np.ndarray
    errors: np.ndarray
    bars: np.ndarray
    particles: np.ndarray

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "Points":
        """Those of rows that have an error, against an exact answer or estimated."""
        found = [(row, row.get("error") or row.get("estimate")) for row in rows]
        table = [
            (_number(row["pair_visits"]), _number(error), _number(row.get("bar")), _number(row["particles"]))
            for row, error in found
            if error
        ]
        return cls(*np.array(sorted(table), float).reshape(-1, 4).T)


def _number(value: str | int | float | None) -> float:
    return float(value) if value is not None else np.nan


def undominated(errors: np.ndarray) -> np.ndarray:
    """Which of the errors (n,), by rising cost, are below all that cost less, (n,) bool."""
    before = np.minimum.accumulate(np.concatenate([[np.inf], errors]))[:-1]
    return errors < before


def front(rows: Sequence[Row], title: str, save: str | Path) -> None:
    """Error against the pair visits of a study's rows, a point each, both axes logarithmic. A line joins the front of each
    variant: the rows to which it has no other that is as cheap and as near; the others are small and faint. A whisker ends
    at a row's bar: of the finest one where errors are against an exact answer, of all where they are estimates. Beside the
    names stand the particles of the coarsest and of the finest row."""
    variants = {str(name): Points.of([row for row in rows if row["variant"] == name]) for name in _names(rows)}
    lines = (len(variants) + 1) // 2
    below = 0.72 + LINE * (lines + 1)
    page = below + 3.5
    made = figure(7.6, page)
    axes = made.add_axes((0.105, below / page, 0.875, 3.1 / page))
    exact = any(row.get("error") for row in rows)
    for k, (name, points) in enumerate(variants.items()):
        if len(points.work):
            _draw(axes, name, points, k, exact)
        else:
            axes.plot([], [], linestyle="", label=f"{name}: no error known")
    _dress(axes, title, exact)
    # The names have a place of their own under the points.
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.46, -0.44 / 3.1)}
    heading: dict[str, Any] = {"title": "in brackets: particles", "title_fontsize": SMALL, "alignment": "left"}
    axes.legend(fontsize=SMALL, frameon=False, ncols=2, handlelength=3.2, **heading, **place)
    save_figure(made, save)


def _names(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(str(row["variant"]) for row in rows))


def _draw(axes: Any, name: str, points: Points, k: int, exact: bool) -> None:
    """A variant: its front joined, the rest faint, bars as whiskers, with `exact` errors that of the finest row alone."""
    best, colour = undominated(points.errors), COLOURS[k % len(COLOURS)]
    turn = (k // len(COLOURS)) % 2  # a second round is told by its shift of marks, and by marks that are empty
    look: dict[str, Any] = {
        "color": colour,
        "marker": MARKS[(k + turn) % len(MARKS)],
        "markerfacecolor": colour if FILLED[turn] else "white",
    }
    x, y = points.work, points.errors
    few, many = points.particles.min(), points.particles.max()
    label = f"{name} ({few:.0f}" + (f" to {many:.0f})" if many > few else ")")
    axes.plot(x[best], y[best], linestyle=STYLES[k % len(STYLES)], linewidth=1.5, markersize=5.5, label=label, **look)
    axes.plot(x[~best], y[~best], linestyle="", markersize=3.5, alpha=0.5, **look)
    told = best & np.isfinite(points.bars)
    told &= (points.particles == many) | (not exact)
    ends = np.array([y[told], np.maximum(points.bars[told], y[told])])
    axes.vlines(x[told], *ends, color=colour, linewidth=0.9, alpha=0.7)
    axes.plot(x[told], ends[1], linestyle="", marker="_", markersize=6.0, color=colour, alpha=0.7)


def _dress(axes: Any, title: str, exact: bool) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("work [pair visits]", fontsize=USUAL)
    axes.set_ylabel("relative error" if exact else "relative error (estimate, bar)", fontsize=USUAL)
    axes.set_title(title, loc="left", fontsize=LARGE)
    axes.tick_params(labelsize=SMALL)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    locate = matplotlib().ticker
    for axis, (low, high), written in ((axes.xaxis, axes.get_xlim(), _power), (axes.yaxis, axes.get_ylim(), _percent)):
        # Two decades or less have few powers of ten.
        axis.set_major_locator(locate.LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
        axis.set_major_formatter(written)
        axis.set_minor_formatter("")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _power(value: float, _: object) -> str:
    power = math.floor(math.log10(value) + 1e-9)
    first = round(value / 10.0**power)
    return f"$10^{{{power}}}$" if first == 1 else rf"${first}\cdot 10^{{{power}}}$"


def _percent(value: float, _: object) -> str:
    return f"{100.0 * value:g} %"
