"""Probes of numbers that processes share: they put them together on the host."""

# pyright: strict

from collections.abc import Mapping, Sequence

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import Domain
from wsph.errors import Fault, SceneError
from wsph.reporting import Reported
from wsph.scene.probes import Probe
from wsph.simulation.probing.numbers import WORK, Numbers, column, components, scale
from wsph.simulation.probing.recorder import Recorder
from wsph.units import Scales


class SharedNumbers(Recorder):
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
        of = [each for each in reported if each.name == probe.of]
        if often or not of:
            text = (
                "numbers of every step are for one process" if of else f"nothing that has numbers is named {probe.of!r}"
            )
            raise SceneError("scene", [Fault(0, f"{key}.every" if of else f"{key}.of", text)])
        self._numbers = Numbers(of, scales, dim, domain)
        names = [number for name in probe.fields for number in components(name, dim)]
        self._columns = {name: column(of[0], name) for name in names}
        self._scale, self._stood = {name: scale(name, scales, dim) for name in names}, 0.0
        super().__init__(probe, clock, len(names), wp.float64, every_step=False)

    def record(self) -> None:
        """What there is is put together when it is read."""

    def flush(self, steps: list[int]) -> None:
        found = self._numbers.present()
        self._rows.append(np.array([[found[each] for each in self._columns.values()]] * len(steps)))
        self.steps += steps

    def begin(self, stood: Mapping[str, float]) -> None:
        self._stood = stood.get(self._columns.get(WORK, ""), 0.0)

    def columns(self) -> dict[str, np.ndarray]:
        rows, _ = self.kept()
        stood = {WORK: self._stood}
        return {name: (rows[:, k] - stood.get(name, 0.0)) * self._scale[name] for k, name in enumerate(self._columns)}

    @property
    def units(self) -> dict[str, str]:
        return {name: self._numbers.units[column] for name, column in self._columns.items()}
