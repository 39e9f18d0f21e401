"""Phase-field fracture (AT1, AT2): a damage d of every point, 0 intact, 1 broken, spread over a length l.

The elastic energy is split by principal strains e_a into what opens and what closes,

    psi+ = lambda/2 <tr e>^2 + mu sum <e_a>^2,   psi- = psi - psi+,   energy g psi+ + psi-,   g = (1-d)^2 (1-k) + k

(Miehe 2010), and d is the irreversible minimiser of that and of the surface energy G_c (3/8 (d/l + l |grad d|^2)) (AT1;
Pham 2011) or G_c/2 (d^2/l + l |grad d|^2) (AT2; Bourdin 2000). One Jacobi sweep a step, within the loop that finds the
deformation, with w the weights of that loop and c = dim/sum w r^2 of an interior point (grad^2 d = 2 c sum w (d_j - d_i)):

    AT1:  q = 16 psi+ l/(3 G_c),  d <- max(d, min(1, (q - 1 + b S)/(q + b D))),  b = 4 l^2 c
    AT2:  q = 2 psi+ l/G_c,       d <- max(d, min(1, (q + b S)/(1 + q + b D))),  b = 2 l^2 c,    S = sum w d_j,  D = sum w

No flux leaves at faces and notches; pairs keep no state of their own, so cracks do not follow the lattice. The sweep is
bounded: it adds no limit to the time step, but it spreads damage by about a support a step, so that fast cracks want small
steps.

Stress points have no pairs among themselves: what they see is the damage averaged to the nodes, once a step, d_j = sum_q
v_jq d_q with weights v of sum one, so that S = sum_j w_pj d_j is a sum over the points around, of positive weights, and
c = dim/sum_j w_pj sum_q v_jq |x_q - x_p|^2.

A linear elastic material takes e = U - I with F = R U (Biot), P = F sum (s_a/u_a) n_a n_a^T: forces are the gradient of the
energy at fixed damage. Any other takes its rate law: the stress that evolves is the undamaged one, e = C^-1 sigma of it,
and g sigma+ + sigma- acts. In plane (and uniaxial) stress the strain out of the plane is the one at which g sigma+ + sigma-
vanishes there: the minimum of the energy over it.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from wsph.constitutive import Laws
from wsph.contiguous import element
from wsph.errors import Refused
from wsph.neighbours import Pairs
from wsph.operators import misfit
from wsph.plugins import turns
from wsph.scene import Body, PhaseField
from wsph.space import Space, determinant_and_inverse, in_plane, principal
from wsph.state import State
from wsph.stress_state import elastic_strain, packing
from wsph.units import Scales

KEPT = 1e-6
"""The part of the opening stiffness that a broken point keeps."""
TINY = 1e-30
"""A sum of weights below which nothing is seen."""
SMALL, ITERATIONS = 0.01, 7
"""A strain below which the roots of I + 2 E are found by iteration, to rounding in so many."""
BROKEN = 0.95
"""A damage above which a point is counted as broken, and its deformation says nothing of the body's."""


@cache
def phase_struct(space: Space) -> type:
    """Struct of a phase field as kernels take it: q per psi+ and b of the sweep, the damage that the step starts from and
    what pairs see of it, psi+ of the last evaluation, shares times g, and sums of the weights."""
    real = space.scalar
    array = wp.array(dtype=real)
    annotations = {
        "per_energy": real,
        "spread": real,
        "damage": array,
        "seen": array,
        "opening": array,
        "share": array,
        "weights": array,
    }
    return wp.struct(type("Phase", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def degradation(space: Space) -> wp.Function:
    """Warp function g(d)."""
    real = space.scalar

    @wp.func
    def degraded(d: real) -> real:
        return (real(1.0) - d) * (real(1.0) - d) * real(wp.static(1.0 - KEPT)) + real(KEPT)

    return degraded


@cache
def swept(space: Space, model: str) -> wp.Function:
    """Warp function (phase, old damage, psi+, S, D) -> damage after one Jacobi sweep."""
    real, Phase = space.scalar, phase_struct(space)

    @wp.func
    def sweep(phase: Phase, old: real, opening: real, S: real, D: real) -> real:
        q = phase.per_energy * opening
        if wp.static(model == "AT1"):
            at = (q - real(1.0) + phase.spread * S) / (q + phase.spread * D)
        else:
            at = (q + phase.spread * S) / (real(1.0) + q + phase.spread * D)
        return wp.max(old, wp.min(real(1.0), at))

    return sweep


@cache
def split(space: Space, Params: type) -> wp.Function:
    """Warp function (p, principal strains, strain along each axis out of the plane) -> psi+, psi-, s+, s-, and s+, s- out of
    the plane."""
    real, vec, dim = space.scalar, space.vec, space.dim
    beyond = 3 - dim

    @wp.func
    def parted(p: Params, e: vec, out: real):
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        mu = p.elastic_shear
        trace = real(beyond) * out
        for a in range(wp.static(dim)):
            trace += e[a]
        opening = wp.max(trace, real(0.0))
        closing = wp.min(trace, real(0.0))
        out_opening = wp.max(out, real(0.0))
        out_closing = wp.min(out, real(0.0))
        plus = real(beyond) * out_opening * out_opening
        minus = real(beyond) * out_closing * out_closing
        tension = vec()
        pressure = vec()
        for a in range(wp.static(dim)):
            up = wp.max(e[a], real(0.0))
            down = wp.min(e[a], real(0.0))
            plus += up * up
            minus += down * down
            tension[a] = lame * opening + real(2.0) * mu * up
            pressure[a] = lame * closing + real(2.0) * mu * down
        return (
            real(0.5) * lame * opening * opening + mu * plus,
            real(0.5) * lame * closing * closing + mu * minus,
            tension,
            pressure,
            lame * opening + real(2.0) * mu * out_opening,
            lame * closing + real(2.0) * mu * out_closing,
        )

    return parted


@cache
def damaged(space: Space, laws: Laws, model: str) -> tuple[wp.Function, wp.Function]:
    """What a damaged point answers, and its energy.

    (p, phase, H, undamaged stress, old damage, S, D) -> (damage, psi+, g, Cauchy stress, first Piola stress), and (p, H,
    undamaged stress, damage) -> energy density: of a linear law per reference volume, of a rate law per current volume.
    """
    real, vec, mat, tensor, dim = space.scalar, space.vec, space.mat, space.tensor, space.dim
    Params, stress, Phase = laws.Params, laws.stress, phase_struct(space)
    parted, axes_of, sweep, degraded = split(space, Params), principal(space), swept(space, model), degradation(space)
    determinant, inverse = determinant_and_inverse(space)
    (unpack, pack), plane, strain_of = packing(space, laws.state), in_plane(space), elastic_strain(space, Params)
    quick, free, beyond = dim == 3 and model == "AT1", bool(laws.state.free), 3 - dim

    @wp.func
    def outward(p: Params, e: vec, g: real) -> real:
        # The strain out of the plane at which g s+ + s- vanishes there. It has the sign against that of the plane's trace,
        # and the trace of all keeps the plane's.
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        trace = real(0.0)
        for a in range(wp.static(dim)):
            trace += e[a]
        of_trace = lame
        of_out = real(2.0) * p.elastic_shear
        if trace > real(0.0):
            of_trace *= g
        else:
            of_out *= g
        return -of_trace * trace / (real(beyond) * of_trace + of_out)

    @wp.func
    def spread_out(block: mat, out: real) -> tensor:
        full = tensor()
        for a in range(3):
            full[a, a] = out
        for a in range(wp.static(dim)):
            for b in range(wp.static(dim)):
                full[a, b] = block[a, b]
        return full

    @wp.func
    def biot(H: mat):
        # From H, not from F: small strains keep their digits.
        axes, squares = axes_of(H + wp.transpose(H) + wp.transpose(H) * H)
        e = vec()
        for a in range(wp.static(dim)):
            e[a] = squares[a] / (wp.sqrt(wp.max(real(1.0) + squares[a], real(0.0))) + real(1.0))
        return axes, e

    @wp.func
    def linear(p: Params, phase: Phase, H: mat, undamaged: stress, old: real, S: real, D: real):
        # In 3D eigenvectors cost as much as all pairs. What is whole, far from damage and too little strained to break
        # needs none: e + e^2/2 = E is solved by iteration, and the energy of all of e bounds psi+.
        if wp.static(quick) and old + S == real(0.0):
            E = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
            if wp.ddot(E, E) < real(wp.static(SMALL * SMALL)):
                small = E
                for _ in range(wp.static(ITERATIONS)):
                    small = E - real(0.5) * (small * small)
                lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
                trace = wp.trace(small)
                bound = real(0.5) * wp.max(lame, real(0.0)) * trace * trace + p.elastic_shear * wp.ddot(small, small)
                if phase.per_energy * bound < real(1.0):
                    one = wp.identity(n=dim, dtype=real)
                    elastic = lame * trace * one + real(2.0) * p.elastic_shear * small
                    whole = (one + H) * (elastic * inverse(one + small))
                    kirchhoff = whole * wp.transpose(one + H)
                    return (
                        real(0.0),
                        bound,
                        real(1.0),
                        pack(spread_out(kirchhoff / determinant(one + H), real(0.0))),
                        whole,
                    )
        axes, e = biot(H)
        out = real(0.0)
        if wp.static(free):
            out = outward(p, e, degraded(old))
        opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        d = sweep(phase, old, opening, S, D)
        g = degraded(d)
        thickness = real(1.0)
        if wp.static(free):
            out = outward(p, e, g)
            opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
            thickness = wp.pow(wp.max(real(1.0) + out, real(1e-3)), real(beyond))
        scaled = mat()
        for a in range(wp.static(dim)):
            # What is turned inside out has u_a = 0 on its way: it is broken then, and kept finite.
            u = wp.max(real(1.0) + e[a], real(1e-3))
            n = vec()
            for b in range(wp.static(dim)):
                n[b] = axes[b, a]
            scaled = scaled + ((g * tension[a] + pressure[a]) / u) * wp.outer(n, n)
        F = wp.identity(n=dim, dtype=real) + H
        P = F * scaled
        J = thickness * wp.max(determinant(F), real(1e-3))
        cauchy = spread_out(P * wp.transpose(F) / J, (g * out_plus + out_minus) / J)
        return d, opening, g, pack(cauchy), P

    @wp.func
    def linear_energy(p: Params, H: mat, undamaged: stress, d: real) -> real:
        _axes, e = biot(H)
        out = real(0.0)
        if wp.static(free):
            out = outward(p, e, degraded(d))
        opening, closing, _t, _p, _o, _i = parted(p, e, out)
        return degraded(d) * opening + closing

    @wp.func
    def strained(p: Params, undamaged: stress, d: real):
        strain = strain_of(p, unpack(undamaged))
        axes, e = axes_of(plane(strain))
        out = strain[2, 2]
        if wp.static(free):
            out = outward(p, e, degraded(d))
        return axes, e, out

    @wp.func
    def evolved(p: Params, phase: Phase, H: mat, undamaged: stress, old: real, S: real, D: real):
        axes, e, out = strained(p, undamaged, old)
        opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        d = sweep(phase, old, opening, S, D)
        g = degraded(d)
        if wp.static(free):
            out = outward(p, e, g)
            opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        acting = mat()
        for a in range(wp.static(dim)):
            n = vec()
            for b in range(wp.static(dim)):
                n[b] = axes[b, a]
            acting = acting + (g * tension[a] + pressure[a]) * wp.outer(n, n)
        F = wp.identity(n=dim, dtype=real) + H
        P = mat()
        if determinant(F) > real(0.0):
            P = determinant(F) * acting * wp.transpose(inverse(F))
        return d, opening, g, pack(spread_out(acting, g * out_plus + out_minus)), P

    @wp.func
    def evolved_energy(p: Params, H: mat, undamaged: stress, d: real) -> real:
        _axes, e, out = strained(p, undamaged, d)
        opening, closing, _t, _p, _o, _i = parted(p, e, out)
        return degraded(d) * opening + closing

    return (linear, linear_energy) if laws.total is not None else (evolved, evolved_energy)


@cache
def _advance_kernel(space: Space) -> wp.Kernel:
    real, vec, mat, degraded, left_over = space.scalar, space.vec, space.mat, degradation(space), misfit(space)

    @wp.kernel(module="unique", enable_backward=False)
    def advance(first: int, volume: wp.array(dtype=real), damage: wp.array(dtype=space.vector(1)), opening: wp.array(dtype=real),
                stiffness: real, share: wp.array(dtype=real), offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                weight: wp.array(dtype=real), node: wp.array(dtype=vec), centre: wp.array(dtype=vec), mean: wp.array(dtype=vec),
                u: wp.array(dtype=vec), H: wp.array(dtype=mat), old_out: wp.array(dtype=real), opened_out: wp.array(dtype=real), released_out: wp.array(dtype=real)):  # fmt: skip
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

    return advance


@cache
def _average_kernel(space: Space) -> wp.Kernel:
    real, at = space.scalar, element(wp.int32, space.scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def seen_at_nodes(first: int, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                      damage: wp.array(dtype=real), seen_out: wp.array(dtype=real)):  # fmt: skip
        j = first + wp.tid()
        total = real(0.0)
        mean = real(0.0)
        for k in range(offsets[j], offsets[j + 1]):
            total += at(weight, k)
            mean += at(weight, k) * at(damage, at(indices, k))
        # A node that no point sees is seen by none.
        seen_out[j] = mean / wp.max(total, real(wp.static(TINY)))

    return seen_at_nodes


@dataclass(frozen=True)
class Sight:
    """What the points of a body see: their pairs, weights (sums `weights` (m,) and spreads sum w r^2 (m,)), the places of
    the nodes and of the points, displacements at the points; and where they are not the nodes, the pairs back, to points
    from nodes, with the weights in their order."""

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
        self.struct.seen = self.struct.damage
        if sight.back is not None:
            self.struct.seen = wp.zeros(sight.back.targets, dtype=real, device=device)
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
        outputs = [self.struct.damage, self._opened, self._released]
        clock.launch(_advance_kernel(self._space), len(self._volume), inputs, outputs)
        self._look(clock)

    def _look(self, clock: Any) -> None:
        """What pairs see of the damage (a launch where that is an average)."""
        back, weight = self._sight.back, self._sight.back_weight
        if back is not None:
            inputs = [back.offsets, back.indices, weight, self.struct.damage]
            clock.launch(_average_kernel(self._space), back.targets, inputs, [self.struct.seen])

    def clear(self) -> None:
        """Intact again."""
        for array in (*self.kept().values(), self.struct.seen):
            array.zero_()

    def restored(self, clock: Any) -> None:
        """After what is kept was put back."""
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
        return sum(
            a.capacity
            for a in (
                *self.kept().values(),
                self.struct.seen,
                self.struct.opening,
                self.struct.share,
                self.struct.weights,
            )
        )


def refuse(body: Body, part: PhaseField, material: Any, who: str, spacing: float, free: bool) -> None:
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
