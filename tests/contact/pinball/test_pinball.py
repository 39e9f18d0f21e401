"""Contact between balls: coaxial bars, momentum, self-contact of fragments, prescribed bodies, refusals."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Refused
from wsph.simulation.compose import compose

SOFT = scenes.material(poisson_ratio=0.0)
SPEED = 1e-3


def bar(name: str, start: float, end: float, *, cells: int = 100, velocity: float = 0.0, **body: Any) -> dict:
    """A 1D elastic bar of unit wave speed."""
    keys = {"state": "stress", "velocity": [velocity], "material": SOFT, **body}
    return scenes.body(scenes.box((start, end)), (end - start) / cells, name, **keys)


def pair(run: dict | None = None, *contacts: dict, **tables: Any) -> wsph.Scene:
    """Two bars, one behind the other."""
    return scenes.scene(
        bar("a", 0.0, 1.0), bar("b", 1.0, 2.0), run={"cfl": 0.2, **(run or {})}, contact=list(contacts), **tables
    )


def impact(*bodies: dict, end: float, contact: dict | None = None, **tables: Any) -> wsph.Result:
    """A run of two bodies that meet."""
    run = {"formulation": "total-lagrangian", "end": end, "cfl": 0.25}
    meeting = {"between": [body["name"] for body in bodies], "law": "pinball", **(contact or {})}
    # Loss is what pinball contact is about.
    return wsph.run(scenes.scene(*bodies, run=run, contact=[meeting], output={"history": 1}, **tables), throw=False)


def mean_velocity(result: wsph.Result, body: int) -> float:
    return float(result.field("velocity_x")[result.field("body") == body].mean())


def test_bars_take_the_momentum_of_each_other_and_lose_energy() -> None:
    """Of equal bars the struck one leaves with most of the velocity of the other, and of what they lose none comes back."""
    result = impact(bar("a", 0.0, 1.0, velocity=SPEED), bar("b", 1.0, 2.0), end=3.0)
    assert 0.7 * SPEED < mean_velocity(result, 1) < SPEED
    assert mean_velocity(result, 0) + mean_velocity(result, 1) == pytest.approx(SPEED, rel=1e-12)
    energy, history = result.summary["energy"], result.history
    lost = energy["contact_dissipated"]
    assert 0.02 * energy["external_work"] < lost < 0.4 * energy["external_work"]
    assert (np.diff(history["contact_dissipated"]) > -1e-9 * lost).all()
    assert (history["contact"] == history["contact_dissipated"]).all()
    assert abs(energy["residual"]) < 2e-4 * energy["external_work"]


@pytest.mark.filterwarnings("ignore:.*spurious modes")  # a few cells that meet at a corner or a point
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_is_kept_to_rounding_and_no_energy_is_made(friction: float, dim: int) -> None:
    def block(name: str, x: float, velocity: list[float]) -> dict:
        aside = 0.1 * (x > 0.0)
        shape = scenes.box((x, x + 1.0), *[(aside, 1.0 + aside)] * (dim - 1))
        return scenes.body(shape, 0.125, name, velocity=velocity[:dim], viscosity={"alpha": 0.5})

    result = impact(block("a", 0.0, [0.05, 0.02, 0.0]), block("b", 1.02, [-0.05, 0.0, 0.01]), end=4.0,
                    contact={"friction": friction})  # fmt: skip
    history = result.history
    for axis in "xyz"[:dim]:
        assert np.ptp(history[f"momentum_{axis}"]) < 1e-14 * 0.05
    energy = result.summary["energy"]
    assert np.abs(history["contact"]).max() > 1e-3 * energy["external_work"]
    # In 3D pinball contact does not stop them, and the run ends where it says so.
    assert result.status == ("unstable" if dim == 3 else "completed")
    assert energy["residual"] > -2e-4 * energy["external_work"]
    assert energy["contact"] >= 0.0


def test_a_body_that_is_driven_does_work_on_what_it_meets() -> None:
    driven = bar("a", 0.0, 0.2, cells=20, velocity=SPEED)
    boundary = [{"body": "a", "where": "x < 9", "velocity": {"x": SPEED}}]
    result = impact(driven, bar("b", 0.2, 1.2), end=1.0, boundary=boundary)
    # A wave of particle velocity v takes the work v sigma t = rho c v^2 t; balls, which let go between blows, some less.
    history = result.history
    gained = history["external_work"][-1] - history["external_work"][0]
    assert 0.5 * SPEED**2 < gained < SPEED**2
    assert history["contact_dissipated"][-1] > 0.05 * gained
    assert abs(history["residual"][-1]) < 1e-3 * gained
    assert (result.field("velocity_x")[result.field("body") == 0] == SPEED).all()


NOTCHED = scenes.body(scenes.box((-1.0, 1.0), 0.5), 0.1, velocity=["-0.05*x/max(abs(x), 0.01)", 0.0],
                      material=scenes.material("jaumann", poisson_ratio=0.0), cracks=[{"from": [0.0, 0.0], "to": [0.0, 0.5]}])  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*spurious modes")  # a few cells that meet at a corner or a point
@pytest.mark.parametrize(("formulation", "keys"), [
    ("total-lagrangian", {}),
    ("stress-points", {"cracks": [], "shape": {"type": "union", "shapes": [scenes.box((-1.1, -0.1), 0.5), scenes.box((0.1, 1.1), 0.5)]}}),
])  # fmt: skip
def test_parts_of_a_body_meet_each_other(formulation: str, keys: dict) -> None:
    """Two halves fly at each other: without self-contact they pass."""
    body = NOTCHED | keys

    def parting(**tables: Any) -> float:
        result = wsph.run(scenes.scene(body, run={"formulation": formulation, "end": 8.0, "cfl": 0.25}, **tables))
        x, velocity = result.particles["position"][:, 0], result.field("velocity_x")
        return float(velocity[x > 0.01].mean() - velocity[x < -0.01].mean())

    assert parting() == pytest.approx(-0.1, rel=1e-6)
    # They bounce, and lose by it.
    assert 0.02 < parting(contact=[{"self": "b", "law": "pinball"}]) < 0.1


def test_what_lies_on_each_other_from_the_start_is_refused() -> None:
    """Nodes on both sides of a crack: nothing says which way they part."""
    scene = scenes.scene(
        NOTCHED, run={"formulation": "stress-points", "cfl": 0.25}, contact=[{"self": "b", "law": "pinball"}]
    )
    with pytest.raises(Refused, match=r"lie 0 m apart at \[0\.0, 0\.\d\] m.* leave a gap"):
        wsph.run(scene)


def test_a_method_with_variables_of_its_own_between_steps_is_refused() -> None:
    scene = pair({"integrator": "lf4"}, {"between": ["a", "b"], "law": "pinball"})
    with pytest.raises(Refused, match="keeps variables of its own there: use leapfrog"):
        compose(scene)


def test_a_stiff_contact_lowers_the_limit() -> None:
    def limit(**contact: Any) -> float:
        parts = [{"between": ["a", "b"], "law": "pinball", **contact}] if contact else []
        return compose(pair({"formulation": "total-lagrangian", "cfl": 0.1}, *parts)).bodies[0].limit or 0.0

    assert limit() > limit(stiffness=1.0) > limit(stiffness=10.0)
