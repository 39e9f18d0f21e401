"""Probes of numbers that processes share: they put them together on the host."""

# pyright: strict

from collections.abc import Sequence

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.domain import Domain
from wsph.errors import Fault, SceneError
from wsph.reporting import Reported
from wsph.scene.probes import Probe
from wsph.simulation.probing.numbers import NumberRecorder, Numbers, column
from wsph.units import Scales


class SharedNumbers(NumberRecorder):
    """A probe of the numbers of one thing that processes share."""

    def __init__(
        self,
        probe: Probe,
        key: str,
        reported: Sequence[Reported],
        scales: Scales,
        clock: Clock,
        dim: int,
        often: bool,
        domain: Domain,
    ):
        super().__init__(probe, key, reported, scales, clock, dim, often=False)
        if often:
            raise SceneError("scene", [Fault(0, f"{key}.every", "numbers of every step are for one process")])
        self._together = Numbers([self._of], scales, dim, domain, (self._of.name,))

    def record(self) -> None:
        """What there is is put together when it is read."""

    def flush(self, steps: list[int]) -> None:
        found = self._together.present()
        row = [found[column(self._of, number)] for number in self._numbers]
        self._rows.append(np.array([row] * len(steps)))
        self.steps += steps
