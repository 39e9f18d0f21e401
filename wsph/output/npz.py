"""Frames as numpy archives."""

# pyright: strict

from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.frames import Frame, Listed


class Npz:
    """Archives of arrays: `position` and one a field. They have no list."""

    name, needs, suffix, listing = "npz", "", "npz", ""

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        fields: dict[str, Any] = {**frame.data}
        with open(path, "wb") as file:
            np.savez(file, position=frame.points, **fields)

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Nothing: each file stands by itself."""
