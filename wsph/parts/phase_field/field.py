"""Phase-field fracture (AT1, AT2): a damage d of every point, 0 intact, 1 broken, spread over a length l.

The elastic energy is split by principal strains e_a into what opens and what closes,

    psi+ = lambda/2 <tr e>^2 + mu sum <e_a>^2,   psi- = psi - psi+,   energy g psi+ + psi-,   g = (1-d)^2 (1-k) + k

(Miehe 2010), and d is the irreversible minimiser of that and of the surface energy G_c (3/8 (d/l + l |grad d|^2)) (AT1;
Pham 2011) or G_c/2 (d^2/l + l |grad d|^2) (AT2; Bourdin 2000). One Jacobi sweep a step, where the stress is found, with w
the weights of its pairs and c = dim/sum w r^2 of an interior point (grad^2 d = 2 c sum w (d_j - d_i)):

    AT1:  q = 16 psi+ l/(3 G_c),  d <- max(d, min(1, (q - 1 + b S)/(q + b D))),  b = 4 l^2 c
    AT2:  q = 2 psi+ l/G_c,       d <- max(d, min(1, (q + b S)/(1 + q + b D))),  b = 2 l^2 c,    S = sum w d_j,  D = sum w

No flux leaves at faces and notches; pairs keep no state of their own, so cracks do not follow the lattice. The sweep is
bounded: it adds no limit to the time step, but it spreads damage by about a support a step, so that fast cracks want small
steps.

Stress points have no pairs among themselves: what they see is the damage averaged to the nodes, once a step, d_j = sum_q
v_jq d_q with weights v of sum one, so that S = sum_j w_pj d_j is a sum over the points around, of positive weights, and
c = dim/sum_j w_pj sum_q v_jq |x_q - x_p|^2.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import State
from wsph.errors import Refused
from wsph.parts.phase_field.response import degradation, phase_struct
from wsph.plugins.traits import turns
from wsph.protocols import BodyKeys
from wsph.quantities import Model, in_unit
from wsph.sph.misfit import misfit
from wsph.sph.pairs import Pairs
from wsph.units import Scales


class PhaseField(Model):
    """Phase-field fracture: `fracture_energy` G_c [J/m2], `length` l [m], model "AT1" (no damage below
    a strength) or "AT2"."""

    fracture_energy: in_unit("J/m2", gt=0)
    length: in_unit("m", gt=0)
    model: Literal["AT1", "AT2"] = "AT1"


TINY = 1e-30
"""A sum of weights below which nothing is seen."""

BROKEN = 0.95
"""A damage above which a point is counted as broken, and its deformation says nothing of the body's."""


@cache
def damage_around(space: Space) -> wp.Function:
    """Warp function (phase, offsets, indices, weight, i) -> S = sum w d_j over the pairs of i. Most points have no damage in
    their sight, and their pairs are not asked."""
    real, Phase, at = space.scalar, phase_struct(space), element(wp.int32, space.scalar)

    @wp.func
    def around(phase: Phase, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real), i: int) -> real:  # fmt: skip
        S = real(0.0)
        if phase.near[i] != 0:
            k = offsets[i]
            end = offsets[i + 1]
            while k < end:
                S = S + at(weight, k) * at(phase.seen, at(indices, k))
                k += 1
        return S

    return around


@cache
def _advance_kernel(space: Space) -> wp.Kernel:
    real, vec, mat, degraded, left_over = space.scalar, space.vec, space.mat, degradation(space), misfit(space)

    @wp.kernel(module="unique", enable_backward=False)
    def advance(first: int, volume: wp.array(dtype=real), damage: wp.array(dtype=space.vector(1)), opening: wp.array(dtype=real),
                stiffness: real, share: wp.array(dtype=real), offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                weight: wp.array(dtype=real), node: wp.array(dtype=vec), centre: wp.array(dtype=vec), mean: wp.array(dtype=vec),
                u: wp.array(dtype=vec), H: wp.array(dtype=mat), old_out: wp.array(dtype=real), opened_out: wp.array(dtype=real),
                released_out: wp.array(dtype=real), reached_out: wp.array(dtype=wp.int32)):  # fmt: skip
        i = first + wp.tid()
        d = damage[i][0]
        psi = opening[i]
        old = old_out[i]
        if d > old:
            # The residual's energy is degraded with the stress.
            square = left_over(i, mean[i], centre[i], H[i], offsets, indices, weight, node, u)
            # psi as the mean of both ends: as the trapezoidal rule takes the work of the forces.
            set_free = real(0.5) * volume[i] * (psi + opened_out[i]) + real(0.5) * stiffness * share[i] * square
            released_out[i] = released_out[i] + set_free * (degraded(old) - degraded(d))
            old_out[i] = d
        opened_out[i] = psi
        if d > real(0.0):
            for k in range(offsets[i], offsets[i + 1]):
                reached_out[indices[k]] = 1

    return advance


@cache
def _average_kernel(space: Space) -> wp.Kernel:
    real, at = space.scalar, element(wp.int32, space.scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def seen_at_nodes(first: int, reached: wp.array(dtype=wp.int32), offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                      weight: wp.array(dtype=real), damage: wp.array(dtype=real), seen_out: wp.array(dtype=real),
                      near_out: wp.array(dtype=wp.int32)):  # fmt: skip
        j = first + wp.tid()
        if reached[j] == 0:
            return
        total = real(0.0)
        mean = real(0.0)
        for k in range(offsets[j], offsets[j + 1]):
            q = at(indices, k)
            total += at(weight, k)
            mean += at(weight, k) * at(damage, q)
            near_out[q] = 1
        if total > real(0.0):
            seen_out[j] = mean / total

    return seen_at_nodes


@dataclass(frozen=True)
class Sight:
    """What the points of a body see: their pairs, weights and spreads sum w r^2 (m,), the places of the nodes and of the
    points, displacements at the points; and where they are not the nodes, the pairs back, to points from nodes, with the
    weights in their order."""

    pairs: Pairs
    weight: wp.array
    spread: np.ndarray
    node: wp.array
    centre: wp.array
    mean: wp.array
    back: Pairs | None = None
    back_weight: wp.array | None = None

    def averaged(self, values: np.ndarray) -> np.ndarray:
        """What pairs see of values at the points, (m, ...) to (n, ...)."""
        if self.back is None or self.back_weight is None:
            return values
        weight, rows, points = self.back_weight.numpy().astype(float), self.back.rows(), self.back.indices.numpy()
        total = np.maximum(np.bincount(rows, weight, self.back.targets), TINY)
        flat = values.reshape(len(values), -1)
        sums = [np.bincount(rows, weight * column[points], self.back.targets) / total for column in flat.T]
        return np.stack(sums, 1).reshape(-1, *values.shape[1:])

    def squares(self, values: np.ndarray) -> np.ndarray:
        """Sum of w times the mean square of what a pair sees of `values` (m, k) less the point's own, (m,)."""
        indices, rows, weight = self.pairs.indices.numpy(), self.pairs.rows(), self.weight.numpy().astype(float)
        first, second = self.averaged(values), self.averaged((values**2).sum(1))
        own = values[rows]
        each = second[indices] - 2.0 * (first[indices] * own).sum(1) + (own**2).sum(1)
        return np.bincount(rows, weight * each, len(values))


class PhaseDamage:
    """The phase field of a body. `struct` goes to the kernels; `advance` makes the damage of the last evaluation that of
    the step to come, and counts the energy that it released."""

    def __init__(self, part: PhaseField, space: Space, scales: Scales, sight: Sight, share: wp.array, volume: np.ndarray,
                 state: State, stiffness: float, device: str):  # fmt: skip
        """`share` and `volume` (m,) and `stiffness` (of the residual) nondimensional; evaluations write the damage to
        `state`."""
        self.part, self._space, self._state, self._sight = part, space, state, sight
        self._stiffness = space.scalar(stiffness)
        self._share = share
        real, n = space.scalar, len(volume)
        self._volume = wp.array(volume, dtype=real, device=device)
        self.toughness = part.fracture_energy / (scales.stress * scales.length)
        self.length = part.length / scales.length
        # Of points inside: those at faces and notches see less.
        spread = sight.spread
        if sight.back is not None:
            spread = sight.squares(sight.centre.numpy().astype(float))
        self.laplacian = space.dim / float(np.median(spread[spread > 0.999 * np.quantile(spread, 0.9)]))
        first = part.model == "AT1"
        self.struct = phase_struct(space)()
        self.struct.per_energy = real((16.0 / 3.0 if first else 2.0) * self.length / self.toughness)
        self.struct.spread = real((4.0 if first else 2.0) * self.length**2 * self.laplacian)
        for name in ("damage", "opening"):
            setattr(self.struct, name, wp.zeros(n, dtype=real, device=device))
        self.struct.near = wp.zeros(n, dtype=wp.int32, device=device)
        self.struct.seen, self._reached = self.struct.damage, self.struct.near
        if sight.back is not None:
            self.struct.seen = wp.zeros(sight.back.targets, dtype=real, device=device)
            self._reached = wp.zeros(sight.back.targets, dtype=wp.int32, device=device)
        sums = np.bincount(sight.pairs.rows(), sight.weight.numpy().astype(float), n)
        self.struct.weights = wp.array(sums, dtype=real, device=device)
        self.struct.share = wp.clone(share)
        self._opened = wp.zeros(n, dtype=real, device=device)
        self._released = wp.zeros(n, dtype=real, device=device)

    def advance(self, clock: Any) -> None:
        """Close a step (a launch)."""
        state, sight = self._state.struct, self._sight
        mean = sight.mean if sight.back is not None else state.displacement
        inputs = [self._volume, state.damage, self.struct.opening, self._stiffness, self._share, sight.pairs.offsets]
        inputs += [
            sight.pairs.indices,
            sight.weight,
            sight.node,
            sight.centre,
            mean,
            state.displacement,
            state.deformation,
        ]
        outputs = [self.struct.damage, self._opened, self._released, self._reached]
        clock.launch(_advance_kernel(self._space), len(self._volume), inputs, outputs)
        self._look(clock)

    def _look(self, clock: Any) -> None:
        """What pairs see of the damage (a launch where that is an average)."""
        back, weight = self._sight.back, self._sight.back_weight
        if back is not None:
            inputs = [self._reached, back.offsets, back.indices, weight, self.struct.damage]
            clock.launch(_average_kernel(self._space), back.targets, inputs, [self.struct.seen, self.struct.near])

    def clear(self) -> None:
        """Intact again."""
        for array in (*self.kept().values(), self.struct.seen, self.struct.near, self._reached):
            array.zero_()

    def restored(self, clock: Any) -> None:
        """After a damage was put in place: what sees it."""
        pairs, reached = self._sight.pairs, self._reached.numpy()
        reached[pairs.indices.numpy()[self.struct.damage.numpy()[pairs.rows()] > 0.0]] = 1
        self._reached.assign(reached)
        self._look(clock)

    def kept(self) -> dict[str, wp.array]:
        """What a checkpoint holds of it."""
        return {"damage": self.struct.damage, "opened": self._opened, "released": self._released}

    @property
    def released(self) -> float:
        """Elastic energy that damage has set free so far, nondimensional."""
        return float(self._released.numpy().sum(dtype=float))

    def found(self) -> dict[str, float]:
        """The energy of the crack surfaces by the model's own functional, nondimensional, and points beyond BROKEN."""
        broken = int((self.struct.damage.numpy() > BROKEN).sum())
        return {"surface_energy": self._surface_energy(), "broken": broken}

    def _surface_energy(self) -> float:
        d = self.struct.damage.numpy().astype(float)
        volume = self._volume.numpy().astype(float)
        gradient = self.laplacian * self._sight.squares(d[:, None]) * self.length
        if self.part.model == "AT1":
            return float(0.375 * self.toughness * volume @ (d / self.length + gradient))
        return float(0.5 * self.toughness * volume @ (d * d / self.length + gradient))

    @property
    def nbytes(self) -> int:
        """Device memory [bytes]."""
        of = self.struct
        arrays = [*self.kept().values(), of.opening, of.share, of.weights, of.near]
        if self._sight.back is not None:
            arrays += [of.seen, self._reached]
        return sum(a.capacity for a in arrays)


def refuse(body: BodyKeys, part: PhaseField, material: Any, who: str, spacing: float, free: bool) -> None:
    """Refuse what a phase field cannot do."""
    if body.map is not None:
        raise Refused(f"body {body.name!r}: phase_field needs a lattice of one spacing, without `map`: leave one out")
    bulk, shear = material.moduli()
    if free and bulk < 2.0 / 3.0 * shear:
        raise Refused(
            f"body {body.name!r}: with a Poisson ratio below zero phase_field finds no strain out of a plane of zero stress: use"
            ' state = "strain" (or 3D)'
        )
    if not (getattr(material, "linear", False) or turns(material)):
        raise Refused(
            f"body {body.name!r}: phase_field splits the energy of linear elasticity or the stress of a rate law that turns with"
            f" the body; {who} is neither: use elastic or jaumann"
        )
    if part.length < spacing:
        raise Refused(
            f"body {body.name!r}: phase_field.length = {part.length:g} m is below the spacing, {spacing:g} m: a crack would not be"
            f" resolved; use at least {1.5 * spacing:g} m"
        )
