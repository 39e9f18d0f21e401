"""Bodies of particles alone: positions and volumes from a file, with no cells between them and no faces around them."""

# pyright: strict

import math
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from wsph.geometry.faces import Faces
from wsph.geometry.gradients import PointRows
from wsph.geometry.meshes.layered import Layered, Whole
from wsph.geometry.meshes.layers import Layers, layer_of, longest_axis
from wsph.ranks.slabs import Slab

AXES = "xyz"

NEAR = 1.0
"""Distance [spacings] to a particle within which a point lies in the body."""


EXACT = 2.0**-36
"""Places in units of cells are whole multiples of this, so that distances have no rounding, from wherever they are taken."""


@dataclass(frozen=True)
class Scattered(Layered):
    """Particles that are their own points; the spacing is the edge of a cube of their mean volume [m]."""

    @property
    def centred(self) -> tuple[np.ndarray, np.ndarray]:
        places = np.rint(super().centred[0] / EXACT) * EXACT
        return places, places

    def cut(self, slab: Slab, of: Whole) -> "Scattered":
        rows = slab.nodes.window
        volume = self.cell_volume[rows]
        return replace(self, nodes=self.nodes[rows], node_volume=volume, cell_volume=volume, of=of)

    @property
    def cells(self) -> np.ndarray:
        return self.nodes

    @property
    def rows(self) -> PointRows:
        """Each its own."""
        n = len(self.nodes)
        return PointRows(np.arange(n + 1), np.arange(n), None)

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which of `points` (m, dim) [m] are within a spacing of a particle, (m,) bool."""
        gaps = [np.linalg.norm(point - self.nodes, axis=1).min() for point in points]
        return np.array(gaps) <= NEAR * self.spacing


def scattered(position: np.ndarray, volume: np.ndarray, support: float = 2.6) -> Scattered:
    """A body of particles at `position` (n, dim) [m] with `volume` (n,) [m^dim], numbered layer by layer along its longest
    side, those of a layer in the order that they have, which see each other as far as `support` [spacings]. Raises
    ValueError for volumes that are not above zero, numbers that are not finite and particles in one place."""
    if not (np.isfinite(position).all() and np.isfinite(volume).all()):
        raise ValueError("a position or a volume is not finite")
    if not (volume > 0.0).all():
        worst = int(volume.argmin())
        raise ValueError(f"the volume of the particle at {position[worst].tolist()} m is not above zero")
    if len(np.unique(position, axis=0)) < len(position):
        raise ValueError("two particles are in one place")
    dim = position.shape[1]
    size = float(volume.mean()) ** (1.0 / dim)
    axis = longest_axis(position)
    layer, start = layer_of(position @ axis, size)
    order = np.argsort(layer, kind="stable")
    position, volume, many = position[order], volume[order], np.bincount(layer)
    visits = np.bincount(layer[order], crowd(position, support * size))
    layers = Layers(np.append(many, 0), many, visits, axis, start, size)
    none, flags = np.zeros(0, int), np.zeros(0, bool)
    faces = Faces(
        np.zeros((0, 1), int), none, none, none, np.zeros((0, 1)), np.zeros((0, 1, dim)), none, flags, flags, {}
    )
    return Scattered(position, volume, volume, faces, (size, size), layers=layers)


def crowd(position: np.ndarray, reach: float) -> np.ndarray:
    """How many others particles at `position` (n, dim) [m] see within a `reach` [m], about, (n,): as many as there are in
    cubes of that edge around theirs, times the part of these that a ball is."""
    dim = int(position.shape[1])
    cube = np.floor((position - position.min(0)) / reach).astype(np.int64) + 1
    sides = cube.max(0) + 2
    strides = np.array([int(np.prod(sides[k + 1 :], dtype=np.int64)) for k in range(dim)], np.int64)
    there, mine, many = np.unique(cube @ strides, return_inverse=True, return_counts=True)
    found = np.zeros(len(there))
    for step in product((-1, 0, 1), repeat=dim):
        near = there + int(np.array(step) @ strides)
        at = np.minimum(np.searchsorted(there, near), len(there) - 1)
        found += np.where(there[at] == near, many[at], 0)
    ball = (2.0, math.pi, 4.0 / 3.0 * math.pi)[dim - 1]
    every: np.ndarray = ball / 3.0**dim * found[mine]
    return every


def read_points(path: Path, dim: int, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, dim) [m] and volumes (n,) [m^dim] of a file in units of `scale` [m]: comma-separated values with a line
    of names, x, y, z and volume. Raises ValueError for a file that has not these, OSError where there is none."""
    text = path.read_text(encoding="utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) < 2:
        raise ValueError(
            f"{path.name} has no particles: write a line of names, such as x,y,volume, and a line for each"
        )
    names = [name.strip() for name in lines[0].split(",")]
    wanted = [*AXES[:dim], "volume"]
    if sorted(names) != sorted(wanted):
        raise ValueError(f"{path.name} has the columns {', '.join(names)}; in {dim}D they are {', '.join(wanted)}")
    try:
        table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from None
    columns = [table[:, names.index(name)] for name in wanted]
    return scale * np.stack(columns[:-1], 1), scale**dim * columns[-1]
