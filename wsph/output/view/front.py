"""The picture of a study: error against cost."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.view.labels import COLOURS, STYLES
from wsph.output.view.packages import figure, matplotlib
from wsph.output.view.pictures import save_figure

MARKS = ("o", "s", "^", "D", "v", "P", "X")


def undominated(errors: np.ndarray) -> np.ndarray:
    """Which of the errors (n,), by rising cost, are below all that cost less, (n,) bool."""
    before = np.minimum.accumulate(np.concatenate([[np.inf], errors]))[:-1]
    return errors < before


def front(rows: Sequence[Mapping[str, str | int | float]], title: str, save: str | Path) -> None:
    """Error against right-hand sides of a study's rows, a point each, both axes logarithmic. A line joins the front of each
    variant: the rows to which it has no other that is as cheap and as near."""
    names = list(dict.fromkeys(row["variant"] for row in rows))
    below = 0.75 + 0.24 * ((len(names) + 1) // 2)
    page = below + 4.4
    made = figure(8.6, page)
    axes = made.add_axes((0.12, below / page, 0.84, 4.0 / page))
    for k, name in enumerate(names):
        mine = (row for row in rows if row["variant"] == name and row.get("error"))
        found = sorted((float(row["right_hand_sides"]), float(row["error"])) for row in mine)
        if found:
            x, y = np.array(found, float).T
            best = undominated(y)
            look: dict[str, Any] = {
                "color": COLOURS[k % len(COLOURS)],
                "marker": MARKS[(k + k // len(COLOURS)) % len(MARKS)],
            }
            axes.plot(x[best], y[best], linestyle=STYLES[k % len(STYLES)], markersize=5, label=str(name), **look)
            axes.plot(x[~best], y[~best], linestyle="", markersize=3.5, alpha=0.5, **look)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("right-hand sides")
    axes.set_ylabel("relative error")
    axes.set_title(title, loc="left", fontsize=11.0)
    axes.grid(color="#dddddd", linewidth=0.6)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(matplotlib().ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter("")
    # The names have a place of their own under the points.
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.55 / 4.0)}
    axes.legend(fontsize=8.5, frameon=False, ncols=2, **place)
    save_figure(made, save)
