"""Steps replayed in pieces: the same bits for any number of threads, and faults that come back."""

import os
from collections.abc import Callable

import numpy as np
import pytest
import warp as wp

import wsph
from wsph.backend import launch, threads
from wsph.backend.pair_loops import PAIR_LOOPS, vector_width
from wsph.simulation.compose import compose


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
def test_any_number_of_threads_gives_the_same_bits(case: dict, share: Callable[[], None]) -> None:
    states = []
    captured = compose(block(1, case))
    captured.program.run(12)
    states.append(captured.bodies[0].system.state.buffer.numpy())
    share()
    for count in (1, 2, 4):
        composition = compose(block(count, case))
        assert not composition.program.small
        composition.program.run(12)
        assert composition.program.threads == count
        if count > 1:
            stretches = composition.program._stretches
            assert {len(each.graphs) + len(each.pieces) for each in stretches} == {count}
            assert any(each.pieces for each in stretches)
        states.append(composition.bodies[0].system.state.buffer.numpy())
    for other in states[1:]:
        assert np.array_equal(states[0], other)
    assert np.isfinite(states[0]).all()


class Failing:
    """A graph that cannot be replayed."""

    @property
    def _native_graph(self) -> None:
        raise ValueError("a part of a launch")


@pytest.mark.parametrize("broken", ["the caller's graph", "another's graph", "a piece"])
def test_a_part_that_fails_is_raised_where_the_step_is_run(broken: str, share: Callable[[], None]) -> None:
    share()
    composition = compose(block(3, {}))
    composition.compile()
    run = composition.program
    assert run.run(2) == 2
    if broken == "a piece":
        next(stretch.pieces for stretch in run._stretches if stretch.pieces)[1][0] = Failing()
    else:
        graphs = next(stretch.graphs for stretch in run._stretches if stretch.graphs)
        graphs[0 if broken == "the caller's graph" else 2] = Failing()
    with pytest.raises(ValueError, match="a part of a launch"):
        run.run(40)
    assert run.run(3) == 3  # with a crew of its own


def test_threads_meet_after_every_launch_that_they_share(monkeypatch: pytest.MonkeyPatch) -> None:
    @wp.kernel(enable_backward=False)
    def ranged(first: int):
        pass

    @wp.kernel(enable_backward=False)
    def whole(n: int):
        pass

    seen: list[str] = []
    found = threads.Crew(2)
    monkeypatch.setattr(found, "_meet", lambda number: seen.append("meet"))

    def note(kernel: wp.Kernel, n: int, inputs: list, **_: object) -> None:
        seen.append(f"{kernel.key.split('_')[-1]} {inputs[0]}+{n}")

    monkeypatch.setattr(launch.wp, "launch", note)
    launches = [launch.Launch(kernel, 9, [], [], "cpu") for kernel in (whole, ranged)]
    assert [threads.share(launches[1], seconds) for seconds in (1e-6, 1e-4, 1.0)] == list(threads.Share)
    assert threads.share(launches[0], 1.0) is threads.Share.ALONE
    launches[0].inputs.append(0)
    plan = [(launches[k], k == 1) for k in (0, 1, 1, 0, 0)]
    found._part(plan, 0)
    assert seen == ["whole 0+9", "meet", "ranged 0+4", "meet", "ranged 0+4", "meet", "whole 0+9", "whole 0+9", "meet"]
    seen.clear()
    found._part(plan, 1)
    assert seen == ["meet", "ranged 4+5", "meet", "ranged 4+5", "meet", "meet"]
    seen.clear()
    monkeypatch.setattr(threads, "PIECE_SHARE", 0.5)
    found._pieces(launches[1], 1.0)
    assert seen == [f"ranged {each}" for each in ("0+2", "2+1", "3+1", "4+2", "6+1", "7+1", "8+1")]
    found.dismiss()


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="no affinity here")
def test_the_caller_gets_its_cores_back() -> None:
    before = os.sched_getaffinity(0)
    found = threads.Crew(2)
    with found.at_work():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before
    found.dismiss()


@pytest.mark.parametrize(
    ("says", "width"), [("vendor_id\t: AuthenticAMD", 128), ("vendor_id\t: GenuineIntel", 512), ("", 512)]
)
def test_pair_loops_are_as_wide_as_the_processor_likes(says: str, width: int) -> None:
    assert vector_width(says) == width
    assert PAIR_LOOPS["cpu_compiler_flags"].endswith(("=128", "=512"))
