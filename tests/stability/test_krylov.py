"""What finding the limit of a step leaves behind, and the memory that it takes."""

import tracemalloc
from typing import Any

import numpy as np
import pytest

from tests import scenes
from wsph.formulations.one_set import OneSetSystem
from wsph.simulation.compose import compose
from wsph.stability import krylov
from wsph.validation.case import example

WAVES = ["0.1*sin(3*x)", "0"]

BODIES: dict[str, dict[str, Any]] = {
    "points": {},
    "edges": {"run": {"formulation": "total-lagrangian"}},
    "rates": {"material": scenes.material("jaumann")},
    "a yield surface": {"material": scenes.material("mises", yield_stress=0.01, hardening_modulus=0.1)},
    "pairs that follow": {
        "material": scenes.material("jaumann"),
        "run": {"formulation": "updated-lagrangian", "cfl": 0.2},
    },
    "viscosity": {"viscosity": {"alpha": 0.3}},
    "viscosity of all pairs": {
        "viscosity": {"alpha": 0.3, "kind": "pair"},
        "run": {"formulation": "total-lagrangian"},
    },
    "four stages": {"run": {"integrator": "rk4"}},
    "single precision": {"run": {"precision": "f32"}},
}


@pytest.mark.parametrize("which", BODIES)
def test_the_body_goes_on_as_if_it_had_not_been_measured(which: str) -> None:
    keys = dict(BODIES[which])
    run = keys.pop("run", {})
    body = scenes.body(scenes.cube(2), 0.125, velocity=WAVES, **keys)
    made = scenes.scene(body, run=run, boundary=[scenes.held("-x", 2)])
    ends: list[bytes] = []
    for measured in (False, True):
        composition = compose(made)
        composition.compile()
        system = composition.bodies[0].system
        assert isinstance(system, OneSetSystem)
        composition.program.run(5)
        if measured:
            before = {name: array.numpy().copy() for name, array in system.arrays.kept.items()}
            system.forget_motions()
            first = system.frequency
            system.forget_motions()
            assert system.frequency == first > 0.0
            for name, values in before.items():
                np.testing.assert_array_equal(system.arrays.kept[name].numpy(), values, err_msg=name)
        composition.program.run(5)
        ends.append(system.state.buffer.numpy().tobytes())
    assert ends[0] == ends[1]


def large(precision: str) -> Any:
    ends = [scenes.held("-x", 3), {"body": "b", "face": "+x", "traction": {"x": 0.01}}]
    return scenes.block(3, 30, run={"precision": precision}, tables={"boundary": ends})


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_an_undamped_body_is_measured_in_a_few_vectors(precision: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(krylov, "ROWS", 512)
    system = compose(large(precision)).bodies[0].system
    vector = system.count * system.space.dim * np.dtype(system.space.numpy).itemsize
    system.forget_motions()
    tracemalloc.start()
    try:
        assert isinstance(system, OneSetSystem)
        assert system.frequency > 0.0
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # Two of Lanczos' method, the forces at rest, a third for the roots of the masses; and the conversion of scalar products.
    assert peak < 3.6 * vector + 4e5


def test_at_the_start_it_is_measured_in_the_states_of_the_integrator(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(system: OneSetSystem) -> None:
        raise AssertionError("a state of its own is asked for")

    monkeypatch.setattr(OneSetSystem, "temporary", refused)
    with pytest.raises(AssertionError, match="of its own"):
        compose(scenes.block(2, 8, velocity=WAVES)).bodies[0].system.spares(2)
    run = compose(large("f32")).bodies[0]
    assert run.limit is not None
    assert run.limit > 0.8


def test_the_states_that_it_takes_are_zero_again() -> None:
    composition = compose(example("twisting_column").with_(**{"bodies.0.spacing": 0.5, "probes": []}))
    system = composition.bodies[0].system
    assert isinstance(system, OneSetSystem)
    (empty,) = system.spares(1)
    assert empty.buffer is composition.bodies[0].integrator.k.buffer  # pyright: ignore[reportAttributeAccessIssue]
    system.forget_motions()
    assert system.frequency > 0.0
    assert not empty.buffer.numpy().any()
