"""Steps replayed in pieces: the same bits for any number of threads, and faults that come back."""

from collections.abc import Callable

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.backend.graph import SMALL_PAIRS, Program
from wsph.simulation.compose import compose


def block(threads: int, run: dict) -> wsph.Scene:
    """A block of 512 cells in 3D that spins and stretches, held at one side."""
    keys = {"end": 0.5, "cfl": 0.2, "threads": threads, **run}
    velocity = ["-0.1*y+0.05*x", "0.1*x", "0"]
    return scenes.block(3, 8, model="jaumann", run=keys, tables={"boundary": [scenes.held("-x", 3)]}, velocity=velocity)


CASES = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "updated-lagrangian"},
    {"formulation": "total-lagrangian", "integrator": "rk4", "precision": "f32"},
    {"integrator": "tsph"},
    {"integrator": "ul-tsph", "cfl": 0.5},
]


LAGRANGIAN = ({"formulation": "total-lagrangian"}, {"formulation": "updated-lagrangian"})
"""Which the hashes of whole runs (tests/simulation/test_determinism.py) are of too."""


@pytest.mark.parametrize("case", [pytest.param(case, marks=pytest.mark.slow if case in LAGRANGIAN else ()) for case in CASES],
                         ids=lambda case: "-".join(map(str, case.values())))  # fmt: skip
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
            segments = composition.program._segments
            assert {len(each.graphs) + len(each.pieces) for each in segments} == {count}
            assert any(each.pieces for each in segments)
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
        next(segment.pieces for segment in run._segments if segment.pieces)[1][0] = Failing()
    else:
        graphs = next(segment.graphs for segment in run._segments if segment.graphs)
        graphs[0 if broken == "the caller's graph" else 2] = Failing()
    with pytest.raises(ValueError, match="a part of a launch"):
        run.run(40)
    assert run.run(3) == 3  # with a team of its own


def test_a_captured_graph_gives_the_bits_of_direct_launches(shock_bar: wsph.Scene) -> None:
    states = []
    for pairs in (1, SMALL_PAIRS + 1):
        composition = compose(shock_bar.with_(cfl=0.7))
        program = Program(composition.program.step, composition.clock, pairs)
        assert program.small == (pairs == 1)
        program.run(301)
        states.append(composition.bodies[0].system.state.buffer.numpy())
    assert np.array_equal(*states)
    assert np.abs(states[0]).max() > 1e-3  # a velocity over the wave speed
