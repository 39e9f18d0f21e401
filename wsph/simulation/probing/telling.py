"""Probes of what contacts, tools, boundaries and sections tell of themselves."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.contact.reported import Reported
from wsph.errors import Fault, SceneError
from wsph.scene.tables import Probe
from wsph.simulation.probing.rings import RING, Rings


@cache
def _copy_kernel() -> wp.Kernel:
    @kernel()
    def copy(
        step: wp.array(dtype=wp.int64), numbers: wp.array(dtype=wp.float64), ring_out: wp.array2d(dtype=wp.float64)
    ):
        c = wp.tid()
        ring_out[int(step[0] % wp.int64(ring_out.shape[0])), c] = numbers[c]

    return copy


class Teller(Rings):
    """A probe of something that reports: `record()` is a launch; rows are all of its numbers, nondimensional.

    _ring  # (RING, k) float64, the row of step s at s modulo RING; (1, k) unless every step is recorded
    """

    def __init__(self, probe: Probe, key: str, told: list[Reported], clock: Clock, every_step: bool):
        found = [each for each in told if each.name == probe.of]
        if not found:
            names = ", ".join(repr(each.name) for each in told) or "nothing does"
            raise SceneError("scene", [Fault(0, f"{key}.of", f"{probe.of!r} does not report; {names}")])
        self._told, self._clock = found[0], clock
        for name in probe.fields:
            if name not in self._told.fields:
                known = ", ".join(self._told.fields)
                what = f"{self._told.kind} {probe.of!r} has no {name!r}; it has {known}"
                raise SceneError("scene", [Fault(0, f"{key}.fields", what)])
        length = RING if every_step else 1
        self._ring = wp.zeros((length, len(self._told.numbers)), dtype=wp.float64, device=clock.device)
        super().__init__(probe, self._ring, every_step)

    def record(self) -> None:
        inputs = [self._clock.step, self._told.numbers]
        self._clock.launch(_copy_kernel(), self._ring.shape[1], inputs, [self._ring])

    def columns(self) -> dict[str, np.ndarray]:
        rows, _ = self.kept()
        wanted = (item for name in self.probe.fields for item in self._told.fields[name].items())
        return {name: rows[:, column.index] * column.scale for name, column in wanted}

    def units(self) -> dict[str, str]:
        return {name: column.unit for field in self.probe.fields for name, column in self._told.fields[field].items()}
