"""Rigid tools that meet each other: balls that roll, slide, bounce and stack, boxes on planes."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import Data, body, box, scene
from wsph.contact.tools.rigid import RigidBody
from wsph.simulation import run as running
from wsph.simulation.compose import compose

G, R = 9.81, 0.1


def tables(tools: list[Data], dim: int = 3, **run: Any) -> wsph.Scene:
    """Tools under gravity, in a scene whose one body stands still far away."""
    far = body(box(*[(10.0, 10.5)] * dim), 0.25)
    still = [{"body": "b", "where": "x > 0", "fixed": list("xyz"[:dim])}]
    keys = {"dt": 2e-3, "end": 1.0, **run}
    return scene(far, tools=tools, boundary=still, gravity={"xyz"[dim - 1]: -G}, run=keys)


def ran(made: wsph.Scene, monkeypatch: pytest.MonkeyPatch) -> tuple[dict[str, RigidBody], wsph.Result]:
    """The rigid bodies at the end of a run, and its result."""
    kept: list[Any] = []

    def keep(*those: Any) -> Any:
        kept.append(compose(*those))
        return kept[0]

    monkeypatch.setattr(running, "compose", keep)
    result = wsph.run(made)
    return dict(kept[0].joint.couplings[0].rigid), result


def speed(body: RigidBody) -> np.ndarray:
    """[m/s]"""
    return body.state.read("velocity")[0] * body.scales.velocity


def place(body: RigidBody) -> np.ndarray:
    """From where the body began [m]."""
    return (body.state.read("place")[0] - body.first.place) * body.scales.length


def slope(angle: float, friction: float, dim: int = 3) -> tuple[list[Data], np.ndarray]:
    """A ball on a plane that falls to -x, and the way down."""
    t = np.radians(angle)
    normal = np.array([-np.sin(t), 0.0, np.cos(t)] if dim == 3 else [-np.sin(t), np.cos(t)])
    down = np.array([-np.cos(t), 0.0, -np.sin(t)] if dim == 3 else [-np.cos(t), -np.sin(t)])
    plane = {"name": "slope", "shape": {"type": "plane", "point": [0.0] * dim, "normal": normal.tolist()}, "against": ["ball"],
             "friction": friction}  # fmt: skip
    ball = {"name": "ball", "shape": {"type": "sphere", "center": (R * normal).tolist(), "radius": R}, "mass": 2.0,
            "velocity": [0.0] * dim, "against": ["b"]}  # fmt: skip
    return [plane, ball], down


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
@pytest.mark.parametrize(("dim", "share"), [(3, 5.0 / 7.0), (2, 2.0 / 3.0)])
def test_a_ball_rolls_down_a_plane(dim: int, share: float, integrator: str, monkeypatch: pytest.MonkeyPatch):
    """a = g sin(20)/(1 + I/(m r^2)), omega r = v; the friction that it takes is below the limit, and takes nothing."""
    tools, down = slope(20.0, 0.3, dim)
    bodies, result = ran(tables(tools, dim, integrator=integrator), monkeypatch)
    ball = bodies["ball"]
    v = float(speed(ball)[:dim] @ down)
    assert v / result.time == pytest.approx(share * G * np.sin(np.radians(20.0)), rel=1e-3)
    L = ball.state.read("spin")[0] * ball.scales.density * ball.scales.length ** (dim + 2) / ball.scales.time
    inertia = (0.4 if dim == 3 else 0.5) * 2.0 * R**2
    assert np.linalg.norm(L) / inertia * R == pytest.approx(v, rel=1e-3)
    assert result.history["contact_dissipated"][-1] < 1e-3 * result.history["kinetic"][-1]
    assert abs(result.history["residual"][-1]) < 1e-4 * result.history["kinetic"][-1]


def test_a_ball_slides_where_friction_does_not_hold_it(monkeypatch: pytest.MonkeyPatch):
    """mu = .05 below 2/7 tan(20): a = g (sin - mu cos), omega grows by 5/2 mu g cos/r, and mu N times the slip is lost."""
    tools, down = slope(20.0, 0.05)
    bodies, result = ran(tables(tools), monkeypatch)
    t, time = np.radians(20.0), result.time
    assert float(speed(bodies["ball"]) @ down) / time == pytest.approx(G * (np.sin(t) - 0.05 * np.cos(t)), rel=1e-3)
    turned = 2.5 * 0.05 * G * np.cos(t) * time**2 / 2.0
    slip = G * (np.sin(t) - 0.05 * np.cos(t)) * time**2 / 2.0 - turned
    lost = 0.05 * 2.0 * G * np.cos(t) * slip
    assert result.history["contact_dissipated"][-1] == pytest.approx(lost, rel=1e-2)


def test_balls_stack_and_come_to_rest(monkeypatch: pytest.MonkeyPatch):
    """Three of unlike masses, one on another: the floor feels all their weight, each ball that of those above."""
    floor = {"name": "floor", "shape": {"type": "box", "from": [-1, -1, -1], "to": [1, 1, 0]}, "against": ["b"]}
    names, masses = ["one", "two", "three"], [1.0, 5.0, 2.0]
    balls = [
        {"name": name, "shape": {"type": "sphere", "center": [0, 0, R * (2 * k + 1)], "radius": R}, "mass": mass,
         "velocity": [0.0, 0.0, 0.0], "against": [["floor", *names][k]], "friction": 0.3}
        for k, (name, mass) in enumerate(zip(names, masses, strict=True))
    ]  # fmt: skip
    bodies, result = ran(tables([floor, *balls], end=3.0, dt=1e-3), monkeypatch)
    history = result.history
    assert history["tool_floor_z"][-1] == pytest.approx(8.0 * G, rel=1e-4)
    # What a ball does to all that it touches: down to the one below, up to the one above.
    assert history["tool_three_z"][-1] == pytest.approx(-2.0 * G, rel=1e-4)
    assert history["tool_two_z"][-1] == pytest.approx(-5.0 * G, rel=1e-4)
    for name in names:
        assert np.abs(speed(bodies[name])).max() < 1e-6
        assert np.abs(place(bodies[name])).max() < 5e-3


def test_balls_that_collide_keep_momentum_and_energy(monkeypatch: pytest.MonkeyPatch):
    """Head on and without friction, masses 1 and 3: the closed form of an elastic hit, to what a contact of one spring that
    opens inside of a step can make, (omega dt)^2/8."""

    def ball(name: str, x: float, v: float, mass: float, against: str) -> Data:
        return {"name": name, "shape": {"type": "sphere", "center": [x, 0, 0], "radius": R}, "mass": mass,
                "velocity": [v, 0, 0], "against": [against]}  # fmt: skip

    made = tables([ball("a", -0.15, 1.0, 1.0, "b"), ball("c", 0.15, 0.0, 3.0, "a")], end=0.4).with_(gravity={})
    bodies, result = ran(made, monkeypatch)
    a, c = speed(bodies["a"])[0], speed(bodies["c"])[0]
    assert a + 3.0 * c == pytest.approx(1.0, abs=1e-13)
    assert (a, c) == pytest.approx((-0.5, 0.5), abs=1e-2)
    assert result.history["kinetic"][-1] == pytest.approx(0.5, rel=2e-2)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_box_stands_on_a_plane_by_its_corners(dim: int, monkeypatch: pytest.MonkeyPatch):
    """Dropped turned it comes to rest flat; at rest the plane bears its weight."""
    normal = [0.0] * (dim - 1) + [1.0]
    plane = {
        "name": "plane",
        "shape": {"type": "plane", "point": [0.0] * dim, "normal": normal},
        "against": ["box"],
        "friction": 0.5,
    }
    low, high = [-0.2] * (dim - 1) + [0.06], [0.2] * (dim - 1) + [0.16]
    turn = 10.0 if dim == 2 else [[0, 1, 0], 10.0]
    block = {"name": "box", "shape": {"type": "box", "from": low, "to": high, "rotate": turn}, "mass": 3.0,
             "velocity": [0.0] * dim, "against": ["b"]}  # fmt: skip
    bodies, result = ran(tables([plane, block], dim, end=2.0), monkeypatch)
    up = "xyz"[dim - 1]
    assert result.history[f"tool_plane_{up}"][-1] == pytest.approx(3.0 * G, rel=1e-3)
    assert np.abs(speed(bodies["box"])).max() < 1e-4
    q = bodies["box"].state.read("turn")[0]
    assert 2.0 * np.degrees(np.arccos(min(abs(q[3]), 1.0))) == pytest.approx(10.0, abs=0.05)


def test_a_ball_rolls_in_a_bowl(monkeypatch: pytest.MonkeyPatch):
    """A ball inside of a larger one, without friction: a pendulum of the length of the difference of the radii."""
    bowl = {
        "name": "bowl",
        "shape": {"type": "sphere", "center": [0, 0, 0], "radius": 1.0},
        "inside": True,
        "against": ["ball"],
    }
    t = 0.05
    ball = {"name": "ball", "shape": {"type": "sphere", "center": [0.9 * np.sin(t), 0, -0.9 * np.cos(t)], "radius": R},
            "mass": 1.0, "velocity": [0, 0, 0], "against": ["b"]}  # fmt: skip
    half = np.pi * np.sqrt(0.9 / G)
    bodies, _ = ran(tables([bowl, ball], end=float(half)), monkeypatch)
    assert place(bodies["ball"])[0] == pytest.approx(-2.0 * 0.9 * np.sin(t), rel=5e-3)
