"""The record of one probe: rows in a ring on the device, indexed by the step number, which the host reads between blocks of
steps."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Mapping

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.space import Array
from wsph.errors import CheckpointError
from wsph.scene.probes import Probe

RING = 1024
"""Steps between two reads of a probe that records every step."""


class Recorder:
    """One probe on the device. `record()` is launches; `flush(steps)` appends the rows of those steps.

    _ring  # (RING, c) of a row's c numbers, nondimensional, the row of step s at s modulo RING; (1, c) unless every step is
           # recorded
    """

    def __init__(
        self, probe: Probe, clock: Clock, width: int, dtype: type, *, every_step: bool, kept: int | None = None
    ):
        """A row on the device has `width` numbers; `kept` of them, or what they are reduced to, are kept on the host."""
        self.probe, self.every_step, self._clock = probe, every_step, clock
        self._ring: Array = wp.zeros((RING if every_step else 1, width), dtype=dtype, device=clock.device)
        self._kept = width if kept is None else kept
        self._rows: list[np.ndarray] = []
        self.steps: list[int] = []

    def record(self) -> None:
        """Store the current values in the ring (launches)."""
        raise NotImplementedError

    def begin(self, stood: Mapping[str, float]) -> None:
        """Take what works `stood` at when the run began, by their columns of the history, nondimensional."""

    def columns(self) -> dict[str, np.ndarray]:
        """The record so far, SI: one array (records,) a column."""
        raise NotImplementedError

    @property
    def units(self) -> dict[str, str]:
        """SI units of the columns, by name."""
        raise NotImplementedError

    def flush(self, steps: list[int]) -> None:
        """Read the rows of `steps` (all still in the ring)."""
        if steps:
            ring: np.ndarray = self._ring.numpy()
            self._rows.append(self.reduced(ring[[s % len(ring) for s in steps]].astype(np.float64)))
            self.steps += steps

    def again(self, step: int) -> None:
        """Record the state after `step` as it is now, once."""
        if self.steps and self.steps[-1] == step:
            self.steps.pop()
            self._rows[-1] = self._rows[-1][:-1]
        self.record()
        self.flush([step])

    def reduced(self, rows: np.ndarray) -> np.ndarray:
        """What of rows (steps, c) is kept."""
        return rows

    def kept(self) -> tuple[np.ndarray, list[int]]:
        """The rows read so far, (steps, c), and their steps."""
        return (np.concatenate(self._rows) if self._rows else np.zeros((0, self._kept))), self.steps

    def go_on(self, rows: np.ndarray, steps: list[int]) -> None:
        """Take up a record where a checkpoint left it. Raises CheckpointError for one of other columns."""
        if len(rows) and rows.shape[1] != self._kept:
            raise CheckpointError(
                f"probe {self.probe.name!r} has {rows.shape[1]} columns in the checkpoint, not {self._kept}"
            )
        self._rows, self.steps = ([rows] if len(rows) else []), list(steps)
