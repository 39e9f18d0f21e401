"""Springs and dashpots between particles and the ground, on the device: forces -K u and -C v, K and C symmetric matrices of
the area that each particle stands for.

Springs store u.K u/2, which the ledger counts as strain. Dashpots resist: integrators sum up what they change of the
velocities, so that what they dissipate is exact however long the step is beside the time in which they act.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock, dt_of
from wsph.backend.kernels import kernel
from wsph.backend.reduce import totals
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.acting import ActingLoad
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.output.fields import AXES
from wsph.protocols import Entry
from wsph.ranks.kept import Rows
from wsph.reporting import Term


@cache
def _kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    dim = space.dim

    @kernel(ranged=True)
    def pull(
        first: int,
        particle: wp.array(dtype=wp.int32),
        matrix: wp.array(dtype=mat),
        field: wp.array(dtype=vec),
        force_out: wp.array(dtype=vec),
    ):
        k = first + wp.tid()
        i = particle[k]
        force_out[i] = force_out[i] - matrix[k] * field[i]

    @kernel(ranged=True)
    def close(
        first: int,
        clock: wp.array(dtype=wp.float64),
        own: wp.array(dtype=wp.int32),
        particle: wp.array(dtype=wp.int32),
        stiffness: wp.array(dtype=mat),
        damping: wp.array(dtype=mat),
        fields: Fields,
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        row = first + wp.tid()
        k = own[row]
        f = vec()
        stored = wp.float64(0.0)
        power = wp.float64(0.0)
        if stiffness.shape[0] > 0:
            u = fields.displacement[particle[k]]
            f -= stiffness[k] * u
            stored -= wp.float64(real(0.5) * wp.dot(u, f))
        if damping.shape[0] > 0:
            v = fields.velocity[particle[k]]
            drag = damping[k] * v
            f -= drag
            power += wp.float64(wp.dot(v, drag))
        sums_out[row, 0] = stored
        half = wp.float64(0.5) * dt_of(clock)
        sums_out[row, 1] = sums_out[row, 1] + half * (power + sums_out[row, 2])
        sums_out[row, 2] = power
        for a in range(wp.static(dim)):
            push = wp.float64(f[a])
            sums_out[row, 3 + a] = wp.float64(0.5) * (push + sums_out[row, 3 + dim + a])
            sums_out[row, 3 + dim + a] = push

    return pull, close


class Ground(ActingLoad):
    """Springs and dashpots of k particles, nondimensional.

    _particle   # (k,) int32
    _stiffness  # (k,) mat, where there are springs
    _damping    # (k,) mat, where there are dashpots
    _own        # (o,) int32, those that this process owns, whose works count
    _sums       # (o, 3 + 2 dim) float64: energy stored, work and power of dashpots, and the forces, the mean of the last
                # step and those at its end; processes that share a boundary put them together
    """

    def __init__(
        self,
        faces: LoadedFaces,
        stiffness: np.ndarray | None,
        damping: np.ndarray | None,
        space: Space,
        clock: Clock,
        arrays: Arrays,
    ):
        """Of the particles of some faces (k,), with matrices (k, dim, dim)."""
        self._space, self._clock, self._count = space, clock, len(faces.particle)
        self._domain, self._rows = faces.domain, faces.own_rows
        self._particle = arrays.of("particle", faces.particle, wp.int32)
        own = np.flatnonzero(faces.own)
        self._own = arrays.of("own", own, wp.int32)
        self._stiffness = self._damping = None
        self._none = wp.zeros(0, dtype=space.mat, device=arrays.device)
        if damping is not None:
            self._damping = arrays.of("damping", damping, space.mat)
        if stiffness is not None:
            self._stiffness = arrays.of("stiffness", stiffness, space.mat)
            self.ledger = (Entry("strain", lambda: float(totals(self._sums, self._domain)[0])),)
        rows, width, dim = len(own), 3 + 2 * space.dim, space.dim
        self._sums = arrays.zeros("sums", (rows, width), wp.float64, kept=True)
        taken = [Term(self._sums, column, rows, width, -1.0) for column in (0, 1)]
        forces = {f"force_{AXES[a]}": [Term(self._sums, 3 + a, rows, width)] for a in range(dim)}
        self.numbers = {**forces, "work": taken}

    def rows(self) -> dict[str, Rows]:
        return {"sums": self._rows}

    def act(self, state: State, forces: wp.array) -> None:
        if self._stiffness is not None:
            pull, _ = _kernels(self._space, state.layout)
            inputs = [self._particle, self._stiffness, state.struct.displacement]
            self._clock.launch(pull, self._count, inputs, [forces])

    def resist(self, state: State, drags: wp.array) -> None:
        if self._damping is not None:
            pull, _ = _kernels(self._space, state.layout)
            inputs = [self._particle, self._damping, state.struct.velocity]
            self._clock.launch(pull, self._count, inputs, [drags])

    def start(self, state: State) -> None:
        for _ in range(2):  # from what there is at the start, the mean is that
            self.advance(state)
        sums = self._sums.numpy().copy()
        sums[:, 1] = 0.0
        self._sums.assign(sums)

    def advance(self, state: State) -> None:
        _, close = _kernels(self._space, state.layout)
        # In a relaxation nothing resists.
        damping = None if self._clock.still else self._damping
        matrices = [each if each is not None else self._none for each in (self._stiffness, damping)]
        inputs = [self._clock.time, self._own, self._particle, *matrices, state.struct]
        self._clock.launch(close, len(self._sums), inputs, [self._sums])
