"""What the nodes of a grid have in common, and what stands by row."""

# pyright: strict

from functools import cache
from typing import Protocol, cast

import numpy as np
import warp as wp

from wsph.backend.space import Array, Space


class Grid(Protocol):
    """A grid, nondimensional, as `grid_struct` has it."""

    axes: object
    back: object
    step: object
    inverse: object
    hold: float
    stride: int
    volume: Array
    left: Array


@cache
def grid_struct(space: Space) -> type:
    """Struct of what the nodes of a grid have in common, and of what they have of their own.

    axes           # mat: the grid's axes, columns, and `back` their transpose
    step, inverse  # vec: its steps, and their inverse
    hold           # strength of the stabilisation, over twice the dimension
    stride         # of flat arrays
    volume         # of the nodes, (n,)
    left           # what is left of the stabilisation of a node that has flowed, (n,), where it fades
    """
    real, vec, mat = space.scalar, space.vec, space.mat
    annotations: dict[str, object] = {"axes": mat, "back": mat, "step": vec, "inverse": vec, "hold": real}
    annotations |= {"stride": int, "volume": wp.array(dtype=real), "left": wp.array(dtype=real)}
    return cast(type, wp.struct(type("Grid", (), {"__annotations__": annotations, "__module__": __name__})))


def grid_of(
    space: Space, step: np.ndarray, axes: np.ndarray, stabilisation: float, stride: int, own: tuple[Array, Array]
) -> Grid:
    """A grid of steps (dim,) along `axes`, columns (dim, dim), and its nodes' `own` volumes and what is left of the
    stabilisation."""
    made = cast(Grid, grid_struct(space)())
    made.axes, made.back = (space.mat(*each.ravel().tolist()) for each in (axes, axes.T))
    made.step, made.inverse = space.vec(*step.tolist()), space.vec(*(1.0 / step).tolist())
    made.hold, made.stride = space.scalar(stabilisation / (2.0 * space.dim)), stride
    made.volume, made.left = own
    return made
