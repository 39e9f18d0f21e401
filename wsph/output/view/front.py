"""The picture of a study: error against cost."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.view.labels import COLOURS, STYLES
from wsph.output.view.packages import figure
from wsph.output.view.pictures import save_figure

MARKS = ("o", "s", "^", "D", "v", "P", "X")


def undominated(errors: np.ndarray) -> np.ndarray:
    """Which of the errors (n,), by rising cost, are below all that cost less, (n,) bool."""
    before = np.minimum.accumulate(np.concatenate([[np.inf], errors]))[:-1]
    return errors < before


def front(rows: Sequence[Mapping[str, str | int | float]], title: str, save: str | Path) -> None:
    """Error against right-hand sides of a study's rows, a point each, both axes logarithmic. A line joins the front of each
    variant: the rows to which it has no other that is as cheap and as near."""
    made = figure(8.6, 5.0)
    axes = made.add_axes((0.09, 0.11, 0.64, 0.8))
    for k, name in enumerate(dict.fromkeys(row["variant"] for row in rows)):
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
    # The names have a column of their own beside the points.
    axes.legend(fontsize=8.5, frameon=False, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    save_figure(made, save)
