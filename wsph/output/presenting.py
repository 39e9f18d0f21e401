"""Tables of a run as other packages have them: pandas, xarray, and HTML for notebooks. Units stand beside the columns."""

# pyright: strict

import html as escaping
import importlib
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Protocol

import numpy as np

from wsph.errors import OutputError

TIME = "time"


class DataFrame(Protocol):
    """A pandas DataFrame."""

    attrs: dict[str, object]

    def set_index(self, keys: str) -> "DataFrame": ...


class Dataset(Protocol):
    """An xarray Dataset."""

    attrs: dict[str, object]


def _package(name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise OutputError(f'{name} is not installed: pip install "wsph[notebook]", or pip install {name}') from None


def frame(columns: Mapping[str, np.ndarray], units: Mapping[str, str]) -> DataFrame:
    """A table as a DataFrame over the time, with `attrs["units"]`. Raises OutputError without pandas."""
    made: DataFrame = _package("pandas").DataFrame(dict(columns)).set_index(TIME)
    made.attrs["units"] = {name: units.get(name, "") for name in columns}
    return made


def dataset(tables: Mapping[str, tuple[Mapping[str, np.ndarray], Mapping[str, str]]], title: str) -> Dataset:
    """Tables by name as a Dataset: the history's columns by their names over `time`, those of others as TABLE.COLUMN over
    `time_TABLE`. Raises OutputError without xarray."""
    variables: dict[str, tuple[str, np.ndarray, dict[str, str]]] = {}
    coordinates: dict[str, tuple[str, np.ndarray, dict[str, str]]] = {}
    for table, (columns, units) in tables.items():
        along = TIME if table == "history" else f"{TIME}_{table}"
        for name, values in columns.items():
            entry = (along, values, {"units": units.get(name, "")})
            if name == TIME:
                coordinates[along] = entry
            else:
                variables[name if table == "history" else f"{table}.{name}"] = entry
    return _package("xarray").Dataset(variables, coords=coordinates, attrs={"title": title})


def html(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """A small table."""
    told = "".join(
        f"<tr><th style='text-align:left'>{_safe(key)}</th><td>{_safe(said)}</td></tr>" for key, said in rows
    )
    return f"<table><caption>{_safe(title)}</caption>{told}</table>"


def _safe(text: str) -> str:
    return escaping.escape(text)
