"""Records of a few numbers at every step, or at some, kept on the device between reads."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from typing import Protocol

import numpy as np

from wsph.errors import CheckpointError
from wsph.scene.tables import Probe

RING = 1024
"""Steps between two reads of a probe that records every step."""


class DeviceRing(Protocol):
    """An array on the device, (steps, columns)."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    def numpy(self) -> np.ndarray: ...


class Rings:
    """The rows of a probe: those of a ring on the device, the row of step s at s modulo its length, and those that were read
    from it. What records, and what the columns are, is a probe's own."""

    def __init__(self, probe: Probe, ring: DeviceRing, every_step: bool):
        self.probe, self.every_step, self._rows_of = probe, every_step, ring
        self._rows: list[np.ndarray] = []
        self.steps: list[int] = []

    def record(self) -> None:
        """Store the current values in the ring (a launch)."""
        raise NotImplementedError

    def columns(self) -> dict[str, np.ndarray]:
        """The record so far, SI, one array (records,) a column."""
        raise NotImplementedError

    def units(self) -> dict[str, str]:
        """SI units of its columns that no field has."""
        return {}

    def flush(self, steps: list[int]) -> None:
        """Read the rows of `steps` (all still in the ring)."""
        if steps:
            ring = self._rows_of.numpy()
            self._rows.append(ring[[s % len(ring) for s in steps]].astype(np.float64))
            self.steps += steps

    def kept(self) -> tuple[np.ndarray, list[int]]:
        """The rows read so far, (steps, c), and their steps."""
        width = self._rows_of.shape[1]
        return (np.concatenate(self._rows) if self._rows else np.zeros((0, width))), self.steps

    def go_on(self, rows: np.ndarray, steps: list[int]) -> None:
        """Take up a record where a checkpoint left it. Raises CheckpointError for one of other columns."""
        width = self._rows_of.shape[1]
        if len(rows) and rows.shape[1:] != (width,):
            raise CheckpointError(
                f"probe {self.probe.name!r} has {rows.shape[1]} columns in the checkpoint, not {width}"
            )
        self._rows, self.steps = ([rows] if len(rows) else []), list(steps)
