"""Contact: coaxial bars, momentum, laws, self-contact of fragments, prescribed bodies, refusals."""

from typing import Any

import numpy as np
import pytest

import wsph
from wsph.errors import Refused
from wsph.simulation.compose import compose

SOFT = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.0}
SPEED = 1e-3


def bar(name: str, start: float, end: float, *, cells: int = 100, velocity: float = 0.0, **body: Any) -> dict:
    """A 1D elastic bar of unit wave speed."""
    shape = {"type": "box", "min": [start], "max": [end]}
    return {"name": name, "shape": shape, "spacing": (end - start) / cells, "state": "stress", "velocity": [velocity], "material": SOFT, **body}  # fmt: skip


def impact(*bodies: dict, end: float, contact: dict | None = None, dim: int = 1, **keys: Any) -> wsph.Result:
    run = {"integrator": "leapfrog", "formulation": "total-lagrangian", "end": end, "cfl": 0.25, **keys.pop("run", {})}
    names = [body["name"] for body in bodies]
    meeting = {"between": names, **(contact or {})}
    # Loss is what pinball contact is about.
    return wsph.run(
        wsph.Scene(schema=1, dim=dim, run=run, bodies=list(bodies), contact=[meeting], output={"history": 1}, **keys),
        throw=False,
    )


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


@pytest.mark.parametrize("law", ["penalty", "pinball"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_is_kept_to_rounding_and_no_energy_is_made(law: str, friction: float, dim: int) -> None:
    def block(name: str, x: float, velocity: list[float]) -> dict:
        low, high = [x, *[0.1 * (x > 0.0)] * (dim - 1)], [x + 1.0, *[1.0 + 0.1 * (x > 0.0)] * (dim - 1)]
        body = {"name": name, "shape": {"type": "box", "min": low, "max": high}, "spacing": 0.125, "velocity": velocity[:dim],
                "material": {**SOFT, "poisson_ratio": 0.3}, "viscosity": {"alpha": 0.5}}  # fmt: skip
        return body | ({"state": "strain"} if dim == 2 else {})

    result = impact(block("a", 0.0, [0.05, 0.02, 0.0]), block("b", 1.02, [-0.05, 0.0, 0.01]), end=4.0, dim=dim,
                    contact={"law": law, "friction": friction})  # fmt: skip
    history = result.history
    for axis in "xyz"[:dim]:
        assert np.ptp(history[f"momentum_{axis}"]) < 1e-14 * 0.05
    energy = result.summary["energy"]
    assert np.abs(history["contact"]).max() > 1e-3 * energy["external_work"]
    assert energy["residual"] > -1e-4 * energy["external_work"]
    assert energy["contact"] > -1e-3 * energy["external_work"]
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


NOTCHED = {"name": "b", "shape": {"type": "box", "min": [-1.0, 0.0], "max": [1.0, 0.5]}, "spacing": 0.1, "state": "strain",
           "velocity": ["-0.05*x/max(abs(x), 0.01)", 0.0], "material": {**SOFT, "model": "jaumann"},
           "cracks": [{"from": [0.0, 0.0], "to": [0.0, 0.5]}]}  # fmt: skip


def box(left: float, right: float) -> dict:
    return {"type": "box", "min": [left, 0.0], "max": [right, 0.5]}


@pytest.mark.parametrize(("formulation", "keys"), [
    ("total-lagrangian", {}),
    ("stress-points", {"cracks": [], "shape": {"type": "union", "shapes": [box(-1.1, -0.1), box(0.1, 1.1)]}}),
])  # fmt: skip
def test_parts_of_a_body_meet_each_other(formulation: str, keys: dict) -> None:
    """Two halves fly at each other: without self-contact they pass."""
    body = NOTCHED | keys
    run = {"integrator": "leapfrog", "formulation": formulation, "end": 8.0, "cfl": 0.25}

    def parting(**keys: Any) -> float:
        result = wsph.run(wsph.Scene(schema=1, dim=2, run=run, bodies=[body], **keys))
        x, velocity = result.particles["position"][:, 0], result.field("velocity_x")
        return float(velocity[x > 0.01].mean() - velocity[x < -0.01].mean())

    assert parting() == pytest.approx(-0.1, rel=1e-6)
    assert parting(contact=[{"self": "b"}]) == pytest.approx(0.1, rel=0.1)


def test_what_lies_on_each_other_from_the_start_is_refused() -> None:
    """Nodes on both sides of a crack: nothing says which way they part."""
    run = {"integrator": "leapfrog", "formulation": "stress-points", "end": 1.0, "cfl": 0.25}
    with pytest.raises(Refused, match=r"lie 0 m apart at \[0\.0, 0\.\d\] m.* leave a gap"):
        wsph.run(wsph.Scene(schema=1, dim=2, run=run, bodies=[NOTCHED], contact=[{"self": "b"}]))


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
        wsph.Scene(schema=1, dim=1, run={"integrator": "leapfrog", "end": 1.0, "cfl": 0.2},
                   bodies=[bar("a", 0.0, 1.0), bar("b", 1.0, 2.0)], contact=[contact])  # fmt: skip


@pytest.mark.parametrize(
    ("integrator", "text"),
    [
        ("tsph", "contact pushes bodies whose particles move: use an integrator of one set"),
        ("lf4", "keeps variables of its own there: use leapfrog"),
    ],
)
def test_what_cannot_be_pushed_is_refused(integrator: str, text: str) -> None:
    bodies = [bar("a", 0.0, 1.0), bar("b", 1.0, 2.0)]
    scene = wsph.Scene(schema=1, dim=1, run={"integrator": integrator, "end": 1.0, "cfl": 0.2}, bodies=bodies, contact=[{"between": ["a", "b"]}])  # fmt: skip
    with pytest.raises(wsph.Refused, match=text):
        compose(scene)


def test_a_stiff_contact_lowers_the_limit() -> None:
    bodies = [bar("a", 0.0, 1.0), bar("b", 1.0, 2.0)]

    def limit(**contact: Any) -> float:
        run = {"integrator": "leapfrog", "formulation": "total-lagrangian", "end": 1.0, "cfl": 0.1}
        parts = [{"between": ["a", "b"], **contact}] if contact else []
        return compose(wsph.Scene(schema=1, dim=1, run=run, bodies=bodies, contact=parts)).bodies[0].limit or 0.0

    assert limit() > limit(stiffness=1.0) > limit(stiffness=10.0)
