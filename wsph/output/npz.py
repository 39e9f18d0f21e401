"""Frames as numpy archives."""

# pyright: strict

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.frames import Frame, Listed, Part


class Npz:
    """Archives of arrays: `position` and one a field, `corners/KIND` of the cells of every kind and `cells/NAME` of every
    field of theirs, and of the frame as a whole `TimeValue` [s], names of the `bodies` in the order of the numbers in
    "body", `positions`, and `units`, a row of name and unit for each array. They have no list."""

    name, needs, suffix, listing, joins = "npz", "", "npz", "", None

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        arrays: dict[str, Any] = {
            "TimeValue": np.array(frame.time),
            "bodies": np.array(frame.bodies, dtype=str),
            "positions": np.array(frame.positions),
            "units": np.array(list(frame.named_units.items()), dtype=str),
            **frame.data,
            "position": frame.points,
        }
        if frame.cells is not None:
            arrays |= {f"corners/{kind}": corners for kind, corners in frame.cells.blocks.items()}
            arrays |= {f"cells/{name}": values for name, values in frame.cells.data.items()}
        with open(path, "wb") as file:
            np.savez(file, **arrays)

    def join(self, path: Path, frame: Frame, parts: Sequence[Part]) -> None:
        """A frame is one archive."""

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Nothing: each file stands by itself."""
