"""The paper's form of a bar: full neighbourhoods at its ends."""

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose
from wsph.validation.case import example


def bar(**changes: object) -> wsph.Scene:
    """The magnesium bar without viscosity."""
    data = example("magnesium_bar").data()
    del data["bodies"][0]["viscosity"]
    data["run"] |= {"integrator": "leapfrog"}
    return wsph.Scene(**data).with_(**changes)


def test_the_fastest_wave_is_that_of_the_interior() -> None:
    """Leapfrog holds 2.87 for h = 1.5 spacings; without ghosts the loaded end is 56 % stiffer."""
    limits = []
    for correction in ("paper", "symmetric"):
        system = compose(bar(**{"run.correction": correction, "bodies.0.residual": False})).bodies[0].system
        limits.append(2.0 / (system.frequency * system.bar_time))
    assert limits[0] == pytest.approx(2.87, rel=5e-3)
    assert limits[1] < 0.7 * limits[0]


def test_ghosts_hand_the_load_on() -> None:
    """Momentum is load times time, exactly; the right end is out of reach."""
    composition = compose(bar())
    composition.compile()
    composition.program.run(200)
    system, s = composition.bodies[0].system, composition.scales
    momentum = (system.density * system.volume) @ system.state.read("velocity")[:, 0]
    assert momentum * s.density * s.length * s.velocity == pytest.approx(8.8436e6 * 200 * composition.dt, rel=1e-10)


def test_what_the_papers_form_is_not_made_for_is_refused() -> None:
    run = {"formulation": "total-lagrangian", "correction": "paper", "cfl": 0.5}
    load = {"boundary": [{"body": "b", "face": "+x", "traction": {"x": 1.0}}]}
    with pytest.raises(wsph.Refused, match="only bars have ghosts"):
        compose(scenes.block(run=run, tables=load, state="stress"))
    for key, value in (("residual", {"coefficient": 1.0}), ("hourglass", {"coefficient": 0.1}), ("placement", "nodes")):
        with pytest.raises(wsph.Refused, match="with particles in the cells, without residual"):
            compose(bar(**{f"bodies.0.{key}": value}))
    with pytest.raises(wsph.Refused, match="with particles in the cells"):
        compose(bar(**{"run.formulation": "stress-points", "run.support": 1.8}))


@pytest.mark.parametrize("face", ["-x", "+x"])
def test_ends_without_a_load(face: str) -> None:
    """A bar that flies against a wall: behind the front stands rho c v, on either side; the other end is free."""
    sign = 1.0 if face == "-x" else -1.0
    hold = [{"body": "bar", "face": face, "fixed": ["x"]}]
    keys = {"bodies.0.viscosity": {"alpha": 1.0}, "run.integrator": {"name": "leapfrog", "lagged": True}}
    scene = example("magnesium_bar").with_(boundary=hold, probes=[], end=1e-4, dt=2e-7, **keys)
    result = wsph.run(scene.with_(**{"bodies.0.velocity": [str(-sign)]}))
    x = result.particles["position"][:, 0] if face == "-x" else 1.0 - result.particles["position"][:, 0]
    behind = (x > 0.1) & (x < 0.3)
    assert -result.particles["stress"][behind, 0] == pytest.approx(np.sqrt(45e9 * 1738.0), rel=0.02)
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 0.01 * energy["external_work"]


def test_a_pushed_end_has_no_ghosts() -> None:
    with pytest.raises(wsph.Refused, match="takes ends that are loaded or held"):
        compose(bar(boundary=[{"body": "bar", "face": "-x", "velocity": {"x": 1.0}}]))


def test_a_map_has_no_ghosts() -> None:
    with pytest.raises(wsph.Refused, match="needs a regular lattice, without `map`"):
        compose(bar(**{"bodies.0.map": ["x*(1+x)/2"]}))


def test_table_1_to_the_third_digit() -> None:
    result = wsph.run(example("magnesium_bar"))
    x, v = result.particles["position"][:, 0], result.particles["velocity"][:, 0]
    exact = (x < np.sqrt(45e9 / 1738.0) * result.time).astype(float)
    assert np.abs(v - exact).sum() / exact.sum() == pytest.approx(0.0872, abs=2e-4)
    assert np.linalg.norm(v - exact) / np.linalg.norm(exact) == pytest.approx(0.1594, abs=2e-4)
