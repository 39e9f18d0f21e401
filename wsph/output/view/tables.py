"""Curves of what a run recorded over time, from the files of its folder: history and probes, with their units."""

# pyright: strict

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wsph.errors import OutputError
from wsph.output.files import ACCURACY
from wsph.output.view.curves import Mark, over_time
from wsph.output.view.pictures import save_figure

HISTORY = "history"


@dataclass(frozen=True)
class Series:
    """A column over time: its `name` on a picture, `times` [s], `values` and their SI unit; of what a search judged `bar`,
    half the width of its error bar, or `mark`, of one number; and that, or that there is no bar, in `words`."""

    name: str
    times: np.ndarray
    values: np.ndarray
    unit: str
    bar: float = 0.0
    mark: Mark | None = None
    words: str = ""

    def at(self, times: np.ndarray) -> np.ndarray:
        """Its values at other times, linear between its own. Raises OutputError beyond them."""
        if not len(self.times):
            raise OutputError(f"{self.name} has no record")
        return np.interp(times, self.times, self.values)


class Tables:
    """The tables of a run's folder."""

    def __init__(self, folder: Path):
        self._folder = folder
        try:
            said: Any = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
            self._units: dict[str, Any] = said.get("units", {})
        except (OSError, ValueError):
            self._units = {}  # a run that was cut off has its numbers without units
        self._judged = _judged(folder)

    def series(self, asked: str) -> list[Series]:
        """The columns that a name stands for: one of history.csv, PROBE.COLUMN, or all of a PROBE. With a minus sign in
        front they are turned round. Raises OutputError for a name that there is not."""
        sign, name = (-1.0, asked[1:]) if asked.startswith("-") else (1.0, asked)
        said = self._units.get(HISTORY, {})
        columns = self._read(self._folder / "history.csv")
        if name in columns:
            return [_series(name, columns, name, sign, said)]
        probes = sorted(path.stem for path in (self._folder / "probes").glob("*.csv"))
        for probe in sorted((each for each in probes if name == each or name.startswith(f"{each}.")), key=len):
            found = self._read(self._folder / "probes" / f"{probe}.csv")
            said = self._units.get("probes", {}).get(probe, {})
            column = name[len(probe) + 1 :]
            if column in found:
                return [self._with_bar(_series(name, found, column, sign, said), f"{probe}.{column}")]
            if name == probe:
                columns = [each for each in found if each != "time"]
                return [self._with_bar(_series(each, found, each, sign, said), f"{probe}.{each}") for each in columns]
        there = [*columns, *(f"{probe}.{key}" for probe in probes for key in self._keys(probe))]
        raise OutputError(f"{self._folder}: no column {name!r}; there is {', '.join(there)}")

    def _with_bar(self, series: Series, column: str) -> Series:
        if self._judged is None:
            return series
        said = self._judged.get(column)
        if said is None:
            return replace(series, words="not judged: no error bar")
        width, value = said.get("half_width"), said.get("value")
        if not isinstance(value, (int, float)):
            return replace(series, bar=float(width or 0.0), words="" if width is not None else "no error bar")
        turned, words = series.name.startswith("−"), str(said.get("words", ""))
        sign = -1.0 if turned and said["quantity"] in ("mean", "final", "peak") else 1.0
        mark = Mark(said["quantity"], sign * float(value), width)
        # The number in words is the column's own.
        return replace(series, mark=mark, words=f"{column} {words}" if turned else words)

    def _keys(self, probe: str) -> list[str]:
        return [key for key in self._read(self._folder / "probes" / f"{probe}.csv") if key != "time"]

    def _read(self, path: Path) -> dict[str, np.ndarray]:
        try:
            with path.open(encoding="utf-8", newline="") as file:
                head, *rows = csv.reader(file)
            table = np.array(rows, float).reshape(len(rows), len(head))
        except (OSError, ValueError) as error:
            raise OutputError(f"{path}: cannot be read: {error}") from None
        return {name: table[:, k] for k, name in enumerate(head)}


def _series(name: str, columns: Mapping[str, np.ndarray], key: str, sign: float, units: Mapping[str, str]) -> Series:
    return Series("−" * (sign < 0.0) + name, columns["time"], sign * columns[key], units.get(key, ""))


def _judged(folder: Path) -> dict[str, dict[str, Any]] | None:
    """What a search says of the columns "PROBE.COLUMN" that it judged; None where the run is no answer of one."""
    try:
        said: Any = json.loads((folder / ACCURACY).read_text(encoding="utf-8"))
        return {name: dict(each) for name, each in said["columns"].items()}
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return None


def view_curves(folder: Path, columns: str, against: str | None, save: Path | None) -> None:
    """Save columns of a run's history and probes, "NAME,NAME,...", over time or `against` another. Raises OutputError."""
    if save is None:
        raise OutputError("a curve is no body to turn: save it with --save FILE.png")
    tables = Tables(folder)
    series = [each for name in columns.split(",") for each in tables.series(name.strip())]
    times = series[0].times
    values, across, along = {each.name: each.at(times) for each in series}, ("time", "s"), times
    if against is not None:
        other = tables.series(against)
        if len(other) != 1:
            raise OutputError(f"--against names one column: {against} has {', '.join(each.name for each in other)}")
        across, along = (other[0].name, other[0].unit), other[0].at(times)
    units = {each.name: each.unit for each in series}
    title = ", ".join(values) if len(values) < 4 else "columns"
    title += f" against {across[0]}" if against is not None else ""
    bars = {each.name: each.bar for each in series} if against is None else {}
    title += ", with error bars" if any(bars.values()) else ""
    # One line of what is known of each, as far as there is room.
    words = [f"{each.name}: {each.words}" if len(series) > 1 else each.words for each in series if each.words][:3]
    title = "\n".join([title, *words]) if against is None else title
    marks = {each.name: each.mark for each in series if each.mark is not None} if against is None else {}
    save_figure(over_time(along, values, units, title, across, bars, marks), save)
