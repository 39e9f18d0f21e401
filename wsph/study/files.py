"""The files of a study: study.csv, study.json and, where there are errors and pyvista, front.png.

study.json grows row by row, so that a study that was ended goes on where it was: a row is taken over where everything that
it follows from is the same.
"""

# pyright: strict

import importlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

from wsph.errors import OutputError
from wsph.output.files import write_text
from wsph.quantities import is_list, is_table
from wsph.study.runs import Row
from wsph.study.tables import Study

ROWS, TABLE, PICTURE = "study.json", "study.csv", "front.png"


def is_a_study(folder: Path) -> bool:
    """Whether a folder holds a study."""
    try:
        content: object = json.loads((folder / ROWS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return is_table(content) and is_list(content.get("rows")) and "title" in content


def known_rows(folder: Path, digests: Sequence[str]) -> list[Row | None]:
    """The rows that a folder's study has already, at the places of `digests`. Raises OutputError where it has none to go on
    from."""
    if not is_a_study(folder):
        raise OutputError(f"{folder}: holds no study to resume; run without --resume")
    content = json.loads((folder / ROWS).read_text(encoding="utf-8"))
    names: object = content.get("digests")
    pairs = zip(names if is_list(names) else (), content["rows"], strict=False)
    made = {str(name): cast(Row, row) for name, row in pairs if is_table(row)}
    return [made.get(digest) for digest in digests]


def clear(folder: Path) -> None:
    """Take away what an earlier study wrote. Raises OutputError."""
    try:
        for name in (ROWS, TABLE, PICTURE):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def keep_rows(rows: Sequence[Row | None], digests: Sequence[str], study: Study, folder: Path) -> None:
    """Write the rows so far."""
    made = [(row, digest) for row, digest in zip(rows, digests, strict=True) if row is not None]
    content = {"title": study.title, "rows": [row for row, _ in made], "digests": [digest for _, digest in made]}
    write_text(folder / ROWS, json.dumps(content, indent=2) + "\n")


def write_study(rows: Sequence[Row], study: Study, folder: Path) -> None:
    """Write the table and the picture of a study that is complete."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    cell: Callable[[object], str] = lambda v: '"' + str(v).replace('"', '""') + '"' if isinstance(v, str) else f"{v}"  # noqa: E731
    table = "\n".join([",".join(columns), *(",".join(cell(row.get(c, "")) for c in columns) for row in rows)]) + "\n"
    write_text(folder / TABLE, table)
    if any("error" in row for row in rows):
        try:
            importlib.import_module("matplotlib")
        except ImportError:
            return
        from wsph.output.view.front import front

        front(rows, study.title, folder / PICTURE)
