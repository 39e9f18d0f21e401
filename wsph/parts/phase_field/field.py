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
c = dim/sum_j w_pj sum_q v_jq |x_q - x_p|^2; where cells differ, of each point (`wsph.parts.phase_field.sight`).
"""

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.constitutive.evolution import thickness
from wsph.constitutive.laws import Laws
from wsph.parts.part import BROKEN, Attached, Neighbourhood
from wsph.parts.phase_field.response import left_of_law
from wsph.parts.phase_field.sums import squares
from wsph.parts.phase_field.sweep import degradation, phase_struct
from wsph.parts.terms import points_struct
from wsph.protocols import Entry
from wsph.ranks.blocks import own_sum
from wsph.ranks.kept import Rows
from wsph.sph.misfit import misfit
from wsph.sph.rows import rows_of, rows_struct


@cache
def _damage_around(space: Space) -> wp.Function:
    """Warp function (phase, rows, i) -> S = sum w d_j over the pairs of i. Most points have no damage in their sight, and
    their pairs are not asked."""
    real, Phase, Rows, at = space.scalar, phase_struct(space), rows_struct(space), element(wp.int32, space.scalar)

    @wp.func
    def around(phase: Phase, rows: Rows, i: int) -> real:
        S = real(0.0)
        if phase.near[i] != 0:
            k = rows.offsets[i]
            end = rows.offsets[i + 1]
            while k < end:
                S = S + at(rows.weight, k) * at(phase.seen, at(rows.indices, k))
                k += 1
        return S

    return around


@cache
def respond(model: str, graded: bool) -> Callable[[Space, Laws, Layout], wp.Function]:
    """The answer of a point (`wsph.parts.terms.Response`). `graded`: points differ in the numbers of their Laplacian."""

    def make(space: Space, laws: Laws, layout: Layout) -> wp.Function:
        real, mat, Params = space.scalar, space.mat, laws.Params
        Phase, Rows, Fields = phase_struct(space), rows_struct(space), fields_struct(space, layout)
        around, answer, apart = _damage_around(space), left_of_law(space, laws, model), laws.total is None
        thick, thins = thickness(space, laws), laws.kept.thinning >= 0

        @wp.func
        def responded(p: Params, phase_out: Phase, rows: Rows, fields_out: Fields, share: real, H: mat, i: int):
            S = around(phase_out, rows, i)
            if wp.static(graded):
                S = phase_out.weights[i] * S
            d, opening, g, s, P = answer(
                p, phase_out, H, fields_out.stress[i], phase_out.damage[i], S, phase_out.weights[i]
            )
            fields_out.damage[i][0] = d
            phase_out.opening[i] = opening
            left = g * share
            phase_out.share[i] = left
            if wp.static(thins):
                P = thick(fields_out.internals[i]) * P
            if wp.static(apart):
                fields_out.damaged_stress[i] = s
            else:
                fields_out.stress[i] = s
            return left, P

        return responded

    return make


@cache
def _advance_kernel(space: Space, layout: Layout, apart: bool) -> wp.Kernel:
    """The damage of the last evaluation becomes that of the step to come; `apart`: points have places of their own."""
    real, vec = space.scalar, space.vec
    degraded, left_over = degradation(space), misfit(space)
    Phase, Rows, Points, Fields = (
        phase_struct(space),
        rows_struct(space),
        points_struct(space),
        fields_struct(space, layout),
    )

    @kernel(ranged=True)
    def advance(
        first: int,
        rows: Rows,
        points: Points,
        mean: wp.array(dtype=vec),
        fields: Fields,
        phase_out: Phase,
        opened_out: wp.array(dtype=real),
        released_out: wp.array(dtype=real),
        reached_out: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        d = fields.damage[i][0]
        psi = phase_out.opening[i]
        old = phase_out.damage[i]
        if d > old:
            # The residual's energy is degraded with the stress.
            u = vec()
            if wp.static(apart):
                u = mean[i]
            else:
                u = fields.displacement[i]
            square = left_over(i, u, points.centre[i], fields.deformation[i], rows, points.node, fields.displacement)
            # psi as the mean of both ends: as the trapezoidal rule takes the work of the forces.
            set_free = (
                real(0.5) * points.volume[i] * (psi + opened_out[i])
                + real(0.5) * points.stabilisation * points.share[i] * square
            )
            released_out[i] = released_out[i] + set_free * (degraded(old) - degraded(d))
            phase_out.damage[i] = d
        opened_out[i] = psi
        if d > real(0.0):
            for k in range(rows.offsets[i], rows.offsets[i + 1]):
                reached_out[rows.indices[k]] = 1

    return advance


@cache
def _average_kernel(space: Space) -> wp.Kernel:
    """Kernel of the damage averaged from points to particles, over the particles that see any."""
    real, at, Rows = space.scalar, element(wp.int32, space.scalar), rows_struct(space)

    @kernel(ranged=True)
    def seen_at_nodes(
        first: int,
        reached: wp.array(dtype=wp.int32),
        rows: Rows,
        damage: wp.array(dtype=real),
        seen_out: wp.array(dtype=real),
        near_out: wp.array(dtype=wp.int32),
    ):
        j = first + wp.tid()
        if reached[j] == 0:
            return
        total = real(0.0)
        mean = real(0.0)
        for k in range(rows.offsets[j], rows.offsets[j + 1]):
            q = at(rows.indices, k)
            total += at(rows.weight, k)
            mean += at(rows.weight, k) * at(damage, q)
            near_out[q] = 1
        if total > real(0.0):
            seen_out[j] = mean / total

    return seen_at_nodes


class PhaseDamage(Attached):
    """The phase field of a body: `advance` makes the damage of the last evaluation that of the step to come, and counts the
    energy that it set free."""

    def __init__(
        self,
        model: str,
        toughness: float,
        length: float,
        space: Space,
        seen: Neighbourhood,
        state: State,
        clock: Clock,
        arrays: Arrays,
        laplacian: np.ndarray | None = None,
    ):
        """`toughness` and `length` nondimensional, and so is `laplacian`, c of each point here (m,), where cells
        differ; evaluations write the damage to `state`. Beside `phase` the device has

        _reached   # places that pairs see and that have damage, int32: (m,) points or (n,) nodes
        _opened    # psi+ of every point at the end of the last step, (m,), nondimensional
        _released  # energy set free so far, (m,), nondimensional
        """
        self.model, self.toughness, self.length = model, toughness, length
        self._space, self._seen, self._state, self._clock = space, seen, state, clock
        real, n = space.scalar, len(seen.volume)
        self._domain, self._points = seen.split.domain, seen.split.points
        # Pairs of copies see places that nobody here has: they are told what is seen there.
        self._halo = self._domain.halo(self._points if seen.back is None else seen.split.particles)
        self.laplacian = self._alike() if laplacian is None else laplacian
        scale = self._mean(self.laplacian)
        first = model == "AT1"
        phase = phase_struct(space)()
        phase.per_energy = real((16.0 / 3.0 if first else 2.0) * length / toughness)
        phase.spread = real((4.0 if first else 2.0) * length**2 * scale)
        phase.damage = arrays.zeros("damage", n, real, kept=True)
        phase.opening = arrays.zeros("opening", n, real)
        phase.near = arrays.zeros("near", n, wp.int32)
        phase.seen, self._reached = phase.damage, phase.near
        if seen.back is not None:
            phase.seen = arrays.zeros("seen", seen.back.targets, real)
            self._reached = arrays.zeros("reached", seen.back.targets, wp.int32)
        sums = np.bincount(seen.pairs.rows(), seen.weight.numpy().astype(float), n)
        # Sums of weights over points' own c have that of a point over the mean one in them.
        phase.weights = arrays.of("weights", sums * (self.laplacian / scale), real)
        self.share = phase.share = arrays.take("share", wp.clone(seen.points.share))
        self._opened = arrays.zeros("opened", n, real, kept=True)
        self._released = arrays.zeros("released", n, real, kept=True)
        self.response = self._phase = phase
        self.damage = phase.damage
        self._rows = rows_of(space, seen.pairs, seen.weight)
        self.ledger = (Entry("dissipated", lambda: self.released),)

    def _mean(self, numbers: float | np.ndarray) -> float:
        """The mean over all points of the body of numbers (m,) of those here, or of one that all have."""
        if isinstance(numbers, float):
            return numbers
        return own_sum(numbers, self._points, self._domain) / self._points.whole

    def _alike(self) -> float:
        """c of points inside: those at faces and notches see less."""
        seen = self._seen
        split = seen.split
        spread = (
            seen.spread if seen.back is None else squares(seen, seen.points.centre.numpy().astype(float), self._halo)
        )
        whole = split.domain.gathered(spread[split.points.own])
        most = split.domain.told(lambda: float(np.median(whole[whole > 0.999 * np.quantile(whole, 0.9)])))
        return self._space.dim / most

    def advance(self) -> None:
        """Close a step (launches)."""
        kernel = _advance_kernel(self._space, self._state.layout, self._seen.back is not None)
        inputs = [self._rows, self._seen.points, self._seen.mean, self._state.struct]
        outputs = [self._phase, self._opened, self._released, self._reached]
        self._clock.launch(kernel, len(self._seen.volume), inputs, outputs)
        self._look()

    def _look(self) -> None:
        """Update the damage that pairs see (a launch where it is averaged to the nodes)."""
        back, together = self._seen.back, self._domain.size > 1
        if together:
            self._clock.host(partial(self._halo.update, self._reached))
        if back is not None:
            inputs = [self._reached, rows_of(self._space, back, self._seen.back_weight), self._phase.damage]
            self._clock.launch(_average_kernel(self._space), back.targets, inputs, [self._phase.seen, self._phase.near])
        if together:
            self._clock.host(partial(self._halo.update, self._phase.seen))

    def rows(self) -> dict[str, Rows]:
        points, _ = self._seen.split.rows()
        return dict.fromkeys(("damage", "opened", "released"), points)

    def restored(self) -> None:
        """Mark the places that see the damage, after it has been put in place."""
        pairs, reached = self._seen.pairs, self._reached.numpy()
        reached[pairs.indices.numpy()[self._phase.damage.numpy()[pairs.rows()] > 0.0]] = 1
        self._reached.assign(reached)
        self._look()

    @property
    def released(self) -> float:
        """Elastic energy that damage has set free so far, nondimensional."""
        return own_sum(self._released.numpy(), self._points, self._domain)

    def fracture(self) -> dict[str, float]:
        """The energy of the crack surfaces by the model's own functional, nondimensional, and points beyond BROKEN."""
        broken = int(self._domain.sum(np.array((self._phase.damage.numpy()[self._points.own] > BROKEN).sum())))
        return {"surface_energy": self._surface_energy(), "broken": broken, "released_energy": self.released}

    def _surface_energy(self) -> float:
        d, volume = self._phase.damage.numpy().astype(float), self._seen.points.volume.numpy().astype(float)
        gradient = self.laplacian * squares(self._seen, d[:, None], self._halo) * self.length
        first = self.model == "AT1"
        each = volume * ((d if first else d * d) / self.length + gradient)
        return (0.375 if first else 0.5) * self.toughness * own_sum(each, self._points, self._domain)
