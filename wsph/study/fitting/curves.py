"""Curves that a fit compares: measured ones from a file, and those of a run at the same times."""

# pyright: strict

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsph.accuracy.running.wanted import run_for_whom_waits
from wsph.errors import Fault, Refused, SceneError
from wsph.scene.scene import Scene


@dataclass(frozen=True)
class Curves:
    """Measured columns, each of `names` a PROBE.COLUMN: `times` (n,) [s] and `values` (columns, n) in the units of probes;
    not a number where a column has none."""

    names: tuple[str, ...]
    times: np.ndarray
    values: np.ndarray

    @property
    def sizes(self) -> np.ndarray:
        """Root mean square of each column (columns,): what its residuals are relative to."""
        return np.sqrt(np.nanmean(self.values**2, axis=1))


def read_curves(path: Path) -> Curves:
    """Read a file whose first line is time, PROBE.COLUMN, ... and whose cells are numbers or empty. Raises SceneError."""

    def fault(line: int, words: str) -> SceneError:
        return SceneError(str(path), [Fault(line, "", words)])

    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            head, *rows = [[cell.strip() for cell in row] for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError) as error:
        raise fault(0, f"cannot be read: {error}") from None
    except ValueError:
        raise fault(0, "is empty") from None
    if head[0] != "time" or len(head) < 2:
        raise fault(
            1, f"begins with {', '.join(head)}: its columns are time [s], then PROBE.COLUMN in the units of probes"
        )
    table = np.full((len(rows), len(head)), np.nan)
    for k, row in enumerate(rows):
        if len(row) != len(head):
            raise fault(k + 2, f"has {len(row)} cells, the first line {len(head)}")
        try:
            table[k] = [float(cell) if cell else np.nan for cell in row]
        except ValueError as error:
            raise fault(k + 2, str(error)) from None
    times, values = table[:, 0], table[:, 1:].T
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise fault(0, "its times do not rise from row to row")
    if empty := [name for name, column in zip(head[1:], values, strict=True) if not np.nansum(np.abs(column)) > 0.0]:
        raise fault(1, f"column {empty[0]} has no number other than zero")
    return Curves(tuple(head[1:]), times, values)


def check_curves(curves: Curves, scene: Scene, source: Path) -> None:
    """Raise SceneError where the run has nothing at some of the times, or no such probe."""
    first, last = curves.times[[0, -1]].tolist()
    if first < 0.0 or last > scene.end:
        words = f"is of {first:g} to {last:g} s, the run of 0 to {scene.end:g} s: lengthen run.end, or cut the data"
        raise SceneError(str(source), [Fault(0, "", words)])
    probes = [probe.name for probe in scene.probes]
    for name in curves.names:
        if not any(name.startswith(f"{probe}.") for probe in probes):
            there = ", ".join(probes) or "none"
            raise SceneError(str(source), [Fault(1, "", f"column {name} is of no probe; there is {there}")])


@dataclass(frozen=True)
class Sample:
    """Columns of a run at the times of measured ones, `values` (columns, n), and their `units`."""

    values: np.ndarray
    units: tuple[str, ...]


def computed(names: Sequence[str], times: np.ndarray, scene: Scene) -> Sample:
    """The columns of a run at some times [s], linear between its records. Raises Refused where it does not come to its end,
    SceneError for a column that it does not have, KeyboardInterrupt, and Lost on a worker that nobody waits for."""
    result = run_for_whom_waits(scene)
    if result.failure is not None:
        raise Refused(f"a run of the fit did not come to its end: {result.reason}: narrow the bounds")
    recorded = result.recorded()
    clocks = {f"{probe}.time": (columns["time"], columns["time"]) for probe, columns in result.probes.items()}
    there = recorded | clocks
    if missing := [name for name in names if name not in there]:
        words = f"no column {missing[0]} is recorded; there is {', '.join(recorded)}"
        raise SceneError("data", [Fault(1, "", words)])
    said = result.summary.get("units", {"probes": {}})["probes"]
    units = {f"{probe}.{key}": unit for probe, columns in said.items() for key, unit in columns.items()}
    values = np.array([np.interp(times, *there[name]) for name in names])
    return Sample(values, tuple(units.get(name, "") for name in names))


Evaluate = Callable[[Sequence[Scene]], list[Sample]]
"""Makes the columns of several scenes, side by side where it can."""
