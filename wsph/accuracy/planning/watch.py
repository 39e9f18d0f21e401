"""Watching a run for when it will end, so that it can be ended before it goes beyond the time that there is, or in favour of
a larger one that the time pays for as well."""

# pyright: strict

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from wsph.simulation.run import WATCHED, Progress

SEEN = 0.99 / WATCHED
"""The part of its steps by which the pace of a run is judged: of those that it is watched in, one."""

REST = 0.03
"""The part of all seconds that is still to come of a run that is ended in favour of a larger one: less is let be."""


@dataclass(frozen=True)
class Due:
    """When a run has to end, in seconds of a search: as it begins it has to be over by `until`, and by that and a `slack`
    when it is nearly done. One that takes so little that one of `larger` times its seconds were over by `planned` is ended
    as well."""

    until: float = math.inf
    slack: float = 0.0
    planned: float = -math.inf
    larger: float = math.inf


class Watch:
    """Of one run of a search that was `begun` at a time of the `clock`. `late` is asked between stretches of its steps, and
    says so where it is beyond its time, or would be, or is too small for it, at the pace of the last steps and at that of
    those before."""

    def __init__(
        self, due: Due, begun: float = 0.0, progress: Progress | None = None, clock: Callable[[], float] | None = None
    ):
        self._clock = clock or (lambda: time.perf_counter())
        self._due, self._since, self._also = due, begun, progress
        self._begun = self._now
        self._seen: tuple[int, float] | None = None
        self._paces: list[float] = []
        self.ended = self.early = False
        """Whether it was found to be late, or to be early: both end it."""

    def late(self) -> bool:
        """Whether the run has to end now."""
        self.ended = self.ended or self._now > self._due.until + self._due.slack
        return self.ended

    def progress(self, step: int, steps: int, at: float) -> None:
        """To be called between blocks of steps, as a run calls it."""
        now = self._now
        # The first block captures its steps, and has no pace.
        before, then = self._seen or (step, now)
        if step - before >= SEEN * steps:
            self._paces = [*self._paces[-1:], (now - then) / (step - before)]
            # Twice: what is measured once in a while is no pace.
            if len(self._paces) == 2 and not self.ended:
                self._judge(now, step, steps)
        if self._seen is None or step - before >= SEEN * steps:
            self._seen = step, now
        if self._also is not None:
            self._also(step, steps, at)

    @property
    def _now(self) -> float:
        return self._clock() - self._since

    def _judge(self, now: float, step: int, steps: int) -> None:
        due, left = self._due, steps - step
        rest = max(self._paces) * left
        self.early = rest > REST * due.until and due.planned - now > due.larger * (now + rest - self._begun)
        self.ended = self.early or now + min(self._paces) * left > due.until + due.slack * step / steps
