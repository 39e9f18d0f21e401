"""Steps in sequence: what holds in each, against runs that wait; on the ledger, in checkpoints, probes and frames."""

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.checking import described
from wsph.errors import SceneError
from wsph.simulation.starting import relaxation

FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "updated-lagrangian"},
    {"formulation": "stress-points", "precision": "f32"},
    {"integrator": "rk4"},
    {"integrator": "blanes-moan4"},
]
STEPS = [{"name": "preload", "duration": 1.0}, {"name": "impact", "duration": 1.5}]


def stepped(scene: wsph.Scene, boundary: list[Any], steps: list[Any]) -> wsph.Scene:
    """A scene in steps."""
    data = scene.data()
    del data["run"]["end"]
    return wsph.Scene(**{**data, "boundary": boundary, "steps": steps})


def bar(
    run: dict[str, Any], boundary: list[Any], steps: list[Any] | None, *, model: str = "elastic", **tables: Any
) -> wsph.Scene:
    """Of thirty cells; without steps of 2.5 units of time."""
    probe = {"name": "end", "at": [[1.0]], "fields": ["velocity", "displacement", "stress"], "every": 1}
    tables = {"probes": [probe], "output": {"history": 1}, **tables}
    run = {"cfl": 0.45, "end": 2.5, **run}
    if steps is None:
        return scenes.bar(30, run=run, tables={"boundary": boundary, **tables}, model=model)
    return stepped(scenes.bar(30, run=run, tables=tables, model=model), boundary, steps)


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_preload_then_impact_is_one_run_that_waits(run: dict[str, Any]) -> None:
    """A pull that comes on slowly, and then a blow beside it; once in steps, once as functions of time."""
    held = scenes.held("-x", 1)
    pull, blow = "1e-3*sin(pi*min(t, 1)/2)", "-2e-3*sin(pi*(t - 1)/0.3)*(t < 1.3)"
    steps = [
        held,
        {"body": "b", "face": "+x", "traction": {"x": pull}},
        {"body": "b", "face": "+x", "traction": {"x": blow}, "steps": ["impact"]},
    ]
    waits = [held, steps[1], {"body": "b", "face": "+x", "traction": {"x": f"({blow})*(t > 1)"}}]
    one, other = wsph.run(bar(run, steps, STEPS)), wsph.run(bar(run, waits, None))
    # To the last bit: but for a time on the very edge of a step, which is the step's before.
    rounding = 1e-5 if run.get("precision") == "f32" else 1e-12
    for name, values in other.probes["end"].items():
        assert one.probes["end"][name] == pytest.approx(values, rel=rounding, abs=rounding * np.abs(values).max())
    assert one.history["external_work"] == pytest.approx(other.history["external_work"], rel=1e-5)
    assert np.abs(one.history["residual"]).max() <= 1.01 * np.abs(other.history["residual"]).max() + 1e-18


@pytest.mark.parametrize("run", FORMS[:4], ids=str)
def test_an_end_that_is_let_go(run: dict[str, Any]) -> None:
    """Stressed between two ends, of which one is free in the second step: as a bar that begins there."""
    stress = {"stress": {"xx": 1e-3}}
    hold = {**scenes.held("+x", 1), "steps": ["preload"]}
    run = {**run, "cfl": 0.3}  # the end of the first step is that of one in time
    data = bar(run, [scenes.held("-x", 1), hold], STEPS).data()
    data["bodies"][0]["initial"] = stress
    both = wsph.run(wsph.Scene(**data))
    data = bar({**run, "end": 1.5}, [scenes.held("-x", 1)], None).data()
    data["bodies"][0]["initial"] = stress
    alone = wsph.run(wsph.Scene(**data))
    dt = both.summary["dt"]
    let_go = int(np.floor(1.0 / dt + 1e-9))
    found, wanted = both.probes["end"]["velocity_x"][let_go:], alone.probes["end"]["velocity_x"]
    # At rest until then; and from then on the same steps.
    assert np.abs(both.probes["end"]["velocity_x"][: let_go + 1]).max() < 1e-8 if "precision" in run else 1e-15
    n = min(len(found), len(wanted)) - 1
    size = np.abs(wanted).max()
    if run["formulation"] == "updated-lagrangian":
        # An end that is let go has no wall: it is held by its first layer, half a cell inside.
        assert found[n // 2] == pytest.approx(wanted[n // 2], abs=0.2 * size)
    else:
        assert found[:n] == pytest.approx(wanted[:n], abs=(1e-4 if "precision" in run else 1e-12) * size)
    assert np.abs(both.history["residual"]).max() < 2e-3 * both.history["strain"][0]


def test_motions_that_follow_one_another() -> None:
    """An end that is pulled, held and let go: the work is that of each, and nothing is named twice."""
    steps = [{"name": name, "duration": length} for name, length in (("pull", 0.5), ("hold", 0.5), ("go", 1.5))]
    ends = [
        scenes.held("-x", 1),
        {**scenes.driven("+x", x=0.01), "steps": ["pull"]},
        {**scenes.held("+x", 1), "steps": ["hold"]},
    ]
    result = wsph.run(bar({}, ends, steps))
    t, u, v = (result.probes["end"][name] for name in ("time", "displacement_x", "velocity_x"))
    dt = result.summary["dt"]
    held = (t > 0.5 + dt) & (t <= 1.0)
    assert v[(t > 0.0) & (t <= 0.5)] == pytest.approx(0.01, rel=1e-12)
    assert not v[held].any()
    # Its way is that of the steps with the pull's speed, and half of the one in which it stops.
    assert np.ptp(u[held]) == 0.0
    assert u[held][0] == pytest.approx(0.005, abs=0.01 * dt)
    # The pulse comes back from the other end at t = 2, and meets a free one: twice its speed, and what a sharp front swings.
    assert v[t < 1.9].min() > -1e-3
    assert v.min() == pytest.approx(-0.02, rel=0.35)
    work = result.history["external_work"]
    # Who holds does no work, nor who has let go.
    assert np.ptp(work[result.history["time"] > 0.5 + 2.0 * dt]) < 1e-12 * work.max()
    assert np.abs(result.history["residual"]).max() < 1e-2 * work.max()


@pytest.mark.filterwarnings("ignore:.*energy was")
@pytest.mark.parametrize("name", ["tsph", "ul-tsph"])
def test_loads_of_two_sets(name: str) -> None:
    steps = [{"name": "preload", "duration": 0.5}, {"name": "impact", "duration": 0.5}]
    load = {"body": "b", "face": "+x", "stress": {"xx": "1e-3*min((t - 0.5)/0.3, 1)"}, "steps": ["impact"]}
    # The first step of a load on a body without any energy creates a part of what little there is.
    scene = bar({"integrator": name}, [scenes.held("-x", 1), load], steps, model="jaumann", stop={"energy": 10.0})
    found = wsph.run(scene).probes["end"]
    assert not found["stress_xx"][found["time"] <= 0.5].any()
    assert found["stress_xx"][found["time"] > 0.81] == pytest.approx(1e-3, rel=1e-12)
    with pytest.raises(SceneError, match=r"boundary.1.steps: two-set bodies hold or move a face in the whole run"):
        wsph.run(
            bar({"integrator": name}, [scenes.held("-x", 1), {**scenes.held("+x", 1), "steps": ["impact"]}], steps)
        )


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_pressure_in_a_step(form: str) -> None:
    steps = [{"name": "first", "duration": 0.3}, {"name": "second", "duration": 0.3}]
    boundary = [scenes.held("-x", 2), {"body": "b", "face": "+x", "pressure": 1e-3, "steps": ["first"]}]
    scene = scenes.block(2, 6, run={"formulation": form}, tables={"output": {"history": 1}})
    history = wsph.run(stepped(scene, boundary, steps)).history
    work = history["external_work"]
    first = history["time"] <= 0.3
    assert work[first][-1] > 0.0
    # The step in which it ends has the mean of both its ends.
    assert np.ptp(work[~first][1:]) < 1e-12 * work.max()


def test_resumed_is_straight_byte_for_byte(tmp_path: Path) -> None:
    ends = [scenes.held("-x", 1), {**scenes.driven("+x", x=0.01), "steps": ["preload"]}]
    scene = bar({}, ends, STEPS, checkpoint={"every": 40, "keep": 9}, output={"every": 9, "formats": ["npz"]})
    wsph.run(scene, tmp_path / "straight")
    wsph.run(scene, tmp_path / "resumed")
    kept = sorted((tmp_path / "resumed" / "checkpoints").iterdir())
    # Gone on with in the first step, and in the second.
    for last in (1, 3):
        for later in kept[last:]:
            later.unlink(missing_ok=True)
        wsph.run(scene, tmp_path / "resumed", resume=True)
        for name in ("history.csv", "probes/end.csv", "frames/frame_000003.npz"):
            assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()
        kept = sorted((tmp_path / "resumed" / "checkpoints").iterdir())


REST = [{"name": "pull", "duration": 0.5}, {"name": "hang", "duration": 1.0, "relax": {"until": 1e-6}}]


def hanging(run: dict[str, Any], **tables: Any) -> wsph.Scene:
    """A bar whose end is pulled, and then hangs on a load, from rest."""
    load = {"body": "b", "face": "+x", "traction": {"x": 1e-3}, "steps": ["hang"]}
    pull = {**scenes.driven("+x", x=0.01), "steps": ["pull"]}
    return bar(run, [scenes.held("-x", 1), pull, load], REST, **tables)


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_rest_before_a_step(run: dict[str, Any]) -> None:
    result = wsph.run(hanging(run))
    told = result.summary["relaxation"]["hang"]
    assert told["status"] == "at rest"
    history, end = result.history, result.probes["end"]
    begins = int(np.flatnonzero(history["time"] >= 0.5)[0])
    # From the next step on it hangs still: sqrt(until) of its stretch, and of its speed.
    assert end["displacement_x"][begins + 1 :] == pytest.approx(1e-3, rel=5e-3)
    assert (history["kinetic"][begins + 1 :] / history["strain"][begins + 1 :]).max() <= 1e-6
    # What it has taken is on the ledger, and the work of the load that came on.
    taken = history["dissipated"][begins + 1] - history["dissipated"][begins]
    assert taken == pytest.approx(told["energy_taken"], rel=1e-9)
    size = history["external_work"].max()
    bound = 2e-2 if "precision" in run else 1e-2
    assert np.abs(np.diff(history["residual"])[begins:]).max() < bound * size


@pytest.mark.parametrize("run", [FORMS[0], FORMS[2]], ids=str)
def test_resumed_in_the_middle_of_a_rest(run: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = hanging(run, output={"every": 9, "formats": ["npz"]})
    wsph.run(scene, tmp_path / "straight")
    look, looks = relaxation.Relaxation._look, list[int]()

    def interrupted(self: relaxation.Relaxation) -> bool:
        looks.append(1)
        if len(looks) == 2:
            signal.raise_signal(signal.SIGINT)
        return look(self)

    monkeypatch.setattr(relaxation.Relaxation, "_look", interrupted)
    stopped = wsph.run(scene, tmp_path / "resumed", throw=False)
    assert "in a relaxation before step 34, after 64 steps of it" in stopped.reason
    wsph.run(scene, tmp_path / "resumed", resume=True)
    for name in ("history.csv", "relax.csv", "probes/end.csv", "frames/frame_000005.npz"):
        assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


def test_rest_before_both_steps(tmp_path: Path) -> None:
    """Each with its load, in one file."""
    steps = [{"name": "one", "duration": 0.2, "relax": {}}, {"name": "two", "duration": 0.2, "relax": {"until": 1e-4}}]
    loads = [
        {"body": "b", "face": "+x", "traction": {"x": 1e-3 * (k + 1)}, "steps": [name]}
        for k, name in enumerate(("one", "two"))
    ]
    result = wsph.run(bar({}, [scenes.held("-x", 1), *loads], steps), tmp_path / "out")
    end = result.probes["end"]
    assert end["displacement_x"][0] == pytest.approx(1e-3, rel=5e-3)
    assert end["displacement_x"][-1] == pytest.approx(2e-3, rel=5e-2)
    rows = np.genfromtxt(tmp_path / "out" / "relax.csv", delimiter=",", names=True)
    assert sorted(set(rows["time"])) == [0.0, 0.2]
    assert set(result.summary["relaxation"]) == {"one", "two"}
    with pytest.raises(SceneError, match=r"relax: and steps.0.relax are of the same time"):
        bar({}, [scenes.held("-x", 1)], [{"name": "a", "duration": 1.0, "relax": {}}], relax={})


def test_faults_are_named() -> None:
    held = scenes.held("-x", 1)
    for boundary, steps, run, said in (
        ([held], STEPS, {"end": 1.0}, r"run.end: is the sum of the durations of \[\[steps\]\], 2.5 s: leave it out"),
        ([{**held, "steps": ["prelaod"]}], STEPS, {}, "no step is named 'prelaod'; did you mean 'preload'"),
        ([{**held, "steps": ["preload"]}], [], {"end": 1.0}, r"no step is named 'preload'; there are no \[\[steps\]\]"),
        ([held], [STEPS[0], STEPS[0]], {}, "'preload' names another step already"),
        ([held], [{"name": "a", "duration": 0.0}], {}, "duration"),
        ([held], [], {}, "run.end: is missing"),
    ):
        run = {"integrator": "leapfrog", "cfl": 0.4, **run}
        body = scenes.body(scenes.box(1.0), 0.1, state="stress")
        with pytest.raises(SceneError, match=said):
            wsph.Scene(schema=1, dim=1, run=run, bodies=[body], boundary=boundary, steps=steps)
    for keys, said in (({"spring": {"stiffness": 1.0}}, "spring"), ({"normal": 0.0}, "normal")):
        entry = {"body": "b", "face": "+x", "steps": ["impact"], **keys}
        with pytest.raises(SceneError, match=f"boundary.1.steps: {said} holds in the whole run"):
            wsph.run(bar({}, [held, entry], STEPS))
    with pytest.raises(
        SceneError, match=r"boundary.2.velocity.x: prescribes what boundary.1.fixed has another value for"
    ):
        wsph.run(
            bar(
                {},
                [
                    held,
                    {**scenes.held("+x", 1), "steps": ["impact"]},
                    {**scenes.driven("+x", x=1.0), "steps": ["preload", "impact"]},
                ],
                STEPS,
            )
        )


def test_check_tells() -> None:
    told = described(bar({}, [scenes.held("-x", 1), {**scenes.held("+x", 1), "steps": ["impact"]}], STEPS), "scene")
    assert ("step preload", "0 to 1 s, with boundary 0") in told
    assert ("step impact", "1 to 2.5 s, with boundary 0, 1") in told
    assert any(key == "boundary 1" and said.endswith("; in impact") for key, said in told)
    assert "steps to 2.5 s" in dict(told)["time step"]
