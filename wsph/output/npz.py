"""Frames as numpy archives."""

# pyright: strict

from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.frames import Frame, Listed


class Npz:
    """Archives of arrays: `position` and one a field, and of the frame as a whole `TimeValue` [s], names of the `bodies` in
    the order of the numbers in "body", and `units`, a row of name and unit for each array. They have no list."""

    name, needs, suffix, listing = "npz", "", "npz", ""

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        units = {"position": "m", **{name: unit for name, unit in frame.units.items() if name in frame.data}}
        arrays: dict[str, Any] = {
            "TimeValue": np.array(frame.time),
            "bodies": np.array(frame.bodies, dtype=str),
            "units": np.array(list(units.items()), dtype=str),
            **frame.data,
            "position": frame.points,
        }
        with open(path, "wb") as file:
            np.savez(file, **arrays)

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Nothing: each file stands by itself."""
