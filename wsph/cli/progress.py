"""How far a run is: a bar on a terminal; elsewhere a line now and then, in a run that takes long."""

# pyright: strict

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress

EVERY = 30.0
"""Seconds between two lines where there is no terminal."""

Told = Callable[[int, int, float], None]
"""Called with the step, the last step and the time [s]."""


class Progress:
    """A progress bar on a terminal, a heartbeat elsewhere; silence where nothing is to be printed."""

    def __init__(self, quiet: bool):
        self._quiet, self._around = quiet, ExitStack()

    def __enter__(self) -> Told | None:
        if self._quiet:
            return None
        if not sys.stderr.isatty():
            return Heartbeat()
        from wsph.output.view.bar import Bar

        return self._around.enter_context(Bar())

    def __exit__(self, *_: object) -> None:
        self._around.close()


class Heartbeat:
    """A line on standard error every so often: how far it is, and when it will be done at this pace."""

    def __init__(self, every: float = EVERY, now: Callable[[], float] = time.monotonic):
        self._every, self._now = every, now
        self._last = now()
        self._begin: tuple[int, float] | None = None
        self._before = 0

    def __call__(self, step: int, steps: int, time: float) -> None:
        now = self._now()
        if self._begin is None or step <= self._before:  # a relaxation, and a row of a search, counts its own steps
            self._begin = (step, now)
        self._before = step
        if now - self._last < self._every:
            return
        self._last = now
        first, began = self._begin
        left = f", {duration((steps - step) * (now - began) / (step - first))} left" if step > first else ""
        with suppress(OSError):  # where nobody reads it the run goes on
            print(f"step {step} of {steps} ({100 * step / steps:.0f} %), t = {time:.4g} s{left}", file=sys.stderr)


def duration(seconds: float) -> str:
    """A duration in words, to two units: "1 h 20 min"."""
    whole = round(seconds)
    for unit, size, smaller, part in (("d", 86400, "h", 3600), ("h", 3600, "min", 60), ("min", 60, "s", 1)):
        if whole >= size:
            return f"{whole // size} {unit} {whole % size // part} {smaller}"
    return f"{whole} s"
