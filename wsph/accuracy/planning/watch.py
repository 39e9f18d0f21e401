"""Watching a run for when it will end, so that it can be ended before it goes beyond the time that there is."""

# pyright: strict

import time

from wsph.simulation.run import Progress

SEEN = 0.05
"""The part of its steps by which the pace of a run is judged: the first ones are checked one by one."""


class Watch:
    """Of one run, which has to end `by` a time of `time.perf_counter`. `late` is asked between stretches of its steps, and
    says so too where the steps to come would end too late at the pace of the last ones, and at that of those before."""

    def __init__(self, by: float, progress: Progress | None = None):
        self._by, self._also = by, progress
        self._seen: tuple[int, float] | None = None
        self._pace = 0.0
        self.ended = False
        """Whether it was found to be late."""

    def late(self) -> bool:
        """Whether the run has to end now."""
        self.ended = self.ended or time.perf_counter() > self._by
        return self.ended

    def progress(self, step: int, steps: int, at: float) -> None:
        """To be called between blocks of steps, as a run calls it."""
        now = time.perf_counter()
        # The first block captures its steps, and has no pace.
        before, then = self._seen or (step, now)
        if step - before >= SEEN * steps:
            pace = (now - then) / (step - before)
            # Twice: what is measured once in a while is no pace.
            self.ended = self.ended or now + min(pace, self._pace) * (steps - step) > self._by
            self._pace = pace
        if self._seen is None or step - before >= SEEN * steps:
            self._seen = step, now
        if self._also is not None:
            self._also(step, steps, at)
