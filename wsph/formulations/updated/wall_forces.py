"""Forces of walls on a body, and the work of those that are driven.

All images of one kind pull at the body with (I - S) Q, Q = sum w (A_i r + q_i) over the pairs of particles and images of the
kind: its pairs come in twos, i with the image of j and j with that of i. S = diag(+-1) is that of all its walls together, so
that a component of Q is pulled at twice, or not at all. The walls of a kind that prescribe a component share that: alike
where they move alike, and where they do not by the order in which images are made.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock, dt_of
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, totals
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.programs.prescribed import same
from wsph.boundary.walls import Wall
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.updated.images import Kind, kinds_of, seen_image
from wsph.formulations.updated.memory import memory_struct
from wsph.output.fields import AXES
from wsph.parts.terms import answers_struct, points_struct
from wsph.parts.works import PowerWorks
from wsph.reporting import Term


def shares_of(kinds: list[Kind], walls: list[Wall]) -> np.ndarray:
    """What of the component a of Q of a kind is the force of a wall, (kinds, walls, dim)."""
    dim = len(walls[0].normal)
    found = np.zeros((len(kinds), len(walls), dim))
    for row, kind in enumerate(kinds):
        for axis in range(dim):
            holding = [k for k in kind.walls if axis in walls[k].velocity]
            count = len(holding)
            alike = all(same(walls[k].velocity[axis], walls[holding[0]].velocity[axis]) for k in holding)
            for place, k in enumerate(holding):
                in_order = 2.0 * (-1.0) ** (count - 1 - place)
                found[row, k, axis] = (1.0 - (-1.0) ** count) / count if alike else in_order
    return found


@cache
def _pull_kernel(space: Space, layout: Layout, form: Form) -> wp.Kernel:
    real, vec, dim, Fields = space.scalar, space.vec, space.dim, fields_struct(space, layout)
    Coefficients, Points = coefficients_of(space, form), points_struct(space)
    Answers, Memory, imaged = answers_struct(space), memory_struct(space), seen_image(space, layout, form)
    driven = "wall_velocity" in dict(layout)

    @kernel(ranged=True)
    def wall_pull(
        first: int,
        c: Coefficients,
        points: Points,
        answers: Answers,
        memory: Memory,
        fields: Fields,
        clock: wp.array(dtype=wp.float64),
        share: wp.array2d(dtype=wp.float64),
        own: wp.vec2i,
        pull_out: wp.array2d(dtype=wp.float64),
        power_out: wp.array2d(dtype=wp.float64),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        for column in range(pull_out.shape[1]):
            pull_out[block, column] = wp.float64(0.0)
        for i in range(own[0] + block * BLOCK, wp.min(own[0] + (block + 1) * BLOCK, own[1])):
            pull = vec()
            if wp.static(form.remembers):
                pull = memory.pull[i]
            for m in range(c.images.offsets[i], c.images.offsets[i + 1]):
                _j, kind, r, w, _dv = imaged(c, real(0.0), points, fields, i, m)
                q = w * (answers.corrected[i] * r + pull)
                for a in range(wp.static(dim)):
                    pull_out[block, kind * dim + a] = pull_out[block, kind * dim + a] + wp.float64(q[a])
        if wp.static(driven):
            for column in range(power_out.shape[1]):
                a = column % dim
                force = wp.float64(0.0)
                for kind in range(share.shape[0]):
                    force += share[kind, column] * pull_out[block, kind * dim + a]
                power = force * wp.float64(fields.wall_velocity[column // dim][a])
                half = wp.float64(0.5) * dt_of(clock)
                work_out[block, column] = work_out[block, column] + half * (power + power_out[block, column])
                power_out[block, column] = power

    return wall_pull


class WallForces(PowerWorks):
    """Forces of the walls of a body on the particles that a process owns, from what forces were last computed from (`rates`
    has that), and works of the driven ones, a column for each of their components.

    _pull   # (blocks, kinds dim) float64, Q of every kind of images, nondimensional
    _share  # (kinds, columns) float64, what of a component of Q a driven wall does
    """

    def __init__(
        self, share: Share, walls: list[Wall], rates: object, space: Space, device: str, domain: Domain = WHOLE
    ):
        kinds, driven = kinds_of(walls, domain), [k for k, wall in enumerate(walls) if wall.driven]
        self.columns, self._dim = max(len(driven), 1) * space.dim, space.dim
        super().__init__(share, bool(walls), device, domain)
        self.driven, self._walls, self._kinds, self._rates = bool(driven), walls, kinds, rates
        if self._acts:
            self._all = shares_of(kinds, walls)
            of_driven = self._all[:, driven] if driven else np.zeros((len(kinds), 1, space.dim))
            self._share = wp.array(of_driven.reshape(len(kinds), -1), dtype=wp.float64, device=device)
            self._pull = wp.zeros((self._work.shape[0], len(kinds) * space.dim), dtype=wp.float64, device=device)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        rates = self._rates
        made = _pull_kernel(state.space, state.layout, rates.form)
        inputs = [*rates.wall_inputs(), state.struct, clock.time, self._share, wp.vec2i(self._low, self._n)]
        return made, inputs, [self._pull, self._power]

    def gather(self, state: State, clock: Clock) -> None:
        """Find the forces in a state that was just refreshed, where steps do not (a launch)."""
        if not self.driven:
            self.add(state, clock)

    def terms(self, owner: int) -> dict[str, list[Term]]:
        """What the boundary of a number does by walls: forces, and the work of driven ones."""
        found: dict[str, list[Term]] = {}
        driven = 0
        for k, wall in enumerate(self._walls):
            for axis in (axis for axis in wall.velocity if wall.owners.get(axis) == owner):
                found.setdefault(f"force_{AXES[axis]}", []).extend(self._force(k, axis))
                if wall.driven:
                    column, blocks = driven * self._dim + axis, self._work.shape[0]
                    found.setdefault("work", []).append(Term(self._work, column, blocks, self.columns))
            driven += wall.driven
        return found

    def _force(self, wall: int, axis: int) -> list[Term]:
        blocks, width = self._pull.shape
        shares = ((kind * self._dim + axis, self._all[kind, wall, axis]) for kind in range(len(self._kinds)))
        return [Term(self._pull, column, blocks, width, float(share)) for column, share in shares if share != 0.0]

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return float(totals(self._work, self._domain).sum()) if self._acts and self.driven else 0.0
