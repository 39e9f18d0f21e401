"""Algebra of small tensors as Warp functions: inverses, principal axes, blocks, turns and spins."""

from functools import cache

import warp as wp

from wsph.backend.space import Space


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
def embedded(space: Space) -> wp.Function:
    """Warp function dim x dim -> 3x3, zero elsewhere."""
    mat, tensor, dim = space.mat, space.tensor, space.dim

    @wp.func
    def embed(L: mat) -> tensor:
        full = tensor()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                full[i, j] = L[i, j]
        return full

    return embed


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
    """Warp functions symmetric dim x dim -> (its axes in a compact form, values), and (that, one number an axis) -> sum of
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


# A pivot this far below the largest belongs to a direction that the neighbours do not span.
SINGULAR = 1e-9


@cache
def generalized_inverse(space: Space) -> wp.Function:
    """Warp function: (A, dim x dim symmetric, semidefinite, size) -> (inverse on the directions that A spans, rank).

    `size` is what entries of A are compared with, beside its own largest: below SINGULAR of both they are rounding. Sweeps
    with diagonal pivoting; directions whose pivot vanishes get a zero row and column.
    """
    dim, real, vec, mat = space.dim, space.scalar, space.vec, space.mat

    @wp.func
    def inverse(a: mat, size: real):
        b = a
        largest = size
        for k in range(wp.static(dim)):
            largest = wp.max(largest, a[k, k])
        swept = vec()
        rank = int(0)
        for _ in range(wp.static(dim)):
            pivot = int(-1)
            best = largest * real(SINGULAR)
            for k in range(wp.static(dim)):
                if swept[k] == real(0.0) and b[k, k] > best:
                    best = b[k, k]
                    pivot = k
            if pivot >= 0:
                p = b[pivot, pivot]
                c = b
                for i in range(wp.static(dim)):
                    for j in range(wp.static(dim)):
                        if i != pivot and j != pivot:
                            c[i, j] = b[i, j] - b[i, pivot] * b[pivot, j] / p
                        elif i == pivot and j == pivot:
                            c[i, j] = real(-1.0) / p
                        else:
                            c[i, j] = b[i, j] / p
                b = c
                swept[pivot] = real(1.0)
                rank += 1
        result = mat()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                if swept[i] != real(0.0) and swept[j] != real(0.0):
                    result[i, j] = -b[i, j]
        return result, rank

    return inverse


@cache
def turning(space: Space) -> wp.Function:
    """Warp function (3x3 tensor, frame) -> the tensor's components in the frame, whose rows are its axes; the out-of-plane
    axis stays."""
    dim, real, tensor, mat = space.dim, space.scalar, space.tensor, space.mat

    @wp.func
    def turned(full: tensor, frame: mat) -> tensor:
        Q = wp.identity(n=3, dtype=real)
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                Q[i, j] = frame[i, j]
        return Q * full * wp.transpose(Q)

    return turned


@cache
def spin(space: Space) -> tuple[wp.Function, wp.Function]:
    """Warp functions: velocity gradient -> the components above the diagonal of its skew part, and these -> skew matrix."""
    dim, real, mat = space.dim, space.scalar, space.mat
    spins = space.vector(max(dim * (dim - 1) // 2, 1))

    @wp.func
    def spin_of(L: mat) -> spins:
        w = spins()
        n = int(0)
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                if j > i:
                    w[n] = real(0.5) * (L[i, j] - L[j, i])
                    n += 1
        return w

    @wp.func
    def turn_of(w: spins) -> mat:
        W = mat()
        n = int(0)
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                if j > i:
                    W[i, j] = w[n]
                    W[j, i] = -w[n]
                    n += 1
        return W

    return spin_of, turn_of
