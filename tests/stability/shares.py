"""What following the limit of a time step takes of a run: right-hand sides, and the time of the process."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

import wsph
from wsph.output.interrupts import Interrupts
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.simulation.result import Result
from wsph.simulation.run import Running
from wsph.stability import small_motions
from wsph.stability.limit import StepLimit


@dataclass
class Share:
    """Of one run: its result, right-hand sides of its steps and of measurements, and seconds of the process for
    measurements, for following the limit (these and estimates) and in all."""

    steps: int
    measured: int = 0
    seconds: dict[str, float] = field(default_factory=lambda: {"measuring": 0.0, "following": 0.0, "all": 0.0})
    result: Result | None = None

    @property
    def evaluations(self) -> float:
        """Part of the right-hand sides of the steps that measurements take on top."""
        return self.measured / self.steps if self.steps else 0.0

    def time(self, name: str) -> float:
        """Part of the time of the process."""
        return self.seconds[name] / self.seconds["all"]


def share(scene: wsph.Scene) -> Share:
    """Run a scene and count, without what the guard itself counts."""
    composition = compose(scene)
    composition.compile()
    found = Share(0)

    def counting(function: Callable[..., Any]) -> Callable[..., Any]:
        def spectrum(system: Any) -> Any:
            rate = system.rate

            def counted(state: Any, out: Any, part: str = "all", *rest: Any, **more: Any) -> None:
                found.measured += part != "rest"
                rate(state, out, part, *rest, **more)

            system.rate = counted
            try:
                return _timed(function, found, "measuring")(system)
            finally:
                del system.rate

        return spectrum

    with ExitStack() as stack:
        stack.enter_context(patch.object(small_motions, "spectrum", counting(small_motions.spectrum)))
        stack.enter_context(patch.object(StepLimit, "follow", _timed(StepLimit.follow, found, "following")))
        interrupts = stack.enter_context(Interrupts())
        simulation = Running(composition, None, time.perf_counter())
        result = found.result = _timed(simulation.run, found, "all")(None, interrupts)
    found.steps = result.summary["steps"] * _evaluations(composition)
    return found


def _timed(function: Callable[..., Any], found: Share, name: str) -> Callable[..., Any]:
    def timed(*arguments: Any, **more: Any) -> Any:
        started = time.process_time()
        try:
            return function(*arguments, **more)
        finally:
            found.seconds[name] += time.process_time() - started

    return timed


def _evaluations(composition: Composition) -> int:
    """Right-hand sides a step of the first body."""
    system, count = composition.bodies[0].system, 0
    rate = system.rate

    def counted(state: Any, out: Any, part: str = "all", *rest: Any, **more: Any) -> None:
        nonlocal count
        count += part != "rest"
        rate(state, out, part, *rest, **more)

    system.rate = counted  # type: ignore[method-assign]
    composition.clock.launches(composition.bodies[0].integrator.step)
    del system.rate
    return count
