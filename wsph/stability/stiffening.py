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

from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks, largest
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.parts.part import BROKEN

SWEEPS = 2
"""Steps of the power method for the largest eigenvalue of A, from F^-T and from F."""

STEP = {"f64": 1e-6, "f32": 1e-3}
"""The change of the deformation whose change of stress is the tangent's, by precision."""


@cache
def _tangent(space: Space, laws: Laws, layout: Layout, total: bool) -> wp.Function:
    """Warp function (p, fields, H, here, D, i) -> A : D, the change of the first Piola stress of point i with the
    deformation, H being the latter less one: of a total law by a difference from the stress `here`; of a rate law J times
    its stress rate for the velocity gradient D F^-1, less the rate `here` of a body that does not move, times F^-T."""
    real, mat, dim, Params, Fields = space.scalar, space.mat, space.dim, laws.Params, fields_struct(space, layout)
    if total:
        law, step = total_of(space, laws, layout), STEP[space.precision]

        @wp.func
        def of_total(p: Params, fields: Fields, H: mat, here: mat, D: mat, i: int) -> mat:
            _stress, ahead = law(p, fields, H + real(step) * D, i)
            return (ahead - here) / real(step)

        return of_total
    flow, (determinant, inverse) = _flow(space, laws, layout), determinant_and_inverse(space)

    @wp.func
    def of_rate(p: Params, fields: Fields, H: mat, here: mat, D: mat, i: int) -> mat:
        F = wp.identity(n=dim, dtype=real) + H
        back = inverse(F)
        L = D * back
        change = flow(p, fields, real(0.5) * (L + wp.transpose(L)), i) - here
        return determinant(F) * change * wp.transpose(back)

    return of_rate


@cache
def _flow(space: Space, laws: Laws, layout: Layout) -> wp.Function:
    """Warp function (p, fields, D, i) -> the rate of stress of point i by its rate law at a rate of strain D, dim x dim."""
    mat, Params, Fields, internal, plane = (
        space.mat,
        laws.Params,
        fields_struct(space, layout),
        laws.internal,
        in_plane(space),
    )
    respond, unpack, kept = laws.respond, packing(space, laws.state)[0], "internals" in layout

    @wp.func
    def flow(p: Params, fields: Fields, D: mat, i: int) -> mat:
        q = internal()
        if wp.static(kept):
            q = fields.internals[i]
        packed, _dq = respond(p, fields.stress[i], D, q)
        return plane(unpack(packed))

    return flow


@cache
def _stiffness(space: Space, laws: Laws, layout: Layout, total: bool) -> wp.Function:
    """Warp function (p, fields, H, here, start, i) -> the largest D : A : D over |D|^2 found from `start` on."""
    real, mat, Params, Fields = space.scalar, space.mat, laws.Params, fields_struct(space, layout)
    tangent = _tangent(space, laws, layout, total)

    @wp.func
    def stiffness(p: Params, fields: Fields, H: mat, here: mat, start: mat, i: int) -> real:
        D = start / wp.sqrt(wp.ddot(start, start))
        largest = real(0.0)
        for _ in range(wp.static(SWEEPS)):
            change = tangent(p, fields, H, here, D, i)
            largest = wp.max(largest, wp.ddot(D, change))
            D = change / wp.sqrt(wp.ddot(change, change))
        return largest

    return stiffness


@cache
def _kernel(space: Space, laws: Laws, layout: Layout, total: bool, breaks: bool) -> wp.Kernel:
    real, mat, dim, Fields, Params = space.scalar, space.mat, space.dim, fields_struct(space, layout), laws.Params
    inverse = determinant_and_inverse(space)[1]
    law = total_of(space, laws, layout) if total else _flow(space, laws, layout)
    stiffness = _stiffness(space, laws, layout, total)

    @kernel()
    def stiffest(
        p: Params, fields: Fields, at_rest: real, low: int, end: int, stiffest_out: wp.array(dtype=wp.float64)
    ):
        block = wp.tid()
        most = wp.float64(1.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            H = fields.deformation[i]
            F = wp.identity(n=dim, dtype=real) + H
            here = mat()
            if wp.static(total):
                _stress, here = law(p, fields, H, i)
            else:
                here = law(p, fields, here, i)
            found = stiffness(p, fields, H, here, wp.transpose(inverse(F)), i)
            if wp.static(total and dim > 1):
                found = wp.max(found, stiffness(p, fields, H, here, F, i))
            whole = bool(True)
            if wp.static(breaks):
                # Across a crack the deformation is the opening's.
                whole = fields.damage[i][0] < real(BROKEN)
            if whole:
                most = wp.max(most, wp.float64(found / at_rest))
        stiffest_out[block] = most

    return stiffest


class Stiffening:
    """The estimate of one body. `found()` is one launch and one small copy.

    _out  # the largest ratio of stiffnesses of a block, (blocks,), 1 or more
    """

    def __init__(
        self, constitutive: Constitutive, state: State, points: Share, total: bool, breaks: bool, domain: Domain = WHOLE
    ):
        """`points`: those that it has of the whole body's; `total`: its stress is that of the total law; `breaks`: its
        points may break."""
        self._constitutive, self._state, self._own, self._domain = constitutive, state, points.own, domain
        self._kind = total, breaks
        self._out = wp.zeros(blocks(points.high - points.low), dtype=wp.float64, device=state.buffer.device)

    def found(self) -> float:
        """The factor, 1 or more, by which the largest frequency has grown since the body was undeformed."""
        state, law = self._state, self._constitutive
        state.told()
        made = _kernel(state.space, law.laws, state.layout, *self._kind)
        inputs = [law.params, state.struct, state.space.scalar(law.largest_modulus), self._own.start, self._own.stop]
        wp.launch(made, len(self._out), inputs=inputs, outputs=[self._out], device=self._out.device)
        return float(np.sqrt(largest(self._out, self._domain)))
