"""The output folder: frames, probes, history and summary, each written under a temporary name and renamed.

A kill at any instant leaves a readable folder: the index files name only frames that are complete, and what joins the parts
of a frame is written when all of them are whole. The traps of the file
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

from wsph.backend.domain import Domain
from wsph.errors import OutputError
from wsph.output.cells import Cells
from wsph.output.files import finite_or_none, own_frames, write_atomically, write_text
from wsph.output.formats import named, own_files, suffixes
from wsph.output.frames import Frame, Listed, part_stem, parts, stem
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
        self._former: dict[int, list[Path]] = {}
        """Files of frames that are to be written again, by their numbers: of an earlier run up to where this one goes on."""
        try:
            for path in own_files(folder) if times is None else ():
                path.unlink(missing_ok=True)
            for number, path in own_frames(folder, suffixes(self.formats)) if self.formats else ():
                if number >= len(self.times):
                    self._former.setdefault(number, []).append(path)
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
        self._write(frame)

    def _write(self, frame: Frame) -> None:
        """Write a frame, and list it."""
        files = [(each, self._frames / f"{stem(len(self.times))}.{each.suffix}") for each in self.formats]
        for each, path in files:
            write_atomically(path, lambda temporary, each=each: each.write(temporary, frame))
        self._list(frame.listed, [path for _, path in files])

    def _list(self, frame: Listed, files: Sequence[Path]) -> None:
        """List a frame, which those files are of: others that it had before go."""
        number = len(self.times)
        self.times.append(frame)
        for each in self.formats:
            each.index(self.folder, self.times)
        for path in set(self._former.pop(number, ())).difference(files):
            path.unlink(missing_ok=True)

    @property
    def _frames(self) -> Path:
        return self.folder / "frames"

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


class PartedFolder(OutputFolder):
    """A folder that processes which share a scene write together: of a frame each its part, which have different particles
    but for copies; all else, and the files that join the parts, the first."""

    def __init__(
        self,
        folder: Path,
        formats: Sequence[str],
        times: Sequence[Listed] | None,
        bodies: Sequence[str],
        domain: Domain,
    ):
        self._domain, first = domain, domain.rank == 0
        self._first = OutputFolder(folder, formats, times, bodies) if first else UnwrittenFolder(folder, formats)
        self.folder, self.formats, self.times = folder, self._first.formats, self._first.times
        self._bodies = tuple(bodies)

    def _write(self, frame: Frame) -> None:
        """Write this process's part of a frame; the first joins them, and lists the frame. All of them call it."""
        rank, size = self._domain.rank, self._domain.size
        number = self._domain.told(lambda: len(self.times))  # it has made the folder then
        for each in self.formats:
            path = self._frames / f"{part_stem(number, rank, size)}.{each.suffix}"
            write_atomically(path, lambda temporary, each=each: each.write(temporary, frame))
        # All of them are whole then.
        sizes = self._domain.joined(frame.sizes[None])
        if rank == 0:
            self._join(frame, frame.listed_with(sizes), number)

    def _join(self, frame: Frame, listed: Listed, number: int) -> None:
        files: list[Path] = []
        for each in self.formats:
            own = parts(listed, number, each.suffix)
            files += [self._frames / part.file for part in own]
            if each.joins:
                files.append(self._frames / f"{stem(number)}.{each.joins}")
                write_atomically(files[-1], lambda temporary, each=each, own=own: each.join(temporary, frame, own))
        self._first._list(listed, files)

    def table(self, name: str, columns: Mapping[str, ArrayLike]) -> None:
        """Write a table, in the first process."""
        self._first.table(name, columns)

    def summary(self, content: Mapping[str, object]) -> None:
        """Write summary.json, in the first process."""
        self._first.summary(content)


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
