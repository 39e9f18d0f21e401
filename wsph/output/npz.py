"""Frames as numpy archives."""

from pathlib import Path

import numpy as np


def write_npz(path: Path, points: np.ndarray, data: dict[str, np.ndarray]) -> None:
    with open(path, "wb") as file:
        np.savez(file, position=points, **data)
