"""Signals that ask a run to end."""

# pyright: strict

import signal
import threading
from collections.abc import Callable
from typing import Any

ENOUGH = -1
"""What is `asked` by who has had enough, and no signal."""

NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGUSR1")
"""Signals that ask: a terminal's, the system's, of a terminal that goes, and the one that mpiexec passes on: half a second
after it was sent one of the others it kills its processes."""


class Interrupts:
    """Holds the signals that ask a run to end until a block of steps has ended: a state half way through a step is no state.
    Asked for again, a signal changes nothing; one that was ignored stays so, and so does a SIGUSR1 that means something
    else in a program. `enough` is asked along with them, and ends a run as they do."""

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
            for number in _asking():
                self._former[number] = signal.signal(number, self._ask)
        return self

    def _ask(self, number: int, _: object) -> None:
        self._asked = number

    def __exit__(self, *_: object) -> None:
        for number, former in self._former.items():
            signal.signal(number, former)


def _asking() -> list[int]:
    """The numbers of the signals that ask in this program."""
    numbers: list[int] = []
    for name in NAMES:
        if (number := getattr(signal, name, None)) is None:  # on Windows
            continue
        handler = signal.getsignal(number)
        known = handler in (signal.SIG_DFL, signal.default_int_handler)
        known = known or isinstance(getattr(handler, "__self__", None), Interrupts)
        if handler is not signal.SIG_IGN and (known or name != "SIGUSR1"):
            numbers.append(number)
    return numbers
