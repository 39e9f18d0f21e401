"""Energies, momentum and the finite check of a body, in blocks of fixed size: the same sums for any number of threads."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.evolution import volume_ratio
from wsph.constitutive.initial import total_energy_of
from wsph.constitutive.laws import Laws
from wsph.parts.part import BROKEN
from wsph.parts.terms import Response
from wsph.ranks.blocks import Blocks

SMALL = 0.02
"""A strain below which a bound of the distortion is as good as the distortion: limits are recomputed beyond 5 %."""

KINETIC, STRAIN, DISSIPATED, NOT_FINITE, FIRST, STRETCH, DISTORTION, MOMENTUM = range(8)
"""Columns of the sums of a block: FIRST is its first particle that is not finite, or its first point and a half, -1 where
all are;
STRETCH and DISTORTION are the largest; the three components of the momentum stand from MOMENTUM on."""


OF_PARTICLES, OF_POINTS = [KINETIC, MOMENTUM, MOMENTUM + 1, MOMENTUM + 2], [STRAIN, DISSIPATED]
"""Columns that are summed up over particles and over points."""


@dataclass
class BodySums:
    """Sums over a body, nondimensional: energies, momentum (dim,), `bad` (first particle that is not finite or is turned
    inside out, or -1), `stretch`, the largest factor by which deformation has raised a particle's Courant number, and
    `distortion`, the largest factor by which it has lengthened or shortened a line."""

    kinetic: float
    strain: float
    dissipated: float
    momentum: np.ndarray
    bad: int
    stretch: float
    distortion: float


@dataclass(frozen=True)
class StoredEnergy:
    """The energy that a point of a body stores.

    stored(p, fields, i) -> the elastic energy density of point i [per current volume, or per reference volume];
    whole(fields, i) -> whether its deformation says something of the body's: across a crack F is the opening's.
    `per_reference`: the density is per reference volume.
    """

    stored: wp.Function
    whole: wp.Function
    per_reference: bool


@cache
def stored_energy(
    space: Space, laws: Laws, layout: Layout, response: Response | None, breaks: bool, total: bool
) -> StoredEnergy:
    """The energy stored by a point that obeys `laws`, or its `response` in their place, and of a body that may break.
    `total`: its stress is that of the total law; where it is integrated from rates, the energy is that of the stress."""
    real, Params, Fields = space.scalar, laws.Params, fields_struct(space, layout)
    of_stress, of_deformation, counted = laws.energy, laws.total_energy if total else None, laws.kept.stored
    per_reference = of_deformation is not None or (response is None and counted >= 0)
    if response is not None:
        of_damaged = response.energy(space, laws)

        @wp.func
        def damaged_stored(p: Params, fields: Fields, i: int) -> real:
            return of_damaged(p, fields.deformation[i], fields.stress[i], fields.damage[i][0])

        stored = damaged_stored
    elif counted >= 0:

        @wp.func
        def counted_stored(p: Params, fields: Fields, i: int) -> real:
            return fields.internals[i][counted]

        stored = counted_stored
    elif of_deformation is not None:
        stored = total_energy_of(space, laws, layout)
    else:

        @wp.func
        def elastic_stored(p: Params, fields: Fields, i: int) -> real:
            return of_stress(p, fields.stress[i])

        stored = elastic_stored
    if breaks:

        @wp.func
        def unbroken(fields: Fields, i: int) -> bool:
            return fields.damage[i][0] < real(BROKEN)

        return StoredEnergy(stored, unbroken, per_reference)

    @wp.func
    def always(fields: Fields, i: int) -> bool:
        return True

    return StoredEnergy(stored, always, per_reference)


@cache
def _shortening(space: Space) -> wp.Function:
    """Warp function: F^-1 -> the largest factor by which a line has been shortened; of F that of lengthening."""
    real, vec, mat, dim = space.scalar, space.vec, space.mat, space.dim

    @wp.func
    def shortening(back: mat) -> real:
        # The largest singular value of a matrix, by power iteration from a fixed start.
        square = back * wp.transpose(back)
        x = vec()
        for a in range(wp.static(dim)):
            x[a] = real(1.0) + real(0.1) * real(a)
        for _ in range(wp.static(12 if dim > 1 else 1)):
            x = wp.normalize(square * x)
        return wp.sqrt(wp.dot(x, square * x))

    return shortening


@cache
def _occupied(space: Space, laws: Laws, layout: Layout, whole: wp.Function, per_reference: bool) -> wp.Function:
    """Warp function (fields, volume, i) -> the volume that the energy density of point i is of; below zero, or not finite,
    where it is turned inside out."""
    real, Fields, deformed = space.scalar, fields_struct(space, layout), "deformation" in dict(layout)
    ratio = volume_ratio(space, laws, layout)

    @wp.func
    def occupied(fields: Fields, volume: real, i: int) -> real:
        current = volume
        if wp.static(deformed):
            J = ratio(fields, i)
            if wp.static(per_reference):
                if whole(fields, i) and not (real(0.0) < J):
                    current = -current
            elif whole(fields, i):
                current *= J
        return current

    return occupied


@cache
def _changed_shape(space: Space, layout: Layout, whole: wp.Function, follows: bool) -> wp.Function:
    """Warp function (fields, i, stretch, distortion) -> both, or point i's own where they are larger."""
    real, dim, Fields, shortening = space.scalar, space.dim, fields_struct(space, layout), _shortening(space)
    (determinant, inverse), deformed = determinant_and_inverse(space), "deformation" in dict(layout)

    @wp.func
    def changed(fields: Fields, i: int, stretch: wp.float64, distortion: wp.float64):
        largest_stretch = stretch
        largest = distortion
        if wp.static(deformed):
            F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
            # Where the Courant number itself does not follow, a bound is enough for what has hardly deformed.
            size = wp.ddot(fields.deformation[i], fields.deformation[i])
            if wp.static(not follows) and size < real(wp.static(SMALL * SMALL)):
                largest = wp.max(largest, wp.float64(real(1.0) / (real(1.0) - wp.sqrt(size))))
            elif whole(fields, i):
                shortest = shortening(inverse(F))
                largest_stretch = wp.max(largest_stretch, wp.float64(shortest * wp.sqrt(determinant(F))))
                largest = wp.max(largest, wp.float64(wp.max(shortest, shortening(F))))
        return largest_stretch, largest

    return changed


@wp.func
def _start(starts: wp.array(dtype=wp.int32), block: int) -> int:
    """Where a block begins: behind the last there is nothing."""
    return starts[wp.min(block, starts.shape[0] - 1)]


@cache
def _ledger_kernel(space: Space, laws: Laws, layout: Layout, energy: StoredEnergy, follows: bool) -> wp.Kernel:
    real, dim, Fields, stored = space.scalar, space.dim, fields_struct(space, layout), energy.stored
    occupied, Params = _occupied(space, laws, layout, energy.whole, energy.per_reference), laws.Params
    changed = _changed_shape(space, layout, energy.whole, follows)
    last, dissipates = laws.kept.dissipation, laws.dissipates

    @kernel()
    def ledger(
        p: Params,
        fields: Fields,
        volume: wp.array(dtype=real),
        points: wp.array(dtype=real),
        density: real,
        nodes: wp.array(dtype=wp.int32),
        places: wp.array(dtype=wp.int32),
        apart: int,
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        block = wp.tid()
        kinetic = wp.float64(0.0)
        strain = wp.float64(0.0)
        dissipated = wp.float64(0.0)
        broken = wp.float64(0.0)
        first = wp.float64(-1.0)
        stretch = wp.float64(1.0)
        distortion = wp.float64(1.0)
        momentum = wp.vec3d()
        # A body may have its velocities and its stresses at different places: nodes and points.
        for i in range(_start(nodes, block), _start(nodes, block + 1)):
            v = fields.velocity[i]
            mass = density * volume[i]
            square = wp.dot(v, v)
            kinetic += wp.float64(real(0.5) * mass * square)
            for a in range(wp.static(dim)):
                momentum[a] = momentum[a] + wp.float64(mass * v[a])
            if not wp.isfinite(square):
                broken += wp.float64(1.0)
                if first < wp.float64(0.0):
                    first = wp.float64(i)
        for i in range(_start(places, block), _start(places, block + 1)):
            each = stored(p, fields, i)
            current = occupied(fields, points[i], i)
            stretch, distortion = changed(fields, i, stretch, distortion)
            strain += wp.float64(current * each)
            if wp.static(dissipates):
                dissipated += wp.float64(points[i] * fields.internals[i][last])
            # A maximum drops NaN; a sum keeps it, so the check is on the sum.
            if not (wp.isfinite(each) and current > real(0.0)):
                broken += wp.float64(1.0)
                if first < wp.float64(0.0):
                    first = wp.float64(i + apart) + wp.float64(0.5)
        sums_out[block, KINETIC] = kinetic
        sums_out[block, STRAIN] = strain
        sums_out[block, DISSIPATED] = dissipated
        sums_out[block, NOT_FINITE] = broken
        sums_out[block, FIRST] = first
        sums_out[block, STRETCH] = stretch
        sums_out[block, DISTORTION] = distortion
        for a in range(3):
            sums_out[block, MOMENTUM + a] = momentum[a]

    return ledger


class Diagnostics:
    """Sums over one body of n particles and m points. `measure(state)` is one launch and one small copy. Nondimensional:

    _volume, _points  # volumes of the particles (n,) and of the points (m,), scalar
    _starts           # of their blocks, those that a process owns, (blocks + 1,) int32 each
    _sums             # (blocks, MOMENTUM + 3) float64, columns as KINETIC to MOMENTUM say
    """

    def __init__(
        self,
        space: Space,
        constitutive: Constitutive,
        volume: np.ndarray,
        points: np.ndarray,
        density: float,
        device: str,
        response: Response | None = None,
        breaks: bool = False,
        follows: bool = True,
        domain: Domain = WHOLE,
        total: bool = False,
        shares: tuple[Share, Share] | None = None,
    ):
        """`response`: how its points answer in place of their law; `follows`: its Courant number follows the deformation, to
        rounding; `total`: its stress is that of the total law; `shares`: the particles and the points of the whole that it
        has."""
        self._answers, self._follows, self._domain = (response, breaks, total), follows, domain
        self._space, self._constitutive, self._density, self._device = space, constitutive, density, device
        self._volume = wp.array(volume, dtype=space.scalar, device=device)
        self._points = self._volume if points is volume else wp.array(points, dtype=space.scalar, device=device)
        self._shares = shares or (Share.all(len(volume)), Share.all(len(points)))
        self._blocks = [Blocks.of(share) for share in self._shares]
        self._starts = [
            wp.array(each.starts + share.own.start, dtype=wp.int32, device=device)
            for each, share in zip(self._blocks, self._shares, strict=True)
        ]
        count = max(each.count for each in self._blocks)
        self._sums = wp.zeros((count, MOMENTUM + 3), dtype=wp.float64, device=device)

    def kernel(self, state: State) -> wp.Kernel:
        """The kernel that sums up `state`."""
        laws = self._constitutive.laws
        energy = stored_energy(self._space, laws, state.layout, *self._answers)
        return _ledger_kernel(self._space, laws, state.layout, energy, self._follows)

    def measure(self, state: State) -> BodySums:
        """Sum up a state."""
        state.told()
        inputs = [self._constitutive.params, state.struct, self._volume, self._points]
        inputs += [self._space.scalar(self._density), *self._starts, self._shares[1].first - self._shares[0].first]
        wp.launch(self.kernel(state), len(self._sums), inputs=inputs, outputs=[self._sums], device=self._device)
        sums = self._sums.numpy()
        total = self._whole(sums)
        largest = self._domain.max(sums[:, (STRETCH, DISTORTION)].max(0))
        first = self._first(sums)
        return BodySums(
            kinetic=float(total[KINETIC]),
            strain=float(total[STRAIN]),
            dissipated=float(total[DISSIPATED]),
            momentum=total[MOMENTUM : MOMENTUM + self._space.dim].copy(),
            bad=int(first) if np.isfinite(first) else -1,
            stretch=float(largest[0]),
            distortion=float(largest[1]),
        )

    def _whole(self, sums: np.ndarray) -> np.ndarray:
        """The sums over the whole body, by columns."""
        total = np.zeros(sums.shape[1])
        for columns, each in zip((OF_PARTICLES, OF_POINTS), self._blocks, strict=True):
            rows = np.ascontiguousarray(sums[: each.count, columns])
            total[columns] = each.whole(rows, self._domain).sum(0)
        return total

    def _first(self, sums: np.ndarray) -> float:
        """The number in the whole body of the first particle that is not finite in the first block that has any, or of the
        first point where all particles are; infinite where all are."""
        found = sums[sums[:, NOT_FINITE] > 0, FIRST] + self._shares[0].first
        found = self._domain.joined(found)
        of_point = found % 1.0 > 0.0
        order = np.lexsort((found, of_point, found // BLOCK))
        return float(np.floor(found[order[0]])) if len(found) else np.inf
