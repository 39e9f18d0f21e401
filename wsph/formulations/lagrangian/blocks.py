"""Volumes averaged over blocks of neighbouring particles, against volumetric locking of nearly incompressible bodies.

One volume constraint a particle is more than a particle's share of the degrees of freedom: a body of nu = 0.49 and above is
too stiff, and its pressure alternates. The change of volume is therefore one of a block b of up to 2^dim particles,

    Jbar = sum_b V_p J_p/sum_b V_p,  Fbar_p = a_p F_p,  a_p = (Jbar/J_p)^(1/dim),  energy sum V_p psi(Fbar_p)

(F-bar: de Souza Neto et al. 1996), and forces are the exact slope of that energy:

    P = dpsi/dF(Fbar),  q_p = a_p P:F_p/dim,  qbar = sum_b V_p q_p/sum_b V_p
    P_eff = a_p P + (J_p/Jbar qbar - q_p) F_p^-T,     sigma = (Jbar/J_p) sigma(Fbar) + (qbar/Jbar - q_p/J_p) I

Of a rate law the rate of the volume is one of a block, theta = sum_b V_p J_p tr L_p/sum_b V_p J_p in place of tr L_p, and so
is the pressure that forces take, the mean with the same weights: what makes the power of both the same. A law that flows
changes its shape and not its volume, so that it locks whatever its Poisson's ratio.

Momentum, angular momentum and energy are kept. Linear fields are exact, because J is the same in all of a block. Where the
volume is easily changed, blocks only soften, by 1.4 % at nu = 0.3 in a beam of eight rows: bodies have them from
`wsph.parts.part.LOCKING` on.
"""

# What `wp.static` leaves out is not compiled: a function that is not there is not called.
# pyright: reportOptionalCall=false

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space, Struct
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, coefficients_of, smoothed
from wsph.geometry.lattice import Lattice
from wsph.parts.fading import faded
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def blocks_of(lattice: Lattice, space: Space, arrays: Arrays) -> tuple[int, Struct]:
    """The number of blocks of a lattice's nodes, two along every axis, and the nodes of each as rows. Blocks at odd ends are
    incomplete."""
    index = np.rint(lattice.index).astype(int) // 2
    _, block = np.unique(index - index.min(0), axis=0, return_inverse=True)
    block = block.ravel()
    rows = rows_struct(space)()
    count = int(block.max()) + 1
    offsets = np.concatenate([[0], np.cumsum(np.bincount(block, minlength=count))])
    rows.offsets = arrays.of("blocks.offsets", offsets.astype(np.int32), wp.int32)
    rows.indices = arrays.of("blocks.indices", np.argsort(block, kind="stable").astype(np.int32), wp.int32)
    return count, rows


def _gathered_volume(space: Space, layout: Layout, averaged: bool) -> wp.Function:
    """Warp function (rows, points, blocks, b, fields_out, answers) -> the mean J of block b; its particles get their
    averaged gradients as deformation."""
    real, dim, Fields = space.scalar, space.dim, fields_struct(space, layout)
    Rows, Points, Answers, average = (
        rows_struct(space),
        points_struct(space),
        answers_struct(space),
        smoothed(space, averaged),
    )
    determinant = determinant_and_inverse(space)[0]

    @wp.func
    def gathered(rows: Rows, points: Points, blocks: Rows, b: int, fields_out: Fields, answers: Answers) -> real:
        volume = real(0.0)
        current = real(0.0)
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            H = average(rows, points, answers.gradient, i)
            fields_out.deformation[i] = H
            volume += points.volume[i]
            current += points.volume[i] * determinant(wp.identity(n=dim, dtype=real) + H)
        return current / volume

    return gathered


def block_strain_kernel(space: Space, laws: Laws, layout: Layout, form: Form) -> wp.Kernel:
    """`strain` of a total law, over blocks: deformation with the block's volume, stress, and first Piola stress before it is
    averaged. A block that is turned inside out gets what is not finite."""
    real, dim, Fields = space.scalar, space.dim, fields_struct(space, layout)
    Params, total = laws.Params, total_of(space, laws, layout)
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    determinant, inverse = determinant_and_inverse(space)
    (unpack, pack), volume_of = packing(space, laws.state), _gathered_volume(space, layout, form.averaged)

    @kernel(ranged=True, pairs=True)
    def block_strain(
        first: int,
        p: Params,
        rows: Rows,
        points: Points,
        blocks: Rows,
        fields_out: Fields,
        answers_out: Answers,
    ):
        b = first + wp.tid()
        mean = volume_of(rows, points, blocks, b, fields_out, answers_out)
        one = wp.identity(n=dim, dtype=real)
        volume = real(0.0)
        pull = real(0.0)
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            F = one + fields_out.deformation[i]
            J = determinant(F)
            scale = wp.pow(mean / J, real(wp.static(1.0 / dim)))
            # From H, so that small strains keep their digits.
            H = scale * fields_out.deformation[i] + (scale - real(1.0)) * one
            s, P = total(p, fields_out, H, i)
            fields_out.stress[i] = (mean / J) * s
            answers_out.nominal[i] = scale * P
            volume += points.volume[i]
            pull += points.volume[i] * scale * wp.ddot(P, F) / real(dim)
        pull = pull / volume
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            F = one + fields_out.deformation[i]
            J = determinant(F)
            own = wp.ddot(answers_out.nominal[i], F) / real(dim)
            answers_out.nominal[i] = answers_out.nominal[i] + (J / mean * pull - own) * wp.transpose(inverse(F))
            shown = unpack(fields_out.stress[i])
            fields_out.stress[i] = pack(shown + (pull / mean - own / J) * wp.identity(n=3, dtype=real))
            scale = wp.pow(mean / J, real(wp.static(1.0 / dim)))
            fields_out.deformation[i] = scale * fields_out.deformation[i] + (scale - real(1.0)) * one

    return block_strain


def dilation_kernel(space: Space, layout: Layout, form: Form) -> wp.Kernel:
    """What a rate law's velocity gradient gets at every particle, times the unit matrix, so that its trace is its block's:
    `ahead` steps on, as in `wsph.formulations.lagrangian.flow`."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Rows, Points, average = rows_struct(space), points_struct(space), smoothed(space, form.averaged)
    determinant, inverse = determinant_and_inverse(space)

    @kernel(ranged=True, pairs=True)
    def dilation(
        first: int,
        clock: wp.array(dtype=wp.float64),
        ahead: real,
        rows: Rows,
        points: Points,
        blocks: Rows,
        gradients: wp.array(dtype=mat),
        fields: Fields,
        dilation_out: wp.array(dtype=real),
    ):
        b = first + wp.tid()
        dt = ahead * real(dt_of(clock))
        volume = real(0.0)
        rate = real(0.0)
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            change = average(rows, points, gradients, i)
            later = wp.identity(n=dim, dtype=real) + fields.deformation[i] + dt * change
            own = wp.trace(change * inverse(later))
            current = points.volume[i] * determinant(later)
            dilation_out[i] = own
            volume += current
            rate += current * own
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            dilation_out[i] = (rate / volume - dilation_out[i]) / real(dim)

    return dilation


def block_stress_kernel(space: Space, laws: Laws, layout: Layout, form: Form) -> wp.Kernel:
    """`strain` of a rate law, over blocks: deformation, and first Piola stress before it is averaged, with the block's
    pressure."""
    real, dim, Fields = space.scalar, space.dim, fields_struct(space, layout)
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    (determinant, inverse), average = determinant_and_inverse(space), smoothed(space, form.averaged)
    unpack, plane, left = packing(space, laws.state)[0], in_plane(space), faded(space)
    Coefficients = coefficients_of(space, form)

    @kernel(ranged=True, pairs=True)
    def block_stress(
        first: int,
        c: Coefficients,
        rows: Rows,
        points: Points,
        blocks: Rows,
        response_out: Points,
        fields_out: Fields,
        answers_out: Answers,
    ):
        b = first + wp.tid()
        one = wp.identity(n=dim, dtype=real)
        volume = real(0.0)
        push = real(0.0)
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            H = average(rows, points, answers_out.gradient, i)
            fields_out.deformation[i] = H
            current = points.volume[i] * determinant(one + H)
            volume += current
            push += current * wp.trace(plane(unpack(fields_out.stress[i])))
        push = push / (volume * real(dim))
        for k in range(blocks.offsets[b], blocks.offsets[b + 1]):
            i = blocks.indices[k]
            if wp.static(form.fades >= 0):
                flowed = c.yields * fields_out.internals[i][wp.static(form.fades)]
                response_out.share[i] = points.share[i] * left(flowed)
            F = one + fields_out.deformation[i]
            cauchy = plane(unpack(fields_out.stress[i]))
            cauchy += (push - wp.trace(cauchy) / real(dim)) * one
            answers_out.nominal[i] = cauchy * (determinant(F) * wp.transpose(inverse(F)))

    return block_stress
