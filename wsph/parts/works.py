"""Works on the device, for entries of the ledger."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.reduce import blocks, totals
from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.output.fields import AXES


def work_and_force(dim: int) -> tuple[str, ...]:
    """Names of the numbers (`wsph.reporting.Reported`) of a work and a force, in this order."""
    return ("work", *(f"force_{axis}" for axis in AXES[:dim]))


class Works:
    """Works, one a column, summed in blocks of rows (`wsph.backend.reduce`), of those that a process owns. `_launch` gives
    the kernel that adds those of a step, its inputs, and what it writes beside them.

    _work   # (blocks, columns) float64, works so far, nondimensional
    """

    columns = 2

    def __init__(self, n: int | Share, acts: bool, device: str, domain: Domain = WHOLE):
        """Of n rows, or of the own rows of a share, which begin with a whole block."""
        share = n if isinstance(n, Share) else Share.all(n)
        self._low, self._n, self._acts, self._domain = share.own.start, share.own.stop, acts, domain
        if acts:
            count = blocks(self._n - self._low)
            self._work: Array = wp.zeros((count, self.columns), dtype=wp.float64, device=device)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        raise NotImplementedError

    def add(self, state: State, clock: Clock) -> None:
        """Add the work of a step whose final values stand in `state` (a launch, where there is something)."""
        if self._acts:
            kernel, inputs, outputs = self._launch(state, clock)
            clock.launch(kernel, self._work.shape[0], inputs, [*outputs, self._work])

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        if self._acts:
            self.add(state, clock)
            self._work.zero_()

    def kept(self) -> dict[str, Array]:
        """The arrays that a checkpoint holds of it, by name."""
        return {"work": self._work} if self._acts else {}

    def _total(self, column: int) -> float:
        return float(totals(self._work, self._domain)[column]) if self._acts else 0.0


class PowerWorks(Works):
    """Works by the trapezoidal rule: the kernel adds half a step of the power now and the power before.

    _power  # (blocks, columns) float64, powers at the end of the last step, nondimensional
    """

    def __init__(self, n: int | Share, acts: bool, device: str, domain: Domain = WHOLE):
        super().__init__(n, acts, device, domain)
        if acts:
            self._power: Array = wp.zeros_like(self._work)

    def kept(self) -> dict[str, Array]:
        return super().kept() | ({"power": self._power} if self._acts else {})
