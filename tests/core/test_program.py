"""Steps replayed in pieces: the same bits for any number of threads, and faults that come back."""

import os

import numpy as np
import pytest

import wsph
from wsph import program
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
    monkeypatch.setattr(program, "GRAPH_PAIRS", 0)
    monkeypatch.setattr(program, "SPLIT_SECONDS", 0.0)
    for threads in (1, 2, 4):
        composition = compose(block(threads, case))
        assert not composition.program.captured
        composition.program.run(12)
        assert composition.program.threads == threads
        if threads > 1:
            assert max(len(pieces) for pieces in composition.program._commands or [[]]) == threads
        states.append(composition.bodies[0].system.state.buffer.numpy())
    for other in states[1:]:
        assert np.array_equal(states[0], other)
    assert np.isfinite(states[0]).all()


def test_a_piece_that_fails_is_raised_where_the_step_is_run() -> None:
    class Piece:
        def __init__(self, fails: bool):
            self.fails, self.ran = fails, False

        def launch(self) -> None:
            self.ran = True
            if self.fails:
                raise ValueError("a piece of a launch")

    crew = program.Crew(3)
    pieces = [Piece(False), Piece(True), Piece(False)]
    with pytest.raises(ValueError, match="a piece of a launch"):
        crew.run(pieces)
    assert all(piece.ran for piece in pieces)
    crew.run([Piece(False)] * 3)
    crew.dismiss()


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="no affinity here")
def test_the_caller_gets_its_cores_back() -> None:
    before = os.sched_getaffinity(0)
    crew = program.Crew(2)
    with crew.at_work():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before
    crew.dismiss()
