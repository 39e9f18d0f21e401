"""A launch as a value: a kernel, its threads and its arguments; and graphs of launches."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import warp as wp

from wsph.backend.kernels import is_ranged


@dataclass(frozen=True)
class Launch:
    """A kernel over `n` threads. A ranged one takes, before the inputs, where a range of them begins: its rows are from
    `first` on. Launches of a `group`, from 1 on, take of those of their own `part` of it alone."""

    kernel: wp.Kernel
    n: int
    inputs: list[object]
    outputs: list[object]
    device: str
    group: int = 0
    part: int = 0
    first: int = 0

    @property
    def divisible(self) -> bool:
        """Whether the launch can be split into ranges of its threads."""
        return is_ranged(self.kernel)

    def run(self, low: int = 0, high: int | None = None) -> None:
        """Launch the threads from `low` to `high`, of a divisible launch, or all of them."""
        inputs = [self.first + low, *self.inputs] if self.divisible else self.inputs
        n = (self.n if high is None else high) - low
        wp.launch(self.kernel, n, inputs=inputs, outputs=self.outputs, device=self.device)


@dataclass(frozen=True)
class HostCall:
    """Something that the host does between two launches of a step."""

    call: Callable[[], None]

    def run(self) -> None:
        """Do it."""
        self.call()


def captured(launches: Callable[[], None], device: str = "cpu") -> wp.Graph:
    """A graph of launches, whose kernels are loaded. It starts them faster: their arguments are packed once."""
    with wp.ScopedCapture(device=device, force_module_load=False) as capture:
        launches()
    return cast(wp.Graph, capture.graph)
