"""What a calibration leaves: calibration.json, fit.csv with data and fit, and a picture of both; and what it says."""

# pyright: strict

import csv
import importlib
import io
import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from wsph.output.files import Kind, finite_or_none, write_text
from wsph.quantities import Table
from wsph.study.fitting.curves import Curves
from wsph.study.fitting.fit import Fit
from wsph.study.fitting.mesh import MeshBar

REPORT, TABLE, PICTURE = "calibration.json", "fit.csv", "fit.png"

FOLLOWING = 0.5
"""First autocorrelation of residuals from which they are no noise."""


def is_a_calibration(folder: Path) -> bool:
    """Whether a folder holds one."""
    try:
        return "correlation" in json.loads((folder / REPORT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False


CALIBRATION = Kind("calibration", is_a_calibration, lambda folder: False)
"""Nobody goes on with one."""


def in_words(fit: Fit, mesh: MeshBar) -> Iterator[str]:
    """What a fit says, line by line."""
    for each, value, own, wide in zip(fit.parameters, fit.values, fit.deviations, mesh.bars, strict=True):
        unit = f" {each.unit}" if each.unit else ""
        bar = f"mesh {wide:.2g}{unit}" if math.isfinite(wide) else "mesh: no bar"
        yield f"{each.key} = {value:.6g}{unit}, data {own:.2g}{unit} (one standard deviation), {bar}"
    for k, one in enumerate(fit.parameters):
        for j in range(k):
            if abs(fit.correlation[k, j]) > 0.95:
                yield f"finding: {fit.parameters[j].name} and {one.name} are told apart badly: correlation {fit.correlation[k, j]:.3f}"
    for key in fit.at_bounds:
        yield f"finding: {key} ended at a bound: what is said of its scatter does not hold"
    if not fit.converged:
        yield f"finding: the fit did not come to its end: {fit.reason}"
    yield from _of_mesh(fit, mesh)


def _of_mesh(fit: Fit, mesh: MeshBar) -> Iterator[str]:
    if mesh.reason:
        yield f"finding: nothing is known of the mesh: {mesh.reason}"
    for name, each in mesh.estimates.items():
        if not each.converges:
            yield f"finding: no convergence of {name} with the spacing: the fit is of this mesh"
    moved = [each.name for each, own, wide in zip(fit.parameters, fit.deviations, mesh.bars, strict=True) if wide > own]
    if moved and all(each.converges for each in mesh.estimates.values()):
        yield f"finding: the mesh can move {', '.join(moved)} further than the scatter of the data: refine it before reading more digits"


def following_in_words(fit: Fit, curves: Curves) -> Iterator[str]:
    """Columns whose residuals are no noise, line by line."""
    for name, each in zip(curves.names, fit.following, strict=True):
        if each > FOLLOWING:
            yield f"finding: residuals of {name} follow each other (autocorrelation {each:.2f}): they are no noise, and the scatter of the parameters is larger than said"


def write(folder: Path, fit: Fit, mesh: MeshBar, curves: Curves, words: list[str]) -> None:
    """Write all of a calibration. Raises OutputError."""
    parameters: list[Table] = [
        {
            "key": each.key,
            "unit": each.unit,
            "value": float(fit.values[k]),
            "standard_deviation": float(fit.deviations[k]),
            "mesh_bar": finite_or_none(mesh.bars[k]),
            "bounds": [each.low, each.high],
            "start": each.start,
        }
        for k, each in enumerate(fit.parameters)
    ]
    scales = np.outer(fit.ranges, fit.ranges)
    content = {
        "parameters": parameters,
        "covariance": (fit.covariance * scales).tolist(),
        "correlation": fit.correlation.tolist(),
        "columns": {
            name: {
                "relative_scatter": float(fit.scatter[k]),
                "autocorrelation": float(fit.following[k]),
                "mesh_error": finite_or_none(mesh.estimates[name].error) if name in mesh.estimates else None,
                "mesh_bar": finite_or_none(mesh.estimates[name].bar) if name in mesh.estimates else None,
            }
            for k, name in enumerate(curves.names)
        },
        "cells": list(mesh.cells),
        "runs": fit.runs,
        "converged": fit.converged,
        "reason": fit.reason,
        "words": words,
    }
    write_text(folder / REPORT, json.dumps(content, indent=2) + "\n")
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["time", *(f"{name}{end}" for name in curves.names for end in ("", " (fit)"))])
    for k, time in enumerate(curves.times):
        pairs = zip(curves.values[:, k], fit.model.values[:, k], strict=True)
        table.writerow([time, *("" if math.isnan(each) else each for pair in pairs for each in pair)])
    write_text(folder / TABLE, text.getvalue())
    try:
        importlib.import_module("matplotlib")
    except ImportError:
        return
    from wsph.study.fitting.picture import draw

    draw(folder / PICTURE, fit, curves)
