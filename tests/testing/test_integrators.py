"""The kit of integrators: what a third party's method may do, and what it is told of."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.boundary.test_reactions import ROUNDING, gap, works
from tests.distributions import install, seen
from tests.scenes import body, box, held, scene
from tests.testing.methods import LEAPS, SHU_OSHER
from wsph.simulation.compose import compose


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    yield from seen(tmp_path, monkeypatch)


def method(folder: Path, module: str, code: str) -> None:
    install(folder, f"wsph_{module}", "integrator", module, code)


def driven(**run: Any) -> wsph.Scene:
    """A plate held on the left, driven on the right and at last let go, loaded on top, guided below."""
    boundary = [
        held("-x", 2),
        {"body": "b", "face": "+x", "name": "driven", "velocity": {"x": "0.02*sin(3*t)"}},
        {"body": "b", "face": "+y", "name": "top", "traction": {"y": 3e-4, "x": 2e-4}},
        {"body": "b", "face": "-y", "symmetry": "y"},
    ]
    plate = body(box(1.0, 1.0), 0.25)
    return scene(
        plate, run={"integrator": "broken", "end": 1.0, "cfl": 0.2, **run}, boundary=boundary, output={"history": 1}
    )


@pytest.mark.parametrize(("module", "code"), [("shu_osher", SHU_OSHER), ("leaps", LEAPS)])
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_reactions_are_right_for_every_form_of_a_method(folder: Path, module: str, code: str, form: str) -> None:
    """They are the change of momentum, to rounding, and their works the external work, whatever went into the step."""
    method(folder, module, code)
    result = wsph.run(driven(formulation=form))
    assert gap(result, 2, np.zeros(2)) < ROUNDING
    external = result.history["external_work"] - result.history["external_work"][0]
    assert np.abs(external - works(result)).max() < 1e-12 * np.abs(external).max()
    assert abs(result.summary["energy"]["residual"]) < 0.02 * np.abs(external).max()


def test_along_faces_own_normals_too(folder: Path) -> None:
    method(folder, "shu_osher", SHU_OSHER)
    boundary = [
        {"body": "b", "where": "y < 0.001", "fixed": ["y"]},
        {"body": "b", "where": "abs(0.7*(x - 1) - 0.2*y) < 1e-6", "name": "slope", "normal": "-0.01*sin(3*t)"},
        {"body": "b", "where": "abs(0.7*x - 0.2*y) < 1e-6", "name": "other", "normal": 0.0},
    ]
    wedge = {"type": "polygon", "points": [[0.0, 0.0], [1.0, 0.0], [1.2, 0.7], [0.2, 0.7]]}
    run = {"integrator": "broken", "formulation": "stress-points", "end": 0.5, "cfl": 0.2}
    result = wsph.run(scene(body(wedge, 0.1, surface="fitted"), run=run, boundary=boundary, output={"history": 1}))
    assert gap(result, 2, np.zeros(2)) < ROUNDING


def test_resumed_it_is_the_straight_run(folder: Path, tmp_path: Path) -> None:
    method(folder, "leaps", LEAPS)
    whole = driven(formulation="total-lagrangian")
    straight = wsph.run(whole)
    wsph.run(whole.with_(end=0.5, checkpoint={"every": 10}), tmp_path / "out")
    resumed = wsph.run(whole, tmp_path / "out", resume=True)
    for name, values in straight.history.items():
        assert np.array_equal(values, resumed.history[name], equal_nan=True), name


@pytest.mark.parametrize("name", ["leapfrog", "rk4", "kg4-8", "rkc", "blanes-moan4"])
def test_ours_hand_nothing_on_and_pay_nothing(name: str) -> None:
    integrator: Any = {"name": name, "stages": 4} if name == "rkc" else name
    composition = compose(driven(integrator=integrator, formulation="total-lagrangian", guard="off"))
    before = len(composition.launches())
    composition.compile()
    assert len(composition.launches()) == before
