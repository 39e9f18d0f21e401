"""The output folder: frames, probes, history and summary, each written under a temporary name and renamed.

A kill at any instant leaves a readable folder: the index files name only frames that are complete. The traps of the file
formats stay behind this module: 1D and 2D points are padded to 3D, symmetric tensors are six columns in VTK's order (XDMF
reads another order and gets nine), nothing is boolean or half precision.
"""

# pyright: strict

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from wsph.errors import OutputError
from wsph.output.cells import Cells
from wsph.output.files import finite_or_none, own_files, write_atomically, write_text
from wsph.output.formats import FORMATS, named
from wsph.output.frames import Frame, Listed, stem
from wsph.quantities import is_sequence, is_table


class OutputFolder:
    """Writes one run. Creates the folder; an earlier run in it is removed first (`check_writable` has allowed it)."""

    def __init__(
        self, folder: Path, formats: Sequence[str], times: Sequence[Listed] | None = None, bodies: Sequence[str] = ()
    ):
        """`formats` by their names; `times`: the frames up to the checkpoint that the run in the folder goes on from; names
        of the `bodies`."""
        self.folder, self.formats, self._bodies = folder, named(formats), tuple(bodies)
        self.times: list[Listed] = [(t, n, list(names)) for t, n, names in times or []]
        listings, suffixes = [each.listing for each in FORMATS], [each.suffix for each in FORMATS]
        try:
            for path in own_files(folder, listings, suffixes) if times is None else ():
                path.unlink(missing_ok=True)
            (folder / "frames").mkdir(parents=True, exist_ok=True)
            (folder / "probes").mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error

    def frame(
        self,
        time: float,
        points: np.ndarray,
        data: dict[str, np.ndarray],
        units: Mapping[str, str] | None = None,
        cells: Cells | None = None,
        positions: str = "current",
    ) -> None:
        """Write one frame: `points` (n, dim) [m], `data` name -> (n,) or (n, width); tensors are (n, 6). Types stay. `units`
        of the fields by name; `cells` with data of the same shapes; `positions` as a `Frame` has them."""
        values = {name: _padded(values) for name, values in data.items()}
        if cells is not None:
            cells = replace(cells, data={name: _padded(values) for name, values in cells.data.items()})
        frame = Frame(_padded(points), values, float(time), dict(units or {}), self._bodies, cells, positions)
        for each in self.formats:
            path = self.folder / "frames" / f"{stem(len(self.times))}.{each.suffix}"
            write_atomically(path, lambda temporary, each=each: each.write(temporary, frame))
        self.times.append(frame.listed)
        for each in self.formats:
            each.index(self.folder, self.times)

    def table(self, name: str, columns: Mapping[str, ArrayLike]) -> None:
        """Write `name` (a path in the folder) as CSV, a column an entry, in the shortest digits that read back the same."""
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*[np.asarray(v).tolist() for v in columns.values()], strict=True))
        write_text(self.folder / name, buffer.getvalue())

    def summary(self, content: Mapping[str, object]) -> None:
        """Write summary.json."""
        write_text(
            self.folder / "summary.json",
            json.dumps(_json(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n",
        )


class UnwrittenFolder(OutputFolder):
    """A folder that another process writes."""

    def __init__(self, folder: Path, formats: Sequence[str], *_: object):
        self.folder, self.formats, self.times = folder, named(formats), []

    def frame(self, *_: object, **__: object) -> None:
        """Write nothing."""

    def table(self, name: str, columns: Mapping[str, ArrayLike]) -> None:
        """Write nothing."""

    def summary(self, content: Mapping[str, object]) -> None:
        """Write nothing."""


def _json(value: object) -> object:
    """The same with numbers as `finite_or_none` has them."""
    if is_table(value):
        return {key: _json(v) for key, v in value.items()}
    if is_sequence(value):
        return [_json(v) for v in value]
    return finite_or_none(value) if isinstance(value, float) else value


def _padded(values: np.ndarray) -> np.ndarray:
    """Vectors of one and two dimensions with the zeros that make them three."""
    if values.ndim == 1 or values.shape[1] > 2:
        return values
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))
