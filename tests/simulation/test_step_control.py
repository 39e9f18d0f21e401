"""The time step of a run: what `cfl = "auto"` takes, that a run keeps to it, and where it says no."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from wsph.simulation.compose import compose

MATERIAL = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}


def bar(name: str = "a", start: float = 0.0, **keys: Any) -> dict[str, Any]:
    """A bar of length 1 in uniaxial strain."""
    shape = {"type": "box", "min": [start], "max": [start + 1.0]}
    return {"name": name, "shape": shape, "spacing": 0.05, "state": "strain", "velocity": ["0.01*x"], "material": MATERIAL, **keys}  # fmt: skip


def square(**keys: Any) -> dict[str, Any]:
    """A square in plane strain."""
    shape = {"type": "box", "min": [0.0, 0.0], "max": [1.0, 1.0]}
    return {"name": "b", "shape": shape, "spacing": 0.125, "state": "strain", "velocity": ["0.01*x", "0"], "material": MATERIAL, **keys}  # fmt: skip


def scene(*bodies: dict[str, Any], integrator: Any = "leapfrog", run: dict[str, Any] | None = None, **keys: Any) -> wsph.Scene:  # fmt: skip
    dim = len(bodies[0]["shape"]["min"])
    settings = {"integrator": integrator, "end": 0.5, "cfl": "auto", **(run or {})}
    return wsph.Scene(schema=1, dim=dim, run=settings, bodies=list(bodies), **keys)


@pytest.mark.parametrize("formulation", ["stress-points", "total-lagrangian"])
def test_it_is_a_share_of_the_limit(formulation: str) -> None:
    composition = compose(scene(square(), run={"formulation": formulation}))
    run = composition.bodies[0]
    assert run.limit is not None
    assert run.courant == pytest.approx(0.95 * run.limit, rel=1e-12)
    assert composition.dt == composition.time_step.timeline.dt
    assert composition.clock.dt * composition.scales.time == pytest.approx(composition.dt, rel=1e-15)


def test_a_number_in_its_place_gives_the_same_bits() -> None:
    left = scene(square())
    courant = compose(left).clock.dt
    one, other = wsph.run(left), wsph.run(left.with_(cfl=courant))
    assert one.summary["dt"] == other.summary["dt"]
    for name, values in one.particles.items():
        np.testing.assert_array_equal(values, other.particles[name])


def test_bodies_share_the_smallest_step() -> None:
    stiff = bar("c", 2.0, spacing=0.02, material={**MATERIAL, "youngs_modulus": 4.0})
    together = compose(scene(bar(), stiff))
    alone = [compose(scene(body)).dt for body in (bar(), stiff)]
    assert together.dt == pytest.approx(min(alone), rel=1e-12)
    assert alone[1] < 0.5 * alone[0]
    for run in together.bodies:
        assert run.courant <= 0.95 * (run.limit or 0.0) * (1.0 + 1e-12)


@pytest.mark.parametrize("bodies", [[bar()], [bar(), bar("c", 2.0, material={**MATERIAL, "youngs_modulus": 4.0})]])
def test_taylor_sph_on_an_even_bar_takes_the_step_at_which_it_is_exact(bodies: list[dict[str, Any]]) -> None:
    composition = compose(scene(*bodies, integrator="tsph"))
    assert composition.clock.dt == 1.0
    assert composition.dt == composition.scales.time
    assert max(run.courant for run in composition.bodies) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("body", "integrator", "run"),
    [
        (bar(jitter=0.1), "tsph", {"support": 1.8}),
        (bar(), "tsph", {"support": 1.8}),
        (square(), "tsph", {}),
        (bar(), "ul-tsph", {}),
    ],
    ids=["jitter", "wide support", "two dimensions", "moving"],
)
def test_where_it_is_not_exact_it_takes_a_share(body: dict[str, Any], integrator: str, run: dict[str, Any]) -> None:
    found = compose(scene(body, integrator=integrator, run={**run, "guard": "off"})).bodies[0]
    assert found.courant == pytest.approx(0.95 * (found.limit or 0.0), rel=1e-12)


def test_contact_leaves_room_for_what_opens_and_closes_inside_of_a_step() -> None:
    touching = scene(bar(velocity=["0.02"]), bar("c", 1.05, velocity=["0"]), contact=[{"between": ["a", "c"]}])
    composition = compose(touching)
    for run in composition.bodies:
        assert "what acts between bodies" in run.limit_reason
        assert run.courant == pytest.approx(0.7 * (run.limit or 0.0), rel=1e-9)  # the smaller of both limits
    # 0.2 % made is what this share of the bound allows.
    result = wsph.run(touching.with_(end=2.0))
    assert result.summary["energy"]["residual"] > -2e-3 * result.summary["energy"]["external_work"]


def test_a_material_with_a_limit_of_its_own_is_heeded() -> None:
    material = {**MATERIAL, "model": "perzyna", "yield_stress": 1e-3, "hardening_modulus": 0.0, "fluidity": 50.0, "exponent": 1.0}  # fmt: skip
    run = compose(scene(square(material=material))).bodies[0]
    longest = run.longest_steps["perzyna"]
    assert longest < 0.9 * (run.limit or 0.0) * run.system.spacing / run.constitutive.wave_speed
    assert run.time_step.dt == pytest.approx(0.95 * longest, rel=1e-12)


@pytest.mark.parametrize("integrator", ["leapfrog", "lf4"])
def test_a_resumed_run_keeps_it(integrator: str, tmp_path: Path) -> None:
    whole = scene(square(), integrator=integrator, run={"formulation": "total-lagrangian", "end": 2.0}, output={"history": 1}, checkpoint={"every": 3})  # fmt: skip
    straight = wsph.run(whole)
    wsph.run(whole.with_(end=1.0), tmp_path / "out")
    resumed = wsph.run(whole, tmp_path / "out", resume=True)
    for name, values in straight.history.items():
        np.testing.assert_array_equal(resumed.history[name], values)
    for name, values in straight.particles.items():
        np.testing.assert_array_equal(resumed.particles[name], values)


def test_it_follows_the_deformation() -> None:
    """As with a number: what a squeezed body's limit loses, the step loses."""
    squeezed = scene(square(velocity=["-0.4*x", "0"], material={**MATERIAL, "model": "neo-hookean"}), run={"end": 1.0},
                     boundary=[{"body": "b", "face": "+x", "velocity": {"x": -0.4}}, {"body": "b", "face": "-x", "fixed": ["x"]}],
                     output={"history": 1})  # fmt: skip
    steps = wsph.run(squeezed).history["dt"]
    assert steps[-1] < steps[0]


@pytest.mark.parametrize(
    ("body", "integrator", "words"),
    [
        (square(), "euler", r'run\.cfl = "auto": body \'b\' has no stable time step with integrator \'euler\'.* give run\.cfl or run\.dt'),
        (square(viscosity={"alpha": 5.0, "kind": "pair"}), "rkc", r"integrator 'rkc' .* asks for the time step, for its stages, before its limit is known: give stages, run\.cfl or run\.dt a number"),
    ],
    ids=["no limit", "limit of the step itself"],
)  # fmt: skip
def test_what_has_no_limit_to_go_by_is_refused(body: dict[str, Any], integrator: str, words: str) -> None:
    with pytest.raises(wsph.Refused, match=words):
        compose(scene(body, integrator=integrator, run={"formulation": "total-lagrangian"}))


def test_an_integrator_without_a_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from wsph_integrators.symplectic import Leapfrog

    monkeypatch.delattr(Leapfrog, "limit")
    with pytest.raises(wsph.Refused, match=r"has no limit to go by \(the integrator declares none\): give run\.cfl"):
        compose(scene(square()))


def test_stages_by_number_have_a_limit() -> None:
    body = square(viscosity={"alpha": 5.0, "kind": "pair"})
    run = compose(scene(body, integrator={"name": "rkc", "stages": 5}, run={"formulation": "total-lagrangian"})).bodies[0]  # fmt: skip
    assert run.courant == pytest.approx(0.95 * (run.limit or 0.0), rel=1e-12)


@pytest.mark.parametrize(
    ("courant", "words"),
    [("automatic", "'automatic' is a string; this is a plain number"), (0.0, "must be greater than 0")],
)
def test_what_is_neither_a_number_nor_auto_is_a_fault(courant: Any, words: str) -> None:
    with pytest.raises(wsph.SceneError, match=rf"^scene: run\.cfl: .*{words}"):
        scene(square(), run={"cfl": courant})
