"""The space that a scene lives in: number of dimensions and precision, as Warp types."""

# pyright: strict

from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

if TYPE_CHECKING:
    Array = wp.array[Any, Any]
else:
    Array = wp.array
"""A device array; what its elements are depends on the space."""

Struct = object
"""An instance of a struct, as kernels take it: what it holds is known to the kernels alone."""


@cache
def _vector(length: int, scalar: type) -> type:
    return wp.types.vector(length=length, dtype=scalar)


@cache
def _matrix(shape: tuple[int, int], scalar: type) -> type:
    return wp.types.matrix(shape=shape, dtype=scalar)


@dataclass(frozen=True)
class Space:
    """Dimension (1, 2, 3) and precision ("f32", "f64"). Equal spaces share their compiled kernels.

    `spaced`: what laws take and give has room to spare (`packed`)."""

    dim: int
    precision: str = "f64"
    spaced: bool = False

    @property
    def scalar(self) -> type:
        """wp.float32 or wp.float64."""
        return wp.float64 if self.precision == "f64" else wp.float32

    @property
    def numpy(self) -> type[np.float64] | type[np.float32]:
        """The numpy type of the scalar."""
        return np.float64 if self.precision == "f64" else np.float32

    @property
    def epsilon(self) -> float:
        """Rounding unit of the scalar."""
        return float(np.finfo(self.numpy).eps)

    @cached_property
    def vec(self) -> type:
        """A vector of `dim` scalars."""
        return self.vector(self.dim)

    @cached_property
    def mat(self) -> type:
        """A dim x dim matrix."""
        return self.matrix(self.dim, self.dim)

    @cached_property
    def tensor(self) -> type:
        """A 3x3 matrix: stress, velocity gradient and H in a material's law, whatever the dimension."""
        return self.matrix(3, 3)

    @cached_property
    def point(self) -> type:
        """A vector of three scalars, as wp.HashGrid wants them."""
        return self.vector(3)

    def module(self, name: str) -> wp.Module:
        """A module for kernels that are always used together: one compilation instead of several."""
        return wp.get_module(f"wsph.{name}.{self.dim}d.{self.precision}")

    def vector(self, length: int) -> type:
        """A vector type of `length` scalars."""
        return _vector(length, self.scalar)

    def packed(self, length: int) -> type:
        """A vector type for `length` numbers that a law takes or gives. Compilers hold vectors of two to four numbers of
        single precision in registers for two of them, which keeps rows side by side from being taken together: where it is
        `spaced` there are five."""
        return self.vector(max(length, 5) if self.spaced and length > 1 else length)

    def matrix(self, rows: int, columns: int) -> type:
        """A matrix type."""
        return _matrix((rows, columns), self.scalar)
