"""Frames as CSV: a line a particle, for a spreadsheet or a reader of one's own. What stands in cells is left out."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wsph.output.fields import AXES, TENSOR
from wsph.output.files import write_text
from wsph.output.frames import Frame, Listed, Part, stem


class Csv:
    """Comma-separated values in SI, in the shortest digits that read back the same. The first line names the columns:
    x, y, z, fields, and of vectors and tensors components such as `velocity_x` and `stress_xy`. `frames.csv` lists the
    frames: time [s] and file."""

    name, needs, suffix, listing, joins = "csv", "", "csv", "frames.csv", None

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file. The folder gives it its name when it is whole."""
        columns = dict(zip(AXES, frame.points.T, strict=True))
        for name, values in frame.data.items():
            columns |= {name: values} if values.ndim == 1 else _components(name, values)
        with open(path, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*[column.tolist() for column in columns.values()], strict=True))

    def join(self, path: Path, frame: Frame, parts: Sequence[Part]) -> None:
        """A frame is one file."""

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write frames.csv, whole or not at all."""
        rows = (f"{time!r},frames/{stem(number)}.{self.suffix}\n" for number, (time, _, _) in enumerate(frames))
        write_text(folder / self.listing, "time,file\n" + "".join(rows))


def _components(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """The columns of a vector (n, 3), or of a tensor (n, 6) in VTK's order."""
    labels = TENSOR if values.shape[1] == len(TENSOR) else AXES
    return {f"{name}_{label}": column for label, column in zip(labels, values.T, strict=True)}
