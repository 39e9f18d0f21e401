"""The kit of integrators: what a third party's method may do, and what it is told of."""

import shutil
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
from wsph.testing import check_integrator, check_limit, check_reactions, spectral_radius, vibrating_bar


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    yield from seen(tmp_path, monkeypatch)


def method(folder: Path, module: str, code: str) -> None:
    for old in folder.glob("*.dist-info"):
        shutil.rmtree(old)
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


def test_the_kit_passes_the_form_of_the_paper_and_fails_a_limit_that_is_too_large(folder: Path) -> None:
    method(folder, "shu_osher", SHU_OSHER)
    check_integrator("broken", order=3, tolerance=1.1)
    method(folder, "large", SHU_OSHER.replace("share = 1.0", "share = 1.6"))
    with pytest.raises(AssertionError, match=r"limit\(\) is a Courant number of .*it holds up to "):
        check_limit("broken")
    method(folder, "small", SHU_OSHER.replace("share = 1.0", "share = 0.4"))
    with pytest.warns(RuntimeWarning, match="far too small"):
        check_limit("broken")


def test_the_kit_fails_a_wrong_reaction(folder: Path) -> None:
    """A stage copied past `combine`: what was set in it reaches the state unseen."""
    past = SHU_OSHER.replace("s.accept(y)", "s.impose(y, 1.0)\n        s.accept(y)")
    method(folder, "past", past)
    check_reactions("broken", 0.1)  # it is seen: it is right
    method(
        folder,
        "unseen",
        past.replace("s.impose(y, 1.0)", "wp.copy(y.buffer, self.u1.buffer)\n").replace(
            "import numpy", "import warp as wp\nimport numpy"
        ),
    )
    with pytest.raises(AssertionError, match="reactions of a held end"):
        check_reactions("broken", 0.1)


def test_a_run_that_made_energy_below_a_limit_says_whose_claim_that_is(folder: Path) -> None:
    method(folder, "large", SHU_OSHER.replace("share = 1.0", "share = 1.6"))
    composition = compose(driven(formulation="total-lagrangian"))
    limit = composition.bodies[0].limit
    assert limit is not None
    with pytest.raises(wsph.Unstable, match=r"limit \d\.\d+ \(the integrator's own claim, which may be wrong"):
        wsph.run(driven(formulation="total-lagrangian", cfl=0.95 * limit, end=100.0))
    rk4 = driven(integrator="rk4", formulation="total-lagrangian", cfl=3.0, end=100.0, guard="off")
    with pytest.raises(wsph.Unstable) as stopped:
        wsph.run(rk4)
    assert "claim" not in str(stopped.value)


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
@pytest.mark.parametrize(
    ("name", "reach", "grows"),
    [("leapfrog", 2.0, 1.03), ("lf4", 3.464, 1.03), ("blanes-moan4", 3.163, 1.65), ("rk4", 2.828, 1.03)],
)
def test_spectral_radii_are_of_all_that_a_method_keeps(name: str, reach: float, grows: float, form: str) -> None:
    """At 0.97 of the reach of the fastest wave nothing grows, beyond it something does, whatever is kept between steps:
    without an amplitude that one has to know. (Of blanes-moan4 waves are held again up to omega dt = 5.03.)"""
    frequency = compose(vibrating_bar(name, cells=10, formulation=form)).bodies[0].system.frequency
    courant = [part * reach / frequency for part in (0.1, 0.5, 0.97, grows)]
    scenes = [vibrating_bar(name, cells=10, courant=c, formulation=form, amplitude=0.1, periods=10.0) for c in courant]
    slow, middle, near, beyond = (spectral_radius(each) - 1.0 for each in scenes)
    assert max(slow, middle, near) < 1e-8
    assert beyond > 1e-3
