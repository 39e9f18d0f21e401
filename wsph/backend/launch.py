"""A launch as a value: a kernel, its threads and its arguments; and graphs of launches."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp


@dataclass(frozen=True)
class Launch:
    """A kernel over `n` threads. One whose first argument is `first`, which is not among the inputs, can be launched in
    ranges that begin there."""

    kernel: wp.Kernel
    n: int
    inputs: list[Any]
    outputs: list[Any]
    device: str

    @property
    def divisible(self) -> bool:
        """Whether it can be in ranges."""
        return self.kernel.adj.args[0].label == "first"

    def run(self, low: int = 0, high: int | None = None) -> None:
        """Launch the range from `low` to `high` of it, of a divisible one, or the whole."""
        inputs = [low, *self.inputs] if self.divisible else self.inputs
        wp.launch(self.kernel, (self.n if high is None else high) - low, inputs=inputs, outputs=self.outputs,
                  device=self.device)  # fmt: skip


def captured(launches: Callable[[], None], device: str = "cpu") -> wp.Graph:
    """A graph of launches, whose kernels are loaded. It starts them faster: their arguments are packed once."""
    with wp.ScopedCapture(device=device, force_module_load=False) as capture:
        launches()
    return capture.graph
