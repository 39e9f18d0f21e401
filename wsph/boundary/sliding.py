"""Sliding particles on the device (`wsph.boundary.slide` has the rule)."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock, dt_of
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import Segments
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.carried import Carried
from wsph.boundary.loads.forces import LoadForces
from wsph.boundary.slide import Slides
from wsph.parts.works import work_and_force
from wsph.ranks.kept import Rows
from wsph.reporting import Term


@cache
def _slide_kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    dim, Rows = space.dim, _rows_struct(space)

    @kernel(ranged=True)
    def slide(
        first: int,
        particle: wp.array(dtype=wp.int32),
        left: wp.array(dtype=mat),
        given: wp.array(dtype=vec),
        fields_out: Fields,
        before_out: wp.array(dtype=vec),
    ):
        k = first + wp.tid()
        i = particle[k]
        v = fields_out.velocity[i]
        before_out[k] = v
        fields_out.velocity[i] = left[k] * v + given[i]

    @kernel(ranged=True)
    def work(
        first: int,
        clock: wp.array(dtype=wp.float64),
        step: wp.array(dtype=wp.int64),
        rows: Rows,
        before: wp.array(dtype=vec),
        fields: Fields,
        old_out: wp.array(dtype=vec),
        sums_out: wp.array2d(dtype=wp.float64),
        last_out: wp.array(dtype=wp.int64),
    ):
        r = first + wp.tid()
        v = fields.velocity[rows.particle[r]]
        push = rows.mass[r] * (rows.share[r] * (v - before[rows.place[r]]))
        sums_out[r, 0] = sums_out[r, 0] + wp.float64(real(0.5) * wp.dot(push, v + old_out[r]))
        old_out[r] = v
        for a in range(wp.static(dim)):
            force = wp.float64(push[a]) / dt_of(clock)
            # Velocities are set several times in a step: the first time of each begins anew.
            if last_out[r] == step[0]:
                force += sums_out[r, 1 + a]
            sums_out[r, 1 + a] = force
        last_out[r] = step[0]

    return slide, work


@cache
def _rows_struct(space: Space) -> type:
    """Struct of what is prescribed to sliding particles, row by row."""
    annotations = {
        "place": wp.array(dtype=wp.int32),
        "particle": wp.array(dtype=wp.int32),
        "mass": wp.array(dtype=space.scalar),
        "share": wp.array(dtype=space.mat),
    }
    return wp.struct(type("SlidingRows", (), {"__annotations__": annotations, "__module__": __name__}))


class Sliding:
    """Sliding particles on the device, k of n, nondimensional.

    _particle  # (k,) int32
    _free      # (k,) mat, I - N^+ N
    _given     # (n,) vec, N^+ g of the last time imposed
    _still     # (n,) vec, zeros in its place while the clock is still, where it has been
    _before    # (k,) vec, velocities before they were last set

    By r rows, a direction each in which a boundary prescribes the velocity of a particle that this process owns, in the
    order of the boundaries, with sums of its own, which processes that share a boundary put together:

    _rows      # place among the k, particle, mass and share (`wsph.boundary.slide`) of each
    _old       # (r,) vec, velocities at the end of the last step
    _sums      # (r, 1 + dim) float64, work of setting them so far, and the mean force of the last step
    _last      # (r,) int64, the step that it is of
    """

    _still: wp.array | None = None
    _places: wp.array | None = None
    """Where the velocities of the k stand in the buffer of a state, once they have been asked for."""

    def __init__(
        self,
        slides: Slides,
        space: Space,
        position: np.ndarray,
        mass: np.ndarray,
        units: tuple[float, float],
        arrays: Arrays,
        layout: Layout,
        share: Share,
        domain: Domain = WHOLE,
    ):
        """`units`: of velocity [m/s] and of time [s]; `share`: the particles that count."""
        self._domain = domain
        self._count = len(slides.particle)
        self._space = space
        self._slide, self._add = _slide_kernels(space, layout)
        self._particle = arrays.of("particle", slides.particle, wp.int32)
        self._free = arrays.of("free", slides.free, space.mat)
        self._given = arrays.zeros("given", len(position), space.vec, kept=True)
        self._values = LoadForces(space, slides.given, self._given, position, *units, arrays.device)
        self._before = arrays.zeros("before", self._count, space.vec)
        self._sliding = slides.particle
        size = self._count * space.dim
        self._flat = wp.zeros(0, dtype=space.scalar, device=arrays.device)
        if size:
            self._flat = wp.array(
                ptr=self._before.ptr, dtype=space.scalar, shape=size, device=arrays.device, copy=False
            )
        mine = np.flatnonzero(share.owns(slides.particle[slides.row]))
        self._segments = segments = Segments.of(slides.owner[mine], 1)
        self._known = np.unique(domain.joined(np.unique(slides.owner[mine])))
        order = mine[segments.order]
        place = slides.row[order]
        self._rows = rows = _rows_struct(space)()
        rows.place = arrays.of("place", place, wp.int32)
        rows.particle = arrays.of("rows", slides.particle[place], wp.int32)
        rows.mass = arrays.of("mass", mass[slides.particle[place]], space.scalar)
        rows.share = arrays.of("share", slides.share[order], space.mat)
        self._old = arrays.zeros("old", len(place), space.vec, kept=True)
        self._sums = arrays.zeros("sums", (segments.count, 1 + space.dim), wp.float64, kept=True)
        self._last = arrays.changes("last", wp.full(segments.count, -1, dtype=wp.int64, device=arrays.device))

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the velocities of t + c dt along the normals (launches)."""
        given = self._given
        if clock.still:
            self._still = self._still if self._still is not None else wp.zeros_like(given)
            given = self._still
        else:
            self._values.impose(clock, c)
        inputs = [self._particle, self._free, given]
        clock.launch(self._slide, self._count, inputs, [state.struct, self._before])

    def settled(self, state: State, carried: Carried, clock: Clock) -> None:
        """Take what was set in the states that this one was made from for a part of what its work is of (launches)."""
        if self._places is None:
            each = [state.index("velocity", self._sliding, a) for a in range(self._space.dim)]
            self._places = wp.array(np.stack(each, 1).ravel(), dtype=wp.int32, device=clock.device)
        carried.count(state, self._places, self._flat, clock)

    def count_work(self, state: State, clock: Clock) -> None:
        """Add the work of having set them (a launch)."""
        inputs = [clock.time, clock.counted, self._rows, self._before, state.struct]
        clock.launch(self._add, self._segments.count, inputs, [self._old, self._sums, self._last])

    def start(self, state: State) -> None:
        """Take the velocities at the start of the run."""
        self._old.assign(state.read("velocity")[self._rows.particle.numpy()])
        self._sums.zero_()
        self._last.fill_(-1)

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return float(self._segments.whole(self._sums.numpy(), self._domain).T[0].sum(dtype=np.float64))

    def terms(self, owner: int) -> dict[str, list[Term]]:
        """What the boundary of a number has of it: force and work."""
        if owner not in self._known:
            return {}
        names = work_and_force(self._space.dim)
        return self._segments.terms(owner, self._sums, names) or self._segments.none(self._sums, names)

    def rows(self, particles: Rows) -> dict[str, Rows]:
        """Where what it keeps stands in what all processes keep, by the names of its arrays; `particles`: the body's."""
        keys = self._segments.owner[:, None]
        rows = Rows.by_keys(keys, np.ones(len(keys), bool), self._domain)
        return {"given": particles, **dict.fromkeys(("old", "sums", "last"), rows)}
