"""Work of loads on a one-set body: the mean force of a step times the way in it."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share, any_of
from wsph.backend.kernels import kernel
from wsph.backend.reduce import Segments
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.parts.works import Works, work_and_force
from wsph.ranks.kept import Rows
from wsph.reporting import Term


@cache
def _work_kernel(space: Space, layout: Layout) -> wp.Kernel:
    vec, Fields, dim, Exact = space.vec, fields_struct(space, layout), space.dim, Space(space.dim).vec

    @kernel(ranged=True)
    def work(
        first: int,
        starts: wp.array(dtype=wp.int32),
        particle: wp.array(dtype=wp.int32),
        piece: wp.array(dtype=wp.int32),
        force: wp.array(dtype=vec),
        fields: Fields,
        before_out: wp.array(dtype=vec),
        place_out: wp.array(dtype=vec),
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        total = wp.float64(0.0)
        push = Exact()
        for e in range(starts[block], starts[block + 1]):
            f = force[piece[e]]
            u = fields.displacement[particle[e]]
            both = f + before_out[e]
            total += wp.float64(wp.dot(both, u - place_out[e]))
            for a in range(wp.static(dim)):
                push[a] += wp.float64(both[a])
            before_out[e] = f
            place_out[e] = u
        sums_out[block, 0] = sums_out[block, 0] + wp.float64(0.5) * total
        for a in range(wp.static(dim)):
            sums_out[block, 1 + a] = wp.float64(0.5) * push[a]

    return work


class LoadWork(Works):
    """Work of p forces on particles, those of a step's end as they stand when it is added, and what they come to, in the
    order of the boundaries: each has sums of its own, which processes that share a boundary put together. A load that does
    not change has done the work of its potential, to rounding.

    _starts    # (p + 1,) int32, where the rows begin: one a force
    _particle  # (p,) int32
    _piece     # (p,) int32, where the force stands
    _force     # forces, vec
    _before    # (p,) vec, forces at the end of the last step
    _place     # (p,) vec, displacements there
    _work      # (p, 1 + dim) float64, works so far, and the mean force of the last step
    """

    def __init__(
        self,
        particles: np.ndarray,
        pieces: np.ndarray,
        owners: np.ndarray,
        force: wp.array,
        space: Space,
        device: str,
        share: Share | None = None,
        domain: Domain = WHOLE,
    ):
        """Of the elements `pieces` (p,) of `force` on the `particles` (p,), by the boundaries `owners` (p,). `share`: the
        particles that count."""
        if share is not None:
            mine = share.owns(particles)
            particles, pieces, owners = particles[mine], pieces[mine], owners[mine]
        self._segments = segments = Segments.of(owners, 1)
        self.columns = 1 + space.dim
        super().__init__(0, any_of(domain, len(particles) > 0), device, domain)
        self._space, self._force = space, force
        self._known = np.unique(domain.joined(np.unique(owners)))
        if self._acts:
            self._work = wp.zeros((segments.count, self.columns), dtype=wp.float64, device=device)
            order = segments.order
            self._starts = wp.array(segments.starts, dtype=wp.int32, device=device)
            self._particle = wp.array(particles[order], dtype=wp.int32, device=device)
            self._piece = wp.array(pieces[order], dtype=wp.int32, device=device)
            self._before = wp.zeros(len(order), dtype=space.vec, device=device)
            self._place = wp.zeros_like(self._before)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        inputs = [self._starts, self._particle, self._piece, self._force, state.struct]
        return _work_kernel(self._space, state.layout), inputs, [self._before, self._place]

    def start(self, state: State, clock: Clock) -> None:
        if self._acts:
            self.add(state, clock)
            self.add(state, clock)  # once more, from these forces: their mean is that of the instant
            sums = self._work.numpy().copy()
            sums[:, 0] = 0.0
            self._work.assign(sums)

    def kept(self) -> dict[str, wp.array]:
        return super().kept() | ({"before": self._before, "place": self._place} if self._acts else {})

    def rows(self, share: Share) -> Rows:
        """Where its rows stand among those of all processes."""
        keys = self._segments.owner[:, None]
        return Rows.by_keys(keys, np.ones(len(keys), bool), self._domain)

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        whole = self._segments.whole(self._work.numpy(), self._domain) if self._acts else np.zeros((0, 1))
        return float(whole.T[0].sum(dtype=np.float64))

    def terms(self, owner: int) -> dict[str, list[Term]]:
        """What the boundary of a number has of it: its force and its work."""
        if not self._acts or owner not in self._known:
            return {}
        names = work_and_force(self._space.dim)
        return self._segments.terms(owner, self._work, names) or self._segments.none(self._work, names)
