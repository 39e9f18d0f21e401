"""How much deformation has raised a body's fastest frequency: an estimate from its points alone, without right-hand sides.

The stiffness of a body is the sum of its points': G^T A G of each, with A = dP/dF, P the first Piola stress, and G what
makes a deformation F of displacements. So its largest frequency is at most that of the stiffest point by itself with the
masses that it sees (B. M. Irons, G. Treharne: A bound theorem in eigenvalues and its practical applications, 1971; I. Fried:
Bounds on the extremal eigenvalues of the finite element stiffness and mass matrices, J. Sound Vib. 22, 1972). In a lattice
G G^T is a multiple of one, and this bound goes as the root of the largest eigenvalue of A: of the same deformation along all
axes at rest. Deformation raises the bound by the root of the largest ratio of those; what holds spurious modes does not
stiffen, so that the ratio counts from 1. How much of its bound the frequency reaches changes little with the deformation:
tests/stability/test_following.py holds the estimate to measured limits.
"""

# pyright: reportUnknownMemberType=false

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.parts.part import BROKEN

SWEEPS = 2
"""Steps of the power method for the largest eigenvalue of A, from F^-T and from the longest line."""

STEP = {"f64": 1e-6, "f32": 1e-3}
"""The change of the deformation whose change of stress is the tangent's, by precision."""


@cache
def _outermost_line(space: Space) -> wp.Function:
    """Warp function: a symmetric, positive matrix -> the direction of its largest eigenvalue: its sixteenth power times a
    fixed start."""
    real, mat, vec, dim = space.scalar, space.mat, space.vec, space.dim

    @wp.func
    def line(square: mat) -> vec:
        power = square
        for _ in range(wp.static(3 if dim > 1 else 0)):
            power = power / wp.trace(power)
            power = power * power
        x = vec()
        for a in range(wp.static(dim)):
            x[a] = real(1.0) + real(0.1) * real(a)
        return wp.normalize(power * wp.normalize(power * x))

    return line


@cache
def _tangent(space: Space, laws: Laws, layout: Layout, total: bool) -> wp.Function:
    """Warp function (p, fields, H, D, i) -> A : D, the change of the first Piola stress of point i with the deformation, H
    being the latter less one: by a difference of a total law; of a rate law J times its stress rate for the velocity
    gradient D F^-1, times F^-T."""
    real, mat, dim = space.scalar, space.mat, space.dim
    Params, Fields, internal = laws.Params, fields_struct(space, layout), laws.internal
    if total:
        law, step = total_of(space, laws, layout), STEP[space.precision]

        @wp.func
        def of_total(p: Params, fields: Fields, H: mat, D: mat, i: int) -> mat:
            _s, ahead = law(p, fields, H + real(step) * D, i)
            _t, here = law(p, fields, H, i)
            return (ahead - here) / real(step)

        return of_total
    respond, unpack, kept = laws.respond, packing(space, laws.state)[0], "internals" in layout
    determinant, inverse = determinant_and_inverse(space)

    @wp.func
    def of_rate(p: Params, fields: Fields, H: mat, D: mat, i: int) -> mat:
        F = wp.identity(n=dim, dtype=real) + H
        back = inverse(F)
        q = internal()
        if wp.static(kept):
            q = fields.internals[i]
        L = D * back
        strained, _dq = respond(p, fields.stress[i], real(0.5) * (L + wp.transpose(L)), q)
        resting, _dq0 = respond(p, fields.stress[i], mat(), q)
        whole = unpack(strained - resting)
        change = mat()
        for a in range(wp.static(dim)):
            for b in range(wp.static(dim)):
                change[a, b] = whole[a, b]
        return determinant(F) * change * wp.transpose(back)

    return of_rate


@cache
def _kernel(space: Space, laws: Laws, layout: Layout, total: bool, breaks: bool) -> wp.Kernel:
    real, dim, Fields, Params = space.scalar, space.dim, fields_struct(space, layout), laws.Params
    inverse, line = determinant_and_inverse(space)[1], _outermost_line(space)
    tangent, mat = _tangent(space, laws, layout, total), space.mat

    @wp.func
    def stiffness(p: Params, fields: Fields, H: mat, start: mat, i: int) -> real:
        # The power method: the largest D : A : D over |D|^2.
        D = start / wp.sqrt(wp.ddot(start, start))
        largest = real(0.0)
        for _ in range(wp.static(SWEEPS)):
            Y = tangent(p, fields, H, D, i)
            largest = wp.max(largest, wp.ddot(D, Y))
            D = Y / wp.sqrt(wp.ddot(Y, Y))
        return largest

    @kernel()
    def stiffest(p: Params, fields: Fields, at_rest: real, points: int, stiffest_out: wp.array(dtype=wp.float64)):
        block = wp.tid()
        largest = wp.float64(1.0)
        for i in range(block * BLOCK, wp.min((block + 1) * BLOCK, points)):
            H = fields.deformation[i]
            F = wp.identity(n=dim, dtype=real) + H
            found = stiffness(p, fields, H, wp.transpose(inverse(F)), i)
            if wp.static(total and dim > 1):
                n = line(wp.transpose(F) * F)
                found = wp.max(found, stiffness(p, fields, H, wp.outer(F * n, n), i))
            whole = bool(True)
            if wp.static(breaks):
                # Across a crack the deformation is the opening's.
                whole = fields.damage[i][0] < real(BROKEN)
            if whole:
                largest = wp.max(largest, wp.float64(found / at_rest))
        stiffest_out[block] = largest

    return stiffest


class Stiffening:
    """The estimate of one body, of `points` points. `found()` is one launch and one small copy.

    _out  # the largest ratio of stiffnesses of a block, (blocks,), 1 or more
    """

    def __init__(self, constitutive: Constitutive, state: State, points: int, total: bool, breaks: bool):
        """`total`: its stress is that of the total law; `breaks`: its points may break."""
        self._constitutive, self._state, self._points = constitutive, state, points
        self._kind = total, breaks
        self._out = wp.zeros(blocks(points), dtype=wp.float64, device=state.buffer.device)

    def found(self) -> float:
        """The factor, 1 or more, by which the largest frequency has grown since the body was undeformed."""
        state, law = self._state, self._constitutive
        state.told()
        made = _kernel(state.space, law.laws, state.layout, *self._kind)
        inputs = [law.params, state.struct, state.space.scalar(law.largest_modulus), self._points]
        wp.launch(made, len(self._out), inputs=inputs, outputs=[self._out], device=self._out.device)
        return float(np.sqrt(self._out.numpy().max()))
