"""Cells of a frame: their kinds, and the order in which VTK has their corners."""

# pyright: strict

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np


class Kind(NamedTuple):
    """A kind of cells: VTK's number of it, XDMF's name and number, and the places of VTK's corners among ours, which come in
    the order of `itertools.product` of 0 and 1 along the cell's axes where there are 2^dim of them."""

    vtk: int
    xdmf: str
    number: int
    order: tuple[int, ...]


KINDS = {
    "vertex": Kind(1, "Polyvertex", 1, (0,)),
    "line": Kind(3, "Polyline", 2, (0, 1)),
    "triangle": Kind(5, "Triangle", 4, (0, 1, 2)),
    "quadrilateral": Kind(9, "Quadrilateral", 5, (0, 2, 3, 1)),
    "tetrahedron": Kind(10, "Tetrahedron", 6, (0, 1, 2, 3)),
    "hexahedron": Kind(12, "Hexahedron", 9, (0, 4, 6, 2, 1, 5, 7, 3)),
}
"""Every kind of cells by its name."""

_NAMES = {
    (1, 2): "line",
    (2, 3): "triangle",
    (2, 4): "quadrilateral",
    (3, 4): "tetrahedron",
    (3, 8): "hexahedron",
}


@dataclass(frozen=True)
class Cells:
    """Cells of a frame, kind after kind: `blocks` by the names of their kinds, corners (c, k), rows of the frame's points in
    VTK's order; and fields of the cells by name, as the frame's are of points, as computed."""

    blocks: dict[str, np.ndarray]
    data: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])

    @property
    def count(self) -> int:
        """Cells of all kinds."""
        return sum(len(corners) for corners in self.blocks.values())

    @property
    def flat(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What VTK's grids are made of: the corners of all cells one after the other, where those of each end (c,), and the
        numbers of their kinds (c,)."""
        corners = np.concatenate([each.ravel() for each in self.blocks.values()])
        many = np.concatenate([np.full(len(each), each.shape[1], corners.dtype) for each in self.blocks.values()])
        types = [np.full(len(each), KINDS[name].vtk, np.uint8) for name, each in self.blocks.items()]
        return corners, np.cumsum(many, dtype=corners.dtype), np.concatenate(types)


def vertices(count: int) -> Cells:
    """A cell for every one of `count` points."""
    return Cells({"vertex": np.arange(count, dtype=_integer(count))[:, None]})


class Gathered:
    """Cells of bodies, one behind the other: `blocks` are those of each body, corners (c, 2^dim) in the order of
    `itertools.product` or (c, dim + 1) of its own `counts` of points; a body without any has a vertex a point. `most`: the
    points of all parts, where this is one of them: their corners are numbers of one type."""

    def __init__(self, blocks: Sequence[Sequence[np.ndarray]], counts: Sequence[int], dim: int, most: int = 0):
        parts: list[tuple[str, np.ndarray]] = []
        first, of = 0, _integer(max(most, sum(counts)))
        for own, count in zip(blocks, counts, strict=True):
            for corners in own or [np.arange(count)[:, None]]:
                name = _NAMES[dim, corners.shape[1]] if own else "vertex"
                parts.append((name, (corners[:, KINDS[name].order] + first).astype(of)))
            first += count
        parts = [part for part in parts if len(part[1])] or parts[:1]
        kinds = dict.fromkeys(name for name, _ in parts)
        places = {kind: k for k, kind in enumerate(kinds)}
        place = np.concatenate([np.full(len(corners), places[name]) for name, corners in parts])
        self._order: np.ndarray | None = np.argsort(place, kind="stable") if len(kinds) > 1 else None
        self._cells = Cells({kind: np.concatenate([own for name, own in parts if name == kind]) for kind in kinds})

    def having(self, data: dict[str, np.ndarray]) -> Cells:
        """The cells with fields `data`, body after body and there as its blocks come."""
        if self._order is not None:
            data = {name: values[self._order] for name, values in data.items()}
        return replace(self._cells, data=data)


def _integer(count: int) -> type[np.signedinteger]:
    """The numbers that corners are kept in; their sum over cells fits too."""
    return np.int32 if 8 * count < np.iinfo(np.int32).max else np.int64


def counted(words: Iterable[str], part: int | None = None) -> dict[str, int]:
    """How many cells of which kinds a frame or one of its parts has, from the words that list it
    (`wsph.output.frames.Listed`)."""
    found = (word.split(":", 3) for word in words if word.startswith("corners/"))
    each = {name.removeprefix("corners/"): [int(count) for count in counts.split()] for name, _, _, counts in found}
    if part is None:
        return {kind: sum(counts) for kind, counts in each.items()}
    return {kind: counts[part] for kind, counts in each.items() if counts[part]}
