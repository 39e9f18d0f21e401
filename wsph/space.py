"""The space that a scene lives in: number of dimensions and precision, as Warp types."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import warp as wp


@cache
def _vector(length: int, scalar: type) -> type:
    return wp.types.vector(length=length, dtype=scalar)


@cache
def _matrix(shape: tuple[int, int], scalar: type) -> type:
    return wp.types.matrix(shape=shape, dtype=scalar)


@dataclass(frozen=True)
class Space:
    """Dimension (1, 2, 3) and precision ("f32", "f64"). Equal spaces share their compiled kernels."""

    dim: int
    precision: str = "f64"

    @property
    def scalar(self) -> type:
        """wp.float32 or wp.float64."""
        return wp.float64 if self.precision == "f64" else wp.float32

    @property
    def numpy(self) -> type:
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

    def matrix(self, rows: int, columns: int) -> type:
        """A matrix type."""
        return _matrix((rows, columns), self.scalar)


@cache
def determinant_and_inverse(space: Space) -> tuple[wp.Function, wp.Function]:
    """Warp functions determinant(mat) and inverse(mat) of a dim x dim matrix; Warp's own have no 1x1."""
    real, mat = space.scalar, space.mat
    if space.dim == 1:

        @wp.func
        def determinant(a: mat) -> real:
            return a[0, 0]

        @wp.func
        def inverse(a: mat) -> mat:
            b = mat()
            b[0, 0] = real(1.0) / a[0, 0]
            return b

        return determinant, inverse

    @wp.func
    def determinant_of(a: mat) -> real:
        return wp.determinant(a)

    @wp.func
    def inverse_of(a: mat) -> mat:
        return wp.inverse(a)

    return determinant_of, inverse_of


@cache
def in_plane(space: Space) -> wp.Function:
    """Warp function: the dim x dim block of a 3x3 tensor."""
    mat, tensor, dim = space.mat, space.tensor, space.dim

    @wp.func
    def block(full: tensor) -> mat:
        result = mat()
        for a in range(wp.static(dim)):
            for b in range(wp.static(dim)):
                result[a, b] = full[a, b]
        return result

    return block


@cache
def _circle(space: Space) -> wp.Function:
    """Warp function symmetric 2 x 2 -> middle, half the difference of the normals, and radius of Mohr's circle."""
    real, mat = space.scalar, space.mat

    @wp.func
    def circle(a: mat):
        half = real(0.5) * (a[0, 0] - a[1, 1])
        return real(0.5) * (a[0, 0] + a[1, 1]), half, wp.sqrt(half * half + a[0, 1] * a[0, 1])

    return circle


@cache
def principal(space: Space) -> wp.Function:
    """Warp function symmetric dim x dim -> (axes in columns, values)."""
    real, vec, mat, dim = space.scalar, space.vec, space.mat, space.dim
    if dim == 1:

        @wp.func
        def along(a: mat):
            return wp.identity(n=1, dtype=real), vec(a[0, 0])

        return along
    if dim == 2:
        circle = _circle(space)

        @wp.func
        def in_two(a: mat):
            mean, half, radius = circle(a)
            c = real(1.0)
            s = real(0.0)
            if radius > real(0.0):
                # Of cosine and sine of the half angle the larger by its root, the other from their product.
                larger = wp.sqrt(real(0.5) * (real(1.0) + wp.abs(half) / radius))
                smaller = real(0.5) * a[0, 1] / (radius * larger)
                c = larger
                s = smaller
                if half < real(0.0):
                    c = smaller
                    s = larger
            return mat(c, -s, s, c), vec(mean + radius, mean - radius)

        return in_two

    @wp.func
    def in_space(a: mat):
        axes, values = wp.eig3(a)
        return axes, values

    return in_space


@cache
def spectral(space: Space) -> tuple[wp.Function, wp.Function]:
    """Warp functions symmetric dim x dim -> (what its axes are known by, values), and (that, one number an axis) -> sum of
    the numbers times n (x) n. In 2D the axes are known by (n1 n1 - n2 n2), which takes one root and one quotient."""
    real, vec, mat, dim, axes_of = space.scalar, space.vec, space.mat, space.dim, principal(space)
    if dim == 2:
        circle = _circle(space)

        @wp.func
        def known_in_two(a: mat):
            mean, half, radius = circle(a)
            difference = mat()
            if radius > real(0.0):
                difference = mat(half, a[0, 1], a[0, 1], -half) / radius
            return difference, vec(mean + radius, mean - radius)

        @wp.func
        def sum_in_two(difference: mat, c: vec) -> mat:
            mean = real(0.5) * (c[0] + c[1])
            return mean * wp.identity(n=2, dtype=real) + (real(0.5) * (c[0] - c[1])) * difference

        return known_in_two, sum_in_two

    @wp.func
    def sum_of(axes: mat, c: vec) -> mat:
        total = mat()
        for k in range(wp.static(dim)):
            n = vec()
            for a in range(wp.static(dim)):
                n[a] = axes[a, k]
            total = total + c[k] * wp.outer(n, n)
        return total

    return axes_of, sum_of
