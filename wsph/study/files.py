"""The files of a study: study.json and study.csv, the judged columns of every row, and front.png where there are errors.

study.json grows row by row, so that a study that was ended goes on where it was: a row is taken over where everything that
it follows from is the same, and refused where that has changed.
"""

# pyright: strict

import csv
import importlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import cast

import numpy as np

from wsph.errors import OutputError
from wsph.output.files import Kind, write_atomically, write_text
from wsph.quantities import is_list, is_table
from wsph.study.plan import Facts
from wsph.study.rows import Made, Row

ROWS, TABLE, PICTURE, SERIES = "study.json", "study.csv", "front.png", "series"


def is_a_study(folder: Path) -> bool:
    """Whether a folder holds a study."""
    try:
        content: object = json.loads((folder / ROWS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return is_table(content) and is_list(content.get("rows")) and "title" in content


class OtherRow(OutputError):
    """A row of a folder that was made of something else, as `why` says."""

    def __init__(self, folder: Path, why: str):
        super().__init__(f"{folder}: {why}: give --overwrite to make all rows anew, or choose another folder with -o")
        self.why = why


STUDY = Kind("study", is_a_study, is_a_study)


def known_rows(folder: Path, facts: Sequence[Facts], names: Sequence[str]) -> dict[int, Made]:
    """The rows that a folder's study has already, by their number. Raises OutputError where it has no study to go on from,
    and OtherRow where a row of that name was made of another scene, answer or version."""
    if not is_a_study(folder):
        raise OutputError(f"{folder}: holds no study to resume; run without --resume")
    content = json.loads((folder / ROWS).read_text(encoding="utf-8"))
    kept = [content.get(key, ()) for key in ("names", "rows", "facts", "series")]
    there = {
        str(name): (cast(Row, row), Facts(**of), cast(list[str], own))
        for name, row, of, own in zip(*kept, strict=False)
    }
    found: dict[int, Made] = {}
    for number, (name, now) in enumerate(zip(names, facts, strict=True)):
        if name not in there:
            continue
        row, before, columns = there[name]
        if before != now:
            raise OtherRow(folder, f"row {name!r} was made with another {before.changed(now)}")
        if (made := _with_series(folder, now, row, columns)) is not None:
            found[number] = made
    return found


def clear(folder: Path) -> None:
    """Take away what an earlier study wrote. Raises OutputError."""
    try:
        for path in (folder / ROWS, folder / TABLE, folder / PICTURE, *(folder / SERIES).glob("*.npz")):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def keep_row(folder: Path, made: Made, facts: Facts) -> None:
    """Write what is beside the table of a row that has ended. Raises OutputError."""
    if not made.series:
        return
    try:
        (folder / SERIES).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error

    def put(path: Path) -> None:
        with path.open("wb") as file:
            np.savez(file, allow_pickle=False, **made.series)

    write_atomically(_series(folder, facts), put)


def keep_rows(folder: Path, made: Mapping[int, Made], facts: Sequence[Facts], names: Sequence[str], title: str) -> None:
    """Write the rows so far, by their number. Raises OutputError."""
    order = sorted(made)
    content = {
        "title": title,
        "rows": [made[k].row for k in order],
        "names": [names[k] for k in order],
        "facts": [asdict(facts[k]) for k in order],
        "series": [list(made[k].series) for k in order],
    }
    write_text(folder / ROWS, json.dumps(content, indent=2) + "\n")


def write_table(rows: Sequence[Row], folder: Path) -> None:
    """Write the rows as a table, a cell that is not known empty. Raises OutputError."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    content = io.StringIO(newline="")
    table = csv.DictWriter(content, columns, restval="", lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    write_text(folder / TABLE, content.getvalue())


def draw(rows: Sequence[Row], title: str, folder: Path) -> None:
    """The picture of rows that have errors or estimates of them; none where matplotlib is not installed."""
    if not any(row.get("error") or row.get("estimate") for row in rows):
        return
    try:
        importlib.import_module("matplotlib")
    except ImportError:
        return
    from wsph.output.view.front import front

    front(rows, title, folder / PICTURE)


def _series(folder: Path, facts: Facts) -> Path:
    return folder / SERIES / f"{facts.key}.npz"


def _with_series(folder: Path, facts: Facts, row: Row, columns: Sequence[str]) -> Made | None:
    """A row with its judged columns; None where they are gone, so that it has to be made again."""
    if not columns:
        return Made(row)
    try:
        with np.load(_series(folder, facts), allow_pickle=False) as file:
            return Made(row, {name: np.asarray(file[name]) for name in columns})
    except (OSError, ValueError, KeyError):
        return None
