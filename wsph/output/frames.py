"""A frame, and what a format does with it."""

# pyright: strict

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from wsph.output.cells import KINDS, Cells, counted

COPIES = "vtkGhostType"
"""A field of points of frames in parts that have cells, uint8, by VTK's name: 1 of corners of a part's cells that are in
another part too, as the particle that they are there."""


@dataclass(frozen=True)
class Frame:
    """The particles at one `time` [s]: `points` (n, 3) [m], and fields by name, (n,), (n, 3) or, of a tensor, (n, 6) in
    VTK's order, SI. What is not of three dimensions is padded with zeros. Types are those to be written: single precision
    where the run has it. `units` of the fields by name, "1" of plain numbers; names of the `bodies`, in the order of the
    numbers that the field "body" has. `cells` where the particles are corners of cells, with fields of their own, which have
    names and units as those of points do; otherwise None. `positions`: whether points are where particles are, "current", or
    where they were, "reference"."""

    points: np.ndarray
    data: dict[str, np.ndarray]
    time: float = 0.0
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    bodies: tuple[str, ...] = ()
    cells: Cells | None = None
    positions: str = "current"

    @property
    def named_units(self) -> dict[str, str]:
        """Units by the names of the arrays that have one, points and fields."""
        return {"position": "m", **{name: unit for name, unit in self.units.items() if name in self.data}}

    @property
    def listed(self) -> "Listed":
        """How it is listed once it has been written."""
        words = [_word(name, v, unit) for name, v, unit in (("position", self.points, "m"), *self._united(self.data))]
        if self.cells is not None:
            for kind, corners in self.cells.blocks.items():
                words.append(_word(f"corners/{kind}", corners, str(len(corners))))
            words += [_word(f"cells/{name}", v, unit) for name, v, unit in self._united(self.cells.data)]
        return self.time, len(self.points), words

    @property
    def sizes(self) -> np.ndarray:
        """Its points, and its cells of every kind, in their order in `KINDS`."""
        blocks = self.cells.blocks if self.cells is not None else {}
        return np.array([len(self.points), *(len(blocks.get(kind, ())) for kind in KINDS)])

    def listed_with(self, sizes: np.ndarray) -> "Listed":
        """How it is listed as one of the parts of a frame, of which `sizes` (p, 1 + kinds) are those of every one."""
        time, _, words = self.listed
        words = [word for word in words if not word.startswith("corners/")]
        words.append(f"{PARTS}:1:int64:{_counts(sizes[:, 0])}")
        if self.cells is not None:
            of = next(iter(self.cells.blocks.values())).dtype.name
            for kind, counts in zip(KINDS, sizes.T[1:], strict=True):
                if counts.any():
                    words.append(f"corners/{kind}:{len(KINDS[kind].order)}:{of}:{_counts(counts)}")
        return time, int(sizes[:, 0].sum()), words

    def _united(self, data: Mapping[str, np.ndarray]) -> list[tuple[str, np.ndarray, str]]:
        return [(name, values, self.units.get(name, "")) for name, values in data.items()]


PARTS = "parts/points"


def _counts(numbers: np.ndarray) -> str:
    return " ".join(map(str, numbers.tolist()))


def _word(name: str, values: np.ndarray, unit: str) -> str:
    return f"{name}:{1 if values.ndim == 1 else values.shape[1]}:{values.dtype.name}:{unit}"


Listed = tuple[float, int, list[str]]
"""A frame that has been written: its time [s], its particles, and its points and fields, each "NAME:WIDTH:TYPE:UNIT" with
numpy's name of the type; then where it has cells "corners/KIND:WIDTH:TYPE:COUNT" of every kind, and of every field of the
cells "cells/NAME:WIDTH:TYPE:UNIT". A frame in parts has "parts/points:1:int64:COUNTS" too, and there and of corners the
counts of all parts, with spaces between."""


class Part(NamedTuple):
    """A part of a frame: its `file`, in the folder of frames, its points, its cells, and the corners of all of these."""

    file: str
    points: int
    cells: int
    corners: int


def parts(frame: Listed, number: int, suffix: str) -> list[Part]:
    """The parts of a frame of that number; none where it is in one file."""
    _, _, words = frame
    points = [count for word in words if word.startswith(PARTS) for count in word.rsplit(":", 1)[1].split()]
    return [
        _sized(f"{part_stem(number, k, len(points))}.{suffix}", int(count), words, k) for k, count in enumerate(points)
    ]


def of_files(frame: Listed, number: int, suffix: str) -> list[Part]:
    """Its parts, or the frame as its only one."""
    whole = _sized(f"{stem(number)}.{suffix}", frame[1], frame[2], None)
    return parts(frame, number, suffix) or [whole]


def _sized(file: str, points: int, words: list[str], part: int | None) -> Part:
    # A part of a body that has cells may have none of them.
    drawn = any(word.startswith("corners/") for word in words)
    kinds = counted(words, part) if drawn else {"vertex": points}
    corners = sum(count * len(KINDS[kind].order) for kind, count in kinds.items())
    return Part(file, points, sum(kinds.values()), corners)


class Entry(NamedTuple):
    """An array as a list of frames has it."""

    name: str
    width: int
    type: str
    unit: str


def arrays(words: list[str], cells: bool = False) -> list[Entry]:
    """The arrays of a listed frame's points, or of its `cells`."""
    found: list[Entry] = []
    for word in words:
        name, width, of, unit = word.split(":", 3)
        room, _, own = name.rpartition("/")
        if room == ("cells" if cells else ""):
            found.append(Entry(own, int(width), of, unit))
    return found


def stem(number: int) -> str:
    """The name of a frame's file, without its suffix."""
    return f"frame_{number:06d}"


def part_stem(number: int, part: int, count: int) -> str:
    """The name of the file of one of so many parts of a frame, without its suffix."""
    return f"{stem(number)}_{part:05d}-of-{count:05d}"


class Format(Protocol):
    """A format of frames. A frame is a file `frames/frame_000000.SUFFIX` of the output folder; in parts each of them is
    such a file, and one more joins them (`joins`)."""

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

    @property
    def joins(self) -> str | None:
        """Suffix of the file `frames/frame_000000.SUFFIX` that joins the parts of a frame; "" where the list of frames does,
        None of a format whose frames have no parts."""
        ...

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file. Raises OSError."""
        ...

    def join(self, path: Path, frame: Frame, parts: Sequence[Part]) -> None:
        """Write the file that joins the parts of a frame, which lie beside it, the first of them `frame`. Raises OSError."""
        ...

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write the list of the frames so far into the output folder, whole or not at all."""
        ...
