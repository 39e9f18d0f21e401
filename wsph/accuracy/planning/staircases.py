"""Staircases: bodies whose surface is in steps of a cell, and the part of their volume that a lattice misses.

Their errors go with it (correlation .92 on a disc), and it is known before any run: lattices that miss less of it than their
neighbours, by |V/V_exact - 1| x cells, are the better ones.
"""

# pyright: strict

import math

import numpy as np

from wsph.geometry.counts import lattice_counts
from wsph.geometry.fitted.planning import on_grid_lines
from wsph.geometry.shapes.combined import Shape
from wsph.scene.tables import Body

FINE = {2: 400, 3: 100}
"""Cells across a body of the lattice by which its volume is known, by the dimension."""

BESIDE = 2
"""Neighbours to each side that a lattice is compared with."""


class Staircase:
    """A body with a shape; `divisor` numbers its own lattice."""

    def __init__(self, body: Body, divisor: int):
        self._body, self._divisor = body, divisor
        self._volume = math.nan
        self._missed: dict[int, float] = {}

    def better(self, number: int) -> bool:
        """Whether a lattice misses no more of the volume than the median of its neighbours, for its cells."""
        around = [n for n in range(number - BESIDE, number + BESIDE + 1) if n >= 1]
        missed = {n: self.missed(n) * n for n in around}
        return missed[number] <= float(np.median(list(missed.values())))

    def missed(self, number: int) -> float:
        """The part of the volume that a lattice misses or has too much."""
        shape = shape_of(self._body)
        if math.isnan(self._volume):
            fine = extent(self._body).max() / FINE[shape.dim] * np.ones(shape.dim)
            self._volume = _volume(self._body, shape, fine)
        if number not in self._missed:
            steps = steps_of(self._body) * self._divisor / number
            self._missed[number] = abs(_volume(self._body, shape, steps) / self._volume - 1.0)
        return self._missed[number]


def met(body: Body) -> bool:
    """Whether cells of a grid fill a shape to its surface."""
    shape = shape_of(body)
    return body.lattice_rotate == 0.0 and (shape.type == "box" or (shape.rotate == 0.0 and on_grid_lines(shape)))


def shape_of(body: Body) -> Shape:
    """The shape of a body that has one."""
    if body.shape is None:
        raise TypeError("a body without a shape")
    return body.shape


def steps_of(body: Body) -> np.ndarray:
    """Spacings along the axes, (dim,) [m]."""
    return np.broadcast_to(np.asarray(body.spacing, float), (shape_of(body).dim,))


def extent(body: Body) -> np.ndarray:
    """The sides of its bounds, (dim,) [m]."""
    low, high = shape_of(body).bounds()
    return high - low


def across(body: Body) -> float:
    """Cells of a body's own lattice along its longest edge."""
    return float((extent(body) / steps_of(body)).max())


def _volume(body: Body, shape: Shape, steps: np.ndarray) -> float:
    """Of all cells of a lattice [m^dim]; not a number where there is no such lattice."""
    try:
        return float(lattice_counts(shape, tuple(steps.tolist()), body.lattice_rotate)[1] * np.prod(steps))
    except ValueError:
        return math.nan
