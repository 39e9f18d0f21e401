"""The picture of a fit: data, fit, and what is between them."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.view.curves import LARGE, SMALL, USUAL
from wsph.output.view.labels import COLOURS, scaled, shown_in, titled, written
from wsph.output.view.packages import figure
from wsph.output.view.pictures import save_figure
from wsph.study.fitting.curves import Curves
from wsph.study.fitting.fit import Fit


def draw(save: Path, fit: Fit, curves: Curves) -> None:
    """A panel of data and fit for each column, and under it one of what is between them."""
    many = len(curves.names)
    page = 0.55 + many * 3.35
    made = figure(8.0, page)
    across, of_time = scaled("s", float(curves.times[-1]))
    for k, name in enumerate(curves.names):
        low = page - 0.35 - (k + 1) * 3.35 + 0.75
        upper = made.add_axes((0.12, (low + 0.85) / page, 0.85, 1.7 / page))
        lower = made.add_axes((0.12, low / page, 0.85, 0.75 / page), sharex=upper)
        times, values, there = curves.times * across, curves.values[k], np.isfinite(curves.values[k])
        factor, unit = shown_in(fit.model.units[k], float(np.nanmax(np.abs(values))))
        upper.plot(times[there], values[there] * factor, ".", color=COLOURS[0], markersize=3.5, label="data")
        upper.plot(times, fit.model.values[k] * factor, color=COLOURS[2], linewidth=1.4, label="fit")
        lower.axhline(0.0, color="#888888", linewidth=0.8)
        lower.plot(times[there], 100.0 * fit.residuals[k][there], ".", color=COLOURS[2], markersize=3.5)
        upper.set_title(name, loc="left", fontsize=LARGE)
        upper.set_ylabel(f"[{written(unit)}]" if unit else "", fontsize=USUAL)
        lower.set_ylabel("fit − data [%]", fontsize=USUAL)
        upper.tick_params(labelbottom=False, labelsize=SMALL)
        lower.tick_params(labelsize=SMALL)
        where: dict[str, Any] = {"loc": "best"}
        upper.legend(fontsize=SMALL, frameon=False, **where)
        for axes in (upper, lower):
            axes.grid(color="#dddddd", linewidth=0.6)
            for side in ("top", "right"):
                axes.spines[side].set_visible(False)
        if k == many - 1:
            lower.set_xlabel(titled("time", of_time), fontsize=USUAL)
    save_figure(made, save)
