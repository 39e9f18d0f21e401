"""Motions, supports and forces of regions where bodies begin at rest, from a file or in steps: what waits, what acts, and
what is refused by name."""

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Refused, SceneError, Unstable
from wsph.simulation.starting import relaxation

FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "updated-lagrangian"},
    {"integrator": "rk4"},
]
STEPS = [{"name": "first", "duration": 0.5}, {"name": "second", "duration": 1.0}]
GRAVITY = 1e-4


def column(boundary: list[Any], run: dict[str, Any] | None = None, tables: Any = None, **keys: Any) -> wsph.Scene:
    """A bar along its weight, which comes to rest before t = 0."""
    probe = {"name": "bar", "at": [[0.0], [1.0]], "fields": ["displacement", "velocity"], "every": 1}
    given = {"boundary": boundary, "gravity": {"x": -GRAVITY}, "relax": {}, "probes": [probe], **(tables or {})}
    given = {"output": {"history": 1, "fields": ["displacement", "velocity"]}, **given}
    return scenes.bar(20, run={"cfl": 0.4, "end": 0.5, **(run or {})}, tables=given, **keys)


def at(result: wsph.Result, end: int, field: str = "displacement_x") -> np.ndarray:
    """What the probe has of the foot (0) or of the top (1)."""
    return result.probes["bar"][f"{field}[{end}]"]


@pytest.mark.parametrize("run", FORMS, ids=str)
@pytest.mark.parametrize("motion", [{"displacement": "0.01*sin(3*t)"}, {"acceleration": "0.3*cos(5*t)"}], ids=str)
def test_motions_wait_for_the_clock(run: dict[str, Any], motion: dict[str, str]) -> None:
    """The foot stays where it is while the bar comes to rest on it, and is then where it is said to be, to rounding."""
    (key, value), *_ = motion.items()
    result = wsph.run(column([{"body": "b", "face": "-x", key: {"x": value}}], run))
    assert result.summary["relaxation"]["status"] == "at rest"
    assert at(result, 1)[0] == pytest.approx(-GRAVITY / 2.0, rel=5e-3)
    t = result.probes["bar"]["time"]
    way = 0.01 * np.sin(3.0 * t) if key == "displacement" else 0.012 * (1.0 - np.cos(5.0 * t))
    if run.get("formulation") == "stress-points" or "integrator" in run:
        assert at(result, 0) == pytest.approx(way, rel=1e-12, abs=1e-16)
    else:
        # Particles half a cell inside of a wall, or probes beside nodes.
        assert at(result, 0) == pytest.approx(way, abs=0.15 * np.abs(way).max())
    assert np.abs(result.history["residual"]).max() < 5e-2 * result.history["external_work"].max()


def test_what_is_accelerated_goes_on_from_the_velocity_that_comes_after_the_rest() -> None:
    """A bar that hangs on nothing but what accelerates it by nothing flies on."""
    foot = [{"body": "b", "face": "-x", "acceleration": {"x": 0.0}}]
    result = wsph.run(column(foot, tables={"gravity": {}}, velocity=["0.2"]))
    assert result.particles["velocity"][:, 0] == pytest.approx(0.2, rel=1e-12)
    assert at(result, 0) == pytest.approx(0.2 * result.probes["bar"]["time"], rel=1e-12, abs=1e-16)


@pytest.mark.parametrize("run", FORMS, ids=str)
@pytest.mark.parametrize("damping", [0.3, 10.0])
def test_dashpots_wait_and_springs_bear(run: dict[str, Any], damping: float) -> None:
    """u = -g/k at the foot and g/2 more at the top. A dashpot that would let it creep there, at a speed that looks like
    rest, does not act before t = 0."""
    spring = {"stiffness": 0.5, "damping": damping}
    result = wsph.run(column([{"body": "b", "face": "-x", "spring": spring}], {**run, "cfl": 0.04, "end": 0.1}))
    assert at(result, 0)[0] == pytest.approx(-2.0 * GRAVITY, rel=5e-2)
    assert at(result, 1)[0] == pytest.approx(-2.5 * GRAVITY, rel=2e-2)
    history = result.history
    assert history["dissipated"][0] == 0.0
    # What the springs hold is there from the start: g^2/(2 k), and g^2/6 in the bar.
    assert history["strain"][0] == pytest.approx(GRAVITY**2 * (1.0 + 1.0 / 6.0), rel=3e-2)
    assert np.abs(history["residual"]).max() < 1e-3 * history["strain"][0]


def test_quiet_faces_hold_nothing_and_let_out_what_comes_after() -> None:
    quiet, held = {"body": "b", "face": "-x", "quiet": True}, scenes.held("-x", 1)
    with pytest.raises(Unstable, match="none has passed a peak, as of a body that nothing holds"):
        wsph.run(column([quiet], tables={"relax": {"max_steps": 200}}))
    top = {**quiet, "face": "+x"}
    result = wsph.run(column([held, top], {"end": 3.0}, velocity=["1e-3*exp(-((x - 0.5)/0.1)^2)"]))
    assert at(result, 1)[0] == pytest.approx(-GRAVITY / 2.0, rel=5e-3)
    # Nothing was lost in coming to rest; then what flies there leaves.
    history = result.history
    assert history["dissipated"][0] == 0.0
    assert history["dissipated"][-1] > 0.9 * history["kinetic"][0]


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_periodic_faces_come_to_rest_as_one(form: str) -> None:
    """A layer of soil under its weight: u = -g/(2 M), M of uniaxial strain."""
    made = scenes.body(scenes.box((0.0, 0.5), (0.0, 1.0)), 0.1, state="strain")
    sides = [{"body": "b", "face": "+x", "periodic": "-x"}, scenes.held("-y", 2)]
    result = wsph.run(scenes.scene(made, run={"formulation": form, "cfl": 0.4, "end": 0.1}, boundary=sides, relax={},
                                   gravity={"y": -GRAVITY}, output={"fields": ["displacement"]}))  # fmt: skip
    ratio = scenes.material()["poisson_ratio"]
    modulus = (1.0 - ratio) / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    place, moved = result.particles["position"], result.particles["displacement"]
    top = place[:, 1] > 0.99
    assert moved[top, 1] == pytest.approx(-GRAVITY / (2.0 * modulus), rel=2e-2)
    left, right = (moved[np.abs(place[:, 0] - x) < 1e-6] for x in (0.0, 0.5))
    assert (np.sort(left[:, 1]) == np.sort(right[:, 1])).all()
    assert result.summary["relaxation"]["out_of_balance_part"] < 2e-2


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_forces_of_regions_are_those_of_the_start(run: dict[str, Any]) -> None:
    """Gravity by an expression and a force per volume, each half of the weight at t = 0."""
    tables = {"gravity": {"x": f"-{GRAVITY / 2}*(1 + 9*t)"}}
    force = {"x": f"-{GRAVITY / 2}*(1 - 9*t)"}
    result = wsph.run(column([scenes.held("-x", 1)], run, tables, body_force=force))
    assert at(result, 1) == pytest.approx(-GRAVITY / 2.0, rel=5e-3)
    assert result.history["external_work"][-1] == pytest.approx(result.history["strain"][0], rel=1e-2)


def test_a_body_rests_on_a_tool_that_waits() -> None:
    floor = {"name": "floor", "shape": {"type": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]}, "against": ["b"]}
    block = scenes.body(scenes.box(1.0, 0.5), 0.125, material=scenes.material(poisson_ratio=0.0))
    told = {"name": "told", "of": "floor", "fields": ["force", "work"], "every": 1}
    tables = {
        "gravity": {"y": -1e-3},
        "probes": [told],
        "relax": {"until": 1e-5},
        "output": {"fields": ["displacement"]},
    }
    tools = [{**floor, "velocity": {"y": 0.01}}]
    result = wsph.run(scenes.scene(block, run={"cfl": 0.2, "end": 0.02}, tools=tools, **tables))
    assert result.probes["told"]["force_y"][0] == pytest.approx(0.5e-3, rel=2e-2)
    assert result.probes["told"]["work"][0] == 0.0
    # It would have gone up by a tenth and more.
    assert np.abs(result.particles["displacement"][:, 1]).max() < 2e-3
    # One that stands goes on carrying it.
    stands = wsph.run(scenes.scene(block, run={"cfl": 0.2, "end": 0.5}, tools=[floor], **tables))
    assert stands.probes["told"]["force_y"] == pytest.approx(0.5e-3, rel=5e-2)
    free = {"name": "floor", "shape": {"type": "disc", "center": [0.5, 0.7], "radius": 0.2}, "mass": 1.0}
    with pytest.raises(Refused, match="relax: 'floor' moves by itself"):
        wsph.run(scenes.scene(block, run={"end": 0.02}, tools=[{**floor, **free}], **tables))


def stepped(scene: wsph.Scene, boundary: list[Any], steps: list[Any] = STEPS) -> wsph.Scene:
    """A scene in steps, which alone come to rest."""
    data = scene.data()
    del data["run"]["end"], data["relax"]
    return wsph.Scene(**{**data, "boundary": boundary, "steps": steps})


RESTS = [STEPS[0], {**STEPS[1], "relax": {"until": 1e-4}}]


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_a_motion_goes_on_after_a_rest_before_a_step(run: dict[str, Any]) -> None:
    """A displacement of the whole run is where it is said to be after the bodies came to rest in its middle."""
    ends = [scenes.held("-x", 1), {"body": "b", "face": "+x", "displacement": {"x": "0.01*sin(2*t)"}}]
    sprung = {"body": "b", "face": "-x", "spring": {"stiffness": 0.5, "damping": 0.1}}
    result = wsph.run(stepped(column(ends, run, {"gravity": {}}), [ends[1], sprung], RESTS))
    told, history = result.summary["relaxation"]["second"], result.history
    t = result.probes["bar"]["time"]
    if run.get("formulation") == "stress-points" or "integrator" in run:
        assert at(result, 1) == pytest.approx(0.01 * np.sin(2.0 * t), rel=1e-12, abs=1e-16)
    # Dashpots do nothing in a rest: what is lost there is what was taken, and what they take in the step beside.
    begins = int(np.flatnonzero(history["time"] >= 0.5)[0])
    taken = history["dissipated"][begins + 1] - history["dissipated"][begins]
    assert taken == pytest.approx(told["energy_taken"], rel=5e-2)
    assert np.abs(history["residual"]).max() < 2e-2 * history["external_work"].max()


@pytest.mark.parametrize(("keys", "said"), [
    ({"displacement": {"x": "0.1*t"}}, "displacement holds in the whole run.*or its velocity, which may have them"),
    ({"displacement": {"x": 0.0}}, "displacement holds in the whole run"),
    ({"acceleration": {"x": 1.0}}, "acceleration holds in the whole run.*or its velocity"),
    ({"quiet": True}, "quiet holds in the whole run: write it in an entry without steps$"),
    ({"spring": {"damping": 1.0}}, "spring holds in the whole run"),
    ({"periodic": "-x"}, "periodic holds in the whole run"),
], ids=str)  # fmt: skip
@pytest.mark.parametrize("form", ["stress-points", "updated-lagrangian"])
def test_what_lasts_is_refused_in_steps_by_name(form: str, keys: dict[str, Any], said: str) -> None:
    entry = {"body": "b", "face": "+x", "steps": ["second"], **keys}
    with pytest.raises(SceneError, match=rf"boundary.0.steps: {said}"):
        wsph.run(stepped(column([], {"formulation": form}), [entry]))


def test_a_step_does_not_come_over_a_motion() -> None:
    """At an edge that both select: the other way round the motion goes on over what holds in the step."""
    moves = {"body": "b", "face": "+x", "displacement": {"y": "0.01*t"}}
    holds = {"body": "b", "face": "-y", "velocity": {"y": 0.0}, "steps": ["second"]}
    block = scenes.body(scenes.box(1.0, 1.0), 0.25, state="stress")
    whole = scenes.scene(block, run={"cfl": 0.4}, relax={}, output={"fields": ["displacement"]})
    with pytest.raises(
        SceneError, match=r"boundary.1.velocity.y: holds in some steps at particles that boundary.0.displ"
    ):
        wsph.run(stepped(whole, [moves, holds]))
    result = wsph.run(stepped(whole, [holds, moves]))
    on = result.particles["position"][:, 0] > 0.99
    time = result.history["time"][-1]
    assert result.particles["displacement"][on, 1] == pytest.approx(0.01 * time, rel=1e-12)


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_regions_and_gravity_act_in_all_steps(run: dict[str, Any]) -> None:
    """As in a run without steps, to the bit."""
    tables = {"gravity": {"x": "-1e-3*max(t - 0.5, 0)"}, "relax": None}
    force = {"x": "1e-3*t", "where": "x > 0.5"}
    whole = column([], {**run, "end": 1.5}, {**tables, "relax": {}}, body_force=force)
    data = whole.data()
    del data["relax"]
    data["boundary"] = [scenes.held("-x", 1)]
    one, other = wsph.run(wsph.Scene(**data)), wsph.run(stepped(whole, data["boundary"]))
    assert (one.particles["displacement"] == other.particles["displacement"]).all()
    assert (one.history["external_work"] == other.history["external_work"]).all()


@pytest.mark.parametrize("run", FORMS, ids=str)
@pytest.mark.parametrize("rest", [False, True])
def test_a_motion_is_measured_from_the_state_of_a_file(run: dict[str, Any], rest: bool, tmp_path: Path) -> None:
    """And springs hold from the start what they hold there."""
    pulled = {"body": "b", "face": "+x", "displacement": {"x": "0.02*t"}}
    spring = {"body": "b", "face": "-x", "spring": {"stiffness": 0.5, "damping": 0.3}}
    tables = {"gravity": {}, "checkpoint": {"every": 10_000, "final": True}}
    first = column([pulled, spring], run, tables).data()
    del first["relax"]
    one = wsph.run(wsph.Scene(**first), tmp_path / "one")
    file = str(max((tmp_path / "one" / "checkpoints").iterdir()))
    second = column([pulled, spring], run, {"gravity": {}}, initial={"file": file}).data()
    if not rest:
        del second["relax"]
    other = wsph.run(wsph.Scene(**second))
    began = one.probes["bar"]["displacement_x[1]"][-1]
    t = other.probes["bar"]["time"]
    exact = run.get("formulation") == "stress-points" or "integrator" in run
    # Particles half a cell inside of a wall.
    assert at(other, 1) == pytest.approx(began + 0.02 * t, rel=1e-12 if exact else 0.1)
    history = other.history
    assert np.abs(history["residual"]).max() < 2e-2 * history["strain"].max()
    if not rest:
        assert history["strain"][0] == pytest.approx(one.history["strain"][-1], rel=1e-9)


@pytest.mark.parametrize("run", [FORMS[0], FORMS[2]], ids=str)
def test_resumed_in_the_middle_of_a_rest(run: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    foot = {"body": "b", "face": "-x", "displacement": {"x": "0.01*sin(3*t)"}}
    sprung = {"body": "b", "face": "+x", "spring": {"stiffness": 0.5, "damping": 1.0}}
    tables = {"output": {"every": 9, "formats": ["npz"], "history": 1}}
    scene = column([foot, sprung], run, tables, body_force={"x": "-1e-4*(1 + t)"})
    wsph.run(scene, tmp_path / "straight")
    look, looks = relaxation.Relaxation._look, list[int]()

    def interrupted(self: relaxation.Relaxation) -> bool:
        looks.append(1)
        if len(looks) == 2:
            signal.raise_signal(signal.SIGINT)
        return look(self)

    monkeypatch.setattr(relaxation.Relaxation, "_look", interrupted)
    stopped = wsph.run(scene, tmp_path / "resumed", throw=False)
    assert "in a relaxation before step 0" in stopped.reason
    wsph.run(scene, tmp_path / "resumed", resume=True)
    for name in ("history.csv", "relax.csv", "probes/bar.csv", "frames/frame_000001.npz"):
        assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()
