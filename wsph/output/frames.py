"""A frame, and what a format does with it."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Frame:
    """The particles at one `time` [s]: `points` (n, 3) [m], and fields by name, (n,), (n, 3) or, of a tensor, (n, 6) in
    VTK's order, SI. What is not of three dimensions is padded with zeros. Types are those to be written: single precision
    where the run has it. `units` of the fields by name, "1" of plain numbers; names of the `bodies`, in the order of the
    numbers that the field "body" has."""

    points: np.ndarray
    data: dict[str, np.ndarray]
    time: float = 0.0
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    bodies: tuple[str, ...] = ()


Listed = tuple[float, int, list[str]]
"""A frame that has been written: its time [s], its particles, and its points and fields, each "NAME:WIDTH:TYPE:UNIT" with
numpy's name of the type."""


def stem(number: int) -> str:
    """The name of a frame's file, without its suffix."""
    return f"frame_{number:06d}"


class Format(Protocol):
    """A format of frames. A frame is a file `frames/frame_000000.SUFFIX` of the output folder."""

    @property
    def name(self) -> str:
        """As scenes write it; of the extra too that installs what it needs."""
        ...

    @property
    def needs(self) -> str:
        """A module that it needs beyond what wsph has installed, or ""."""
        ...

    @property
    def suffix(self) -> str:
        """Suffix of its files, without the dot."""
        ...

    @property
    def listing(self) -> str:
        """The file of the output folder that lists the frames, or "" where there is none."""
        ...

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file. Raises OSError."""
        ...

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write the list of the frames so far into the output folder, whole or not at all."""
        ...
