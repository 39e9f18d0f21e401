"""Signals that ask a run to end."""

# pyright: strict

import signal
import threading
from typing import Any


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
