"""Signals that ask a run to end."""

# pyright: strict

import signal
import threading
from typing import Any


class Interrupts:
    """Holds SIGINT, SIGTERM and SIGHUP, of a terminal that goes, until a block of steps has ended: a state half way through
    a step is no state. Asked for again, a signal changes nothing; one that was ignored stays so."""

    def __init__(self) -> None:
        self.asked = 0
        self._former: dict[int, Any] = {}

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
            for number in (each for each in numbers if signal.getsignal(each) is not signal.SIG_IGN):
                self._former[number] = signal.signal(number, self._ask)
        return self

    def _ask(self, number: int, _: object) -> None:
        self.asked = number

    def __exit__(self, *_: object) -> None:
        for number, former in self._former.items():
            signal.signal(number, former)
