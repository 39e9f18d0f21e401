"""When something is due in a run, and when the run is asked to end."""

import math
import signal
import threading
from typing import Any


class Events:
    """Steps at which something is due: the first state at or after each multiple of the cadence, and the last one."""

    def __init__(self, cadence: float | int | None, dt: float, last: int):
        # A cadence below the step is every step, one beyond the end none but the last.
        self._steps: float | None = None
        if cadence is not None:
            steps = cadence if isinstance(cadence, int) else cadence / dt
            self._steps = float(min(max(steps, 1), last + 1))
        self._last = last
        self.next = 0

    def advance(self) -> None:
        """Move on to the next due step."""
        if self.next >= self._last:
            self.next = self._last + 1
        elif self._steps is None:
            self.next = self._last
        else:
            number = math.floor((self.next + 1e-9) / self._steps) + 1
            self.next = min(math.ceil(number * self._steps - 1e-9), self._last)

    def skip(self, step: int) -> None:
        """What was due up to `step` has been done."""
        while self.next <= step:
            self.advance()


class Interrupts:
    """Holds SIGINT and SIGTERM until a block of steps has ended: a state half way through a step is no state."""

    def __init__(self) -> None:
        self.asked = 0
        self._former: dict[int, Any] = {}

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._former[number] = signal.signal(number, self._ask)
        return self

    def _ask(self, number: int, _: object) -> None:
        self.asked = number

    def __exit__(self, *_: object) -> None:
        for number, former in self._former.items():
            signal.signal(number, former)
