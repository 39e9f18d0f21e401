"""Steps replayed in pieces: the same bits for any number of threads, and faults that come back."""

import os

import numpy as np
import pytest
import warp as wp

import wsph
from wsph import crew, program
from wsph.clock import takes_ranges
from wsph.composition import compose


def block(threads: int, run: dict, **body: object) -> wsph.Scene:
    """A block of 512 cells in 3D that spins and stretches, held at one side."""
    data = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [1.0] * 3}, "spacing": 0.125,
            "velocity": ["-0.1*y+0.05*x", "0.1*x", "0"], "material": {"model": "jaumann", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}, **body}  # fmt: skip
    runs = {"integrator": "leapfrog", "end": 0.5, "cfl": 0.2, "threads": threads, **run}
    return wsph.Scene(
        schema=1, dim=3, run=runs, bodies=[data], boundary=[{"body": "b", "face": "-x", "fixed": ["x", "y", "z"]}]
    )


CASES = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "updated-lagrangian"},
    {"formulation": "total-lagrangian", "integrator": "rk4", "precision": "f32"},
    {"integrator": "tsph"},
    {"integrator": "ul-tsph", "cfl": 0.5},
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: "-".join(map(str, case.values())))
def test_any_number_of_threads_gives_the_same_bits(case: dict, monkeypatch: pytest.MonkeyPatch) -> None:
    states = []
    captured = compose(block(1, case))
    captured.program.run(12)
    states.append(captured.bodies[0].system.state.buffer.numpy())
    monkeypatch.setattr(program, "SMALL_PAIRS", 0)
    monkeypatch.setattr(program, "SHARED_SECONDS", 0.0)
    for threads in (1, 2, 4):
        composition = compose(block(threads, case))
        assert not composition.program.small
        composition.program.run(12)
        assert composition.program.threads == threads
        if threads > 1:
            assert any(composition.program.shared)
        states.append(composition.bodies[0].system.state.buffer.numpy())
    for other in states[1:]:
        assert np.array_equal(states[0], other)
    assert np.isfinite(states[0]).all()


class Failing:
    """A graph that the caller's or another thread cannot replay."""

    @property
    def _native_graph(self) -> None:
        raise ValueError("a part of a launch")


@pytest.mark.parametrize("number", [0, 2])
def test_a_part_that_fails_is_raised_where_the_step_is_run(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "SMALL_PAIRS", 0)
    composition = compose(block(3, {}))
    composition.compile()
    run = composition.program
    assert run.run(2) == 2
    captured = run._captured(1)
    broken = [Failing() if k == number else graph for k, graph in enumerate(captured)]
    monkeypatch.setattr(run, "_captured", lambda steps: broken)
    with pytest.raises(ValueError, match="a part of a launch"):
        run.run(40)
    monkeypatch.undo()
    assert run.run(3) == 3  # with a crew of its own


def test_threads_meet_after_every_launch_that_they_share() -> None:
    composition = compose(block(2, {}))
    composition.compile()
    composition.program.run(1)
    clock, step = composition.clock, composition.program.step
    kernels = clock.list_launches(step)
    found = crew.Crew(2)
    taken: list[object] = []
    for me, shared in ((0, True), (1, True), (0, False), (1, False)):
        taken.clear()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(wp, "launch", lambda kernel, *_, **__: taken.append(kernel))
            found._capture(step, clock, [shared] * len(kernels), me)
        meetings = taken.count(crew.meeting())
        ranged = sum(takes_ranges(kernel) for kernel in kernels)
        assert len(taken) - meetings == ((len(kernels), ranged) if shared else (len(kernels), 0))[me]
        assert meetings > ranged if shared else meetings == 1
    found.dismiss()


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="no affinity here")
def test_the_caller_gets_its_cores_back() -> None:
    before = os.sched_getaffinity(0)
    found = crew.Crew(2)
    with found.at_work():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before
    found.dismiss()
