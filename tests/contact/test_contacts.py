"""Contact: coaxial bars, momentum, laws, self-contact of fragments, prescribed bodies, refusals."""

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
    meeting = {"between": [body["name"] for body in bodies], **(contact or {})}
    # Loss is what pinball contact is about.
    return wsph.run(scenes.scene(*bodies, run=run, contact=[meeting], output={"history": 1}, **tables), throw=False)


def mean_velocity(result: wsph.Result, body: int) -> float:
    return float(result.field("velocity_x")[result.field("body") == body].mean())


def test_equal_bars_part_after_two_transits_and_change_velocities() -> None:
    """Contact time 2 L/c0; the struck bar leaves with the velocity of the other."""
    result = impact(bar("a", 0.0, 1.0, velocity=SPEED), bar("b", 1.0, 2.0), end=3.0)
    contact = result.history["contact"]
    times = result.history["time"][contact > 0.01 * contact.max()]
    assert times[-1] - times[0] == pytest.approx(2.0, rel=0.02)
    assert mean_velocity(result, 1) == pytest.approx(SPEED, rel=0.02)
    assert mean_velocity(result, 0) == pytest.approx(0.0, abs=0.02 * SPEED)
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 2e-4 * energy["external_work"]
    # All that contact stored has come back.
    assert abs(energy["contact"]) < 1e-3 * energy["external_work"]


def test_the_restitution_of_unequal_bars_is_the_ratio_of_their_lengths() -> None:
    """Saint-Venant: a short bar stops; the long one leaves at L1/L2 of its velocity, which is the restitution."""
    result = impact(bar("a", 0.0, 1.0, velocity=SPEED), bar("b", 1.0, 3.0, cells=200), end=5.0)
    restitution = (mean_velocity(result, 1) - mean_velocity(result, 0)) / SPEED
    assert restitution == pytest.approx(0.5, abs=0.02)


@pytest.mark.filterwarnings("ignore:.*spurious modes")  # a few cells that meet at a corner or a point
@pytest.mark.parametrize("law", ["penalty", "pinball"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_is_kept_to_rounding_and_no_energy_is_made(law: str, friction: float, dim: int) -> None:
    def block(name: str, x: float, velocity: list[float]) -> dict:
        aside = 0.1 * (x > 0.0)
        shape = scenes.box((x, x + 1.0), *[(aside, 1.0 + aside)] * (dim - 1))
        return scenes.body(shape, 0.125, name, velocity=velocity[:dim], viscosity={"alpha": 0.5})

    result = impact(block("a", 0.0, [0.05, 0.02, 0.0]), block("b", 1.02, [-0.05, 0.0, 0.01]), end=4.0,
                    contact={"law": law, "friction": friction})  # fmt: skip
    history = result.history
    for axis in "xyz"[:dim]:
        assert np.ptp(history[f"momentum_{axis}"]) < 1e-14 * 0.05
    energy = result.summary["energy"]
    assert np.abs(history["contact"]).max() > 1e-3 * energy["external_work"]
    # In 3D pinball contact does not stop them, and the run ends where it says so.
    assert result.status == ("unstable" if (law, dim) == ("pinball", 3) else "completed")
    assert energy["residual"] > -2e-4 * energy["external_work"]
    assert energy["contact"] >= 0.0
    if law == "penalty":
        # They have parted.
        assert mean_velocity(result, 1) > mean_velocity(result, 0)


def test_pinball_contact_takes_energy_and_penalty_contact_gives_it_back() -> None:
    lost = {law: impact(bar("a", 0.0, 1.0, velocity=SPEED), bar("b", 1.0, 2.0), end=3.0, contact={"law": law}).summary["energy"] for law in ("penalty", "pinball")}  # fmt: skip
    work = lost["penalty"]["external_work"]
    assert abs(lost["penalty"]["contact"]) < 1e-3 * work
    assert lost["pinball"]["contact"] > 0.0


def test_a_body_that_is_driven_does_work_on_what_it_meets() -> None:
    driven = bar("a", 0.0, 0.2, cells=20, velocity=SPEED)
    boundary = [{"body": "a", "where": "x < 9", "velocity": {"x": SPEED}}]
    result = impact(driven, bar("b", 0.2, 1.2), end=1.0, boundary=boundary)
    # A wave of particle velocity v in half of the bar's 2 L/c: work v sigma t = rho c v^2 t.
    history = result.history
    gained = history["external_work"][-1] - history["external_work"][0]
    assert gained == pytest.approx(SPEED**2 * 1.0, rel=0.03)
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
    assert parting(contact=[{"self": "b"}]) == pytest.approx(0.1, rel=0.1)


def test_what_lies_on_each_other_from_the_start_is_refused() -> None:
    """Nodes on both sides of a crack: nothing says which way they part."""
    scene = scenes.scene(NOTCHED, run={"formulation": "stress-points", "cfl": 0.25}, contact=[{"self": "b"}])
    with pytest.raises(Refused, match=r"lie 0 m apart at \[0\.0, 0\.\d\] m.* leave a gap"):
        wsph.run(scene)


@pytest.mark.parametrize(("contact", "text"), [
    ({"between": ["a"]}, "between names two different bodies"),
    ({"between": ["a", "a"]}, 'write self = "a"'),
    ({"between": ["a", "c"]}, "no body is named 'c'"),
    ({}, 'contact.0: exactly one of between = .* and self'),
    ({"between": ["a", "b"], "law": "glue"}, "'glue' is none of"),
    ({"between": ["a", "b"], "friction": -1.0}, "contact.0.friction: -1.0: must be greater than or equal to 0"),
])  # fmt: skip
def test_what_a_scene_says_wrong_of_it(contact: dict, text: str) -> None:
    with pytest.raises(wsph.SceneError, match=text):
        pair({}, contact)


@pytest.mark.parametrize(
    ("integrator", "text"),
    [
        ("tsph", "contact pushes bodies whose particles move: use an integrator of one set"),
        ("lf4", "keeps variables of its own there: use leapfrog"),
    ],
)
def test_what_cannot_be_pushed_is_refused(integrator: str, text: str) -> None:
    scene = pair({"integrator": integrator}, {"between": ["a", "b"]})
    with pytest.raises(wsph.Refused, match=text):
        compose(scene)


def test_a_stiff_contact_lowers_the_limit() -> None:
    def limit(**contact: Any) -> float:
        parts = [{"between": ["a", "b"], **contact}] if contact else []
        return compose(pair({"formulation": "total-lagrangian", "cfl": 0.1}, *parts)).bodies[0].limit or 0.0

    assert limit() > limit(stiffness=1.0) > limit(stiffness=10.0)
