"""Signals that ask a run to end."""

# pyright: strict

import signal
import threading
from collections.abc import Callable
from typing import Any

ENOUGH = -1
"""What is `asked` by who has had enough, and no signal."""


class Interrupts:
    """Holds SIGINT, SIGTERM and SIGHUP, of a terminal that goes, until a block of steps has ended: a state half way through
    a step is no state. Asked for again, a signal changes nothing; one that was ignored stays so. `enough` is asked along
    with them, and ends a run as they do."""

    def __init__(self, enough: Callable[[], bool] | None = None) -> None:
        self._asked, self._enough = 0, enough
        self._former: dict[int, Any] = {}

    @property
    def asked(self) -> int:
        """The number of the signal that has come, ENOUGH, or 0."""
        if self._asked == 0 and self._enough is not None and self._enough():
            self._asked = ENOUGH
        return self._asked

    @asked.setter
    def asked(self, number: int) -> None:
        self._asked = number

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
            for number in (each for each in numbers if signal.getsignal(each) is not signal.SIG_IGN):
                self._former[number] = signal.signal(number, self._ask)
        return self

    def _ask(self, number: int, _: object) -> None:
        self._asked = number

    def __exit__(self, *_: object) -> None:
        for number, former in self._former.items():
            signal.signal(number, former)
