"""What right-hand sides by blocks of rows have in common: one body, whose kernels take their rows from a table of blocks."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Iterable, Sequence

import warp as wp

from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.backend.threads import cores
from wsph.formulations.one_set_rates import ReferenceRates
from wsph.formulations.one_set_setup import RateSetup
from wsph.parts.part import Attached, Host, Neighbourhood, Part

WIDTH = {"f64": 16, "f32": 32}
"""Rows of a block on a CPU, by precision."""

PIECE_BYTES = 2**18
"""What the rows of a piece of a body pass on to the next loop, at once: a part of the cache of a core."""


def answers_apart(part: Part, host: Host) -> bool:
    """Whether a part has something of its own at every point, or changes what the law answers there."""
    return part.attaches or part.stress_term(host) is not None or part.response(host) is not None


def width_of(device: str, precision: str) -> int:
    """Rows that a thread computes on a device."""
    return 1 if wp.get_device(device).is_cuda else WIDTH[precision]


class BlockRates(ReferenceRates):
    """The right-hand sides of one body by `threads` a block."""

    seen: Neighbourhood | None = None
    """It has no list of pairs."""

    def __init__(self, made: RateSetup, threads: int):
        host = self._host = made.host
        self._space, self._clock, self._density = host.space, made.setup.clock, host.space.scalar(made.density)
        self._placement, self._constitutive, self._loads = made.placement, host.constitutive, made.loads
        self._force, self._arrays, self._layout = made.force, made.arrays.part("rates"), made.layout
        self._domain = made.domain
        self.form = made.form(loaded=made.loads.some)
        self._coefficients, self._threads = made.coefficients(self.form), threads
        self._cores = made.setup.scene.run.threads or len(cores())

    def attach(self, parts: Iterable[Attached]) -> None:
        """No part changes what rows have in common."""

    def refresh(self, state: State) -> None:
        """Deformation and, of a total law, stress of a state from its displacement (launches)."""
        raise NotImplementedError

    def _sum_forces(self, body: object, loads: list[Array], state: State, out: State) -> None:
        """Accelerations from the answers of the points, under loads (launches)."""
        raise NotImplementedError

    def _find_forces(self, state: State, out: State) -> None:
        self._loads.follow(state)
        self._sum_forces(self._force.struct, [self._loads.vectors, self._loads.following], state, out)

    def internal(self, state: State, side: Array, out: State) -> None:
        """`wsph.formulations.lagrangian.rates.LagrangianRates.internal`; the derived fields of the state are then told."""
        body, none = self._alone(self._force.struct, self._arrays, self._placement.count, self._space)
        self._sum_forces(body, [none, none], state, out)
        if self.form.total:
            self.refresh(state)

    def _launch(self, kernel: wp.Kernel, blocks: int, inputs: Sequence[object], outputs: Sequence[object]) -> None:
        """Launch a kernel over so many blocks."""
        self._clock.launch(kernel, blocks * self._threads, inputs, outputs)
