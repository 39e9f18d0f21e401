"""Probes of fields of a body that processes share: each is recorded by the process that has its places."""

# pyright: strict

from collections.abc import Callable, Mapping

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import Domain
from wsph.scene.probes import Probe
from wsph.simulation.probing.recorder import Recorder


class PlacedRecorder(Recorder):
    """A probe that one process records. All ask it for what it has together."""

    def __init__(
        self, probe: Probe, clock: Clock, often: bool, domain: Domain, keeper: int, make: Callable[[], Recorder]
    ):
        super().__init__(probe, clock, 1, wp.float64, every_step=often)
        self._domain, self._keeper = domain, keeper
        self._own = make() if domain.rank == keeper else None

    def record(self) -> None:
        if self._own is not None:
            self._own.record()

    def flush(self, steps: list[int]) -> None:
        self.steps += steps
        if self._own is not None:
            self._own.flush(steps)

    def begin(self, stood: Mapping[str, float]) -> None:
        if self._own is not None:
            self._own.begin(stood)

    def columns(self) -> dict[str, np.ndarray]:
        return self._domain.told(lambda: self._kept_here.columns(), self._keeper)

    def kept(self) -> tuple[np.ndarray, list[int]]:
        return self._domain.told(lambda: self._kept_here.kept(), self._keeper)

    def go_on(self, rows: np.ndarray, steps: list[int]) -> None:
        self.steps = list(steps)
        if self._own is not None:
            self._own.go_on(rows, steps)

    @property
    def units(self) -> dict[str, str]:
        return self._domain.told(lambda: self._kept_here.units, self._keeper)

    @property
    def _kept_here(self) -> Recorder:
        assert self._own is not None
        return self._own
