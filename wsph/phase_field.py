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
from wsph.space import Space, determinant_and_inverse, in_plane, spectral
from wsph.state import State
from wsph.stress_state import elastic_strain, packing
from wsph.units import Scales

KEPT = 1e-6
"""The part of the opening stiffness that a broken point keeps."""
TINY = 1e-30
"""A sum of weights below which nothing is seen."""
SMALL = 0.01
ROOT_SERIES = (1.0, -1 / 2, 1 / 2, -5 / 8, 7 / 8, -21 / 16, 33 / 16, -429 / 128)
INVERSE_SERIES = (1.0, -3 / 2, 5 / 2, -35 / 8, 63 / 8, -231 / 16, 429 / 16, -6435 / 128)
"""sqrt(1 + 2 E) - 1 and 1 - 1/sqrt(1 + 2 E) by powers of E, to rounding where E is below SMALL."""
BROKEN = 0.95
"""A damage above which a point is counted as broken, and its deformation says nothing of the body's."""


@cache
def phase_struct(space: Space) -> type:
    """Struct of a phase field as kernels take it: q per psi+ and b of the sweep, the damage that the step starts from and
    what pairs see of it, which points have damage in their sight, psi+ of the last evaluation, shares times g, and sums of
    the weights."""
    real = space.scalar
    array = wp.array(dtype=real)
    annotations = {
        "per_energy": real,
        "spread": real,
        "damage": array,
        "seen": array,
        "near": wp.array(dtype=wp.int32),
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
def shrinkage(space: Space) -> wp.Function:
    """Warp function H -> (I - U^-1, tr e, a bound of e : e, whether they are known), U = I + e = sqrt(F^T F), without axes.

    In 2D U = (C + J I)/sqrt(tr C + 2 J), of what is not turned inside out; in 3D, for strains below SMALL, the series of the
    roots, whose powers Cayley and Hamilton bring back to I, E and E^2. Differences from I are taken where they are small.
    """
    real, mat, dim = space.scalar, space.mat, space.dim
    roots, inverses = (wp.types.vector(length=len(c), dtype=real)(*c) for c in (ROOT_SERIES, INVERSE_SERIES))
    if dim == 2:

        @wp.func
        def in_two(H: mat):
            G = H + wp.transpose(H) + wp.transpose(H) * H
            change = wp.trace(H) + wp.determinant(H)  # J - 1
            if not (change > real(-0.9)):
                return mat(), real(0.0), real(0.0), False
            square = wp.trace(G) + real(2.0) * change
            s = wp.sqrt(real(4.0) + square)
            e = (G + (change - square / (s + real(2.0))) * wp.identity(n=dim, dtype=real)) / s
            trace = wp.trace(e)
            m = (e + (change - trace) * wp.identity(n=dim, dtype=real)) / (real(1.0) + change)
            return m, trace, wp.ddot(e, e), True

        return in_two

    @wp.func
    def in_space(H: mat):
        E = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
        square = wp.ddot(E, E)
        if not (square < real(wp.static(SMALL * SMALL))):
            return mat(), real(0.0), real(0.0), False
        first = wp.trace(E)
        second = real(0.5) * (first * first - square)
        third = wp.determinant(E)
        a = real(0.0)
        b = real(0.0)
        c = real(0.0)
        x = real(0.0)
        y = real(0.0)
        z = real(0.0)
        for n in range(wp.static(len(ROOT_SERIES))):
            k = wp.static(len(ROOT_SERIES) - 1) - n
            # Horner: (a I + b E + c E^2) E = c I3 I + (a - c I2) E + (b + c I1) E^2
            old = a + inverses[k]
            grown = b + c * first
            b = old - c * second
            a = c * third
            c = grown
            old = x + roots[k]
            grown = y + z * first
            y = old - z * second
            x = z * third
            z = grown
        m = a * wp.identity(n=3, dtype=real) + b * E + c * (E * E)
        return m, real(3.0) * x + y * first + z * square, real(wp.static(1.0 + 3.0 * SMALL)) * square, True

    return in_space


@cache
def damaged(space: Space, laws: Laws, model: str) -> tuple[wp.Function, wp.Function]:
    """What a damaged point answers, and its energy.

    (p, phase, H, undamaged stress, old damage, S, D) -> (damage, psi+, g, Cauchy stress, first Piola stress), and (p, H,
    undamaged stress, damage) -> energy density: of a linear law per reference volume, of a rate law per current volume.
    """
    real, vec, mat, tensor, dim = space.scalar, space.vec, space.mat, space.tensor, space.dim
    Params, stress, Phase = laws.Params, laws.stress, phase_struct(space)
    parted, (axes_of, sum_of), shrunk = split(space, Params), spectral(space), shrinkage(space)
    sweep, degraded = swept(space, model), degradation(space)
    determinant, inverse = determinant_and_inverse(space)
    (unpack, pack), plane, strain_of = packing(space, laws.state), in_plane(space), elastic_strain(space, Params)
    quick, free, beyond = dim > 1 and model == "AT1", bool(laws.state.free), 3 - dim

    @wp.func
    def thick(out: real) -> real:
        # How much thicker a free plane has become.
        if wp.static(free):
            return wp.pow(wp.max(real(1.0) + out, real(1e-3)), real(beyond))
        return real(1.0)

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
    def intact(p: Params, phase: Phase, H: mat, damage: real):
        # What is whole, far from damage and too little strained to break needs no axes: the energy of all of e bounds psi+.
        m, trace, squares, known = shrunk(H)
        if damage > real(0.0) or not known:
            return False, real(0.0), stress(), mat()
        one = wp.identity(n=dim, dtype=real)
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        out = real(0.0)
        if wp.static(free):
            out = -lame * trace / (real(beyond) * lame + real(2.0) * p.elastic_shear)
            trace += real(beyond) * out
            squares += real(beyond) * out * out
        bound = real(0.5) * wp.max(lame, real(0.0)) * trace * trace + p.elastic_shear * squares
        # (lambda tr e + 2 mu e) U^-1
        P = (one + H) * (lame * trace * one + (real(2.0) * p.elastic_shear - lame * trace) * m)
        J = thick(out) * determinant(one + H)
        across = lame * trace + real(2.0) * p.elastic_shear * out
        cauchy = pack(spread_out(P * wp.transpose(one + H) / J, across / J))
        return phase.per_energy * bound < real(1.0), bound, cauchy, P

    @wp.func
    def linear(p: Params, phase: Phase, H: mat, undamaged: stress, old: real, S: real, D: real):
        if wp.static(quick):
            whole, bound, elastic, first = intact(p, phase, H, old + S)
            if whole:
                return real(0.0), bound, real(1.0), elastic, first
        one = wp.identity(n=dim, dtype=real)
        axes, e = biot(H)
        out = real(0.0)
        if wp.static(free):
            out = outward(p, e, degraded(old))
        opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        d = sweep(phase, old, opening, S, D)
        g = degraded(d)
        if wp.static(free):
            out = outward(p, e, g)
            opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        each = vec()
        for a in range(wp.static(dim)):
            # What is turned inside out has u_a = 0 on its way: it is broken then, and kept finite.
            each[a] = (g * tension[a] + pressure[a]) / wp.max(real(1.0) + e[a], real(1e-3))
        P = (one + H) * sum_of(axes, each)
        J = thick(out) * wp.max(determinant(one + H), real(1e-3))
        cauchy = spread_out(P * wp.transpose(one + H) / J, (g * out_plus + out_minus) / J)
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
        F = wp.identity(n=dim, dtype=real) + H
        back = mat()
        if determinant(F) > real(0.0):
            back = determinant(F) * wp.transpose(inverse(F))
        if wp.static(model == "AT1") and old + S == real(0.0):
            # The stress that evolves is the one that acts.
            strain = strain_of(p, unpack(undamaged))
            lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
            bound = real(0.5) * wp.max(lame, real(0.0)) * wp.trace(strain) * wp.trace(
                strain
            ) + p.elastic_shear * wp.ddot(strain, strain)
            if phase.per_energy * bound < real(1.0):
                return real(0.0), bound, real(1.0), undamaged, plane(unpack(undamaged)) * back
        axes, e, out = strained(p, undamaged, old)
        opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        d = sweep(phase, old, opening, S, D)
        g = degraded(d)
        if wp.static(free):
            out = outward(p, e, g)
            opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        acting = sum_of(axes, g * tension + pressure)
        return d, opening, g, pack(spread_out(acting, g * out_plus + out_minus)), acting * back

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
        seen_out[j] = mean / total

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
