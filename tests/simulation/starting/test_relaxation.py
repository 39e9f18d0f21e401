"""Relaxation: bodies at rest before t = 0, against closed forms and references; the same bits however it is run."""

import json
import signal
import warnings
from pathlib import Path

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.checking import described
from wsph.errors import Refused, SceneError, Unstable
from wsph.formulations.updated.rates import UpdatedRates
from wsph.simulation.starting import relaxation

UNTIL = 1e-6
ONE_SET = ("stress-points", "total-lagrangian", "updated-lagrangian")


def column(cells: int = 40, *, run: dict | None = None, tables: dict | None = None, **keys: object) -> wsph.Scene:
    """A bar that stands on its end, u(1) = -g/2 of unit length, density and modulus."""
    tables = {"boundary": [scenes.held("-x", 1)], "gravity": {"x": -1e-4}, "relax": {}, **(tables or {})}
    probe = {"name": "top", "at": [[1.0]], "fields": ["displacement", "velocity"], "every": 1}
    return scenes.bar(cells, run={"cfl": 0.5, **(run or {})}, tables={"probes": [probe], **tables}, **keys)


def cook(cells: int = 24, cfl: float = 0.72, **tables: object) -> wsph.Scene:
    """Cook's membrane in plane stress: E = 1000, nu = 1/3, a shear load of 1e-3 in all."""
    made = scenes.body(scenes.cube(2), 1.0 / cells, map=["48*x", "44*x + (44 - 28*x)*y"], state="stress",
                       material=scenes.material(youngs_modulus=1e3, poisson_ratio=1 / 3))  # fmt: skip
    sides = [scenes.held("-x", 2), {"body": "b", "face": "+x", "traction": {"y": 1e-3 / 16}}]
    probe = {"name": "tip", "at": [[48.0, 52.0]], "fields": ["displacement"], "every": 1}
    return scenes.scene(made, run={"cfl": cfl, "end": 8.0}, boundary=sides, probes=[probe], **tables)


def kinetic_part(result: wsph.Result) -> float:
    """The largest kinetic energy of a run that begins at rest, as a part of its least strain energy."""
    return float(result.history["kinetic"].max() / result.history["strain"].min())


LAWS = {
    "elastic": {},
    "neo-hookean": {},
    "jaumann": {},
    "mises": {"yield_stress": 0.01, "hardening_modulus": 0.1},
    "perzyna": {"yield_stress": 0.01, "hardening_modulus": 0.1, "fluidity": 0.01, "exponent": 1.0},
}


@pytest.mark.parametrize("model", LAWS)
@pytest.mark.parametrize("form", ONE_SET)
def test_a_column_rests_under_its_weight(form: str, model: str) -> None:
    result = wsph.run(column(run={"formulation": form, "end": 5.0}, material=scenes.material(model, **LAWS[model])))
    told = result.summary["relaxation"]
    assert told["status"] == "at rest"
    assert told["kinetic_over_strain"] <= UNTIL
    # Over more than one period of the slowest motion nothing swings by more than was asked for.
    assert kinetic_part(result) <= UNTIL
    # sqrt(until) in displacements, twice for what swings to both sides.
    assert abs(result.probes["top"]["displacement_x"] / -5e-5 - 1.0).max() < 2e-3
    # The weight's work over what it comes to: half is stored, half taken: g^2/6 of each.
    assert told["energy_taken"] == pytest.approx(1e-8 / 6.0, rel=2e-3)
    assert abs(result.history["residual"]).max() < 1e-6 * result.history["strain"][0]


def test_cooks_membrane() -> None:
    result = wsph.run(cook(relax={}))
    # u E b/F: 23.96 of fine meshes (Simo & Rifai 1990: 23.9642), to 3 %.
    assert abs(result.probes["tip"]["displacement_y"][0] * 1e6 / 23.96 - 1.0) < 0.03
    assert kinetic_part(result) <= UNTIL


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_fewer_steps_than_the_best_constant_damping(tmp_path: Path) -> None:
    """Steps after which kinetic energy stays below 1e-6 of the strain energy: with kinetic damping, which knows no rate, and
    with damping in proportion to mass at the best of many rates about the critical one."""
    wsph.run(cook(relax={}, output={"history": 1}), tmp_path / "cook", end=1.0)
    rows = np.genfromtxt(tmp_path / "cook" / "relax.csv", delimiter=",", names=True)
    above = np.flatnonzero(rows["kinetic"] > UNTIL * rows["strain"])
    ours = rows["step"][above[-1] + 1]
    free = wsph.run(cook(output={"history": 1}), end=12.0)
    tip = free.probes["tip"]["displacement_y"]
    lowest = np.pi / (np.argmax(tip) * free.summary["dt"])
    best = np.inf
    for factor in (1.2, 1.4, 1.6, 1.7, 1.75, 1.8, 1.85, 1.9, 2.0, 2.2):
        scene = cook(output={"history": 1})
        data = scene.data()
        data["bodies"][0]["damping"] = {"rate": factor * lowest}
        data["run"]["end"] = 40.0
        history = wsph.run(wsph.Scene(**data)).history
        above = np.flatnonzero(history["kinetic"] > UNTIL * history["strain"])
        if above[-1] + 1 < len(history["step"]):
            best = min(best, history["step"][above[-1] + 1])
    assert ours < best
    # And with the steps in which it makes sure of it.
    assert rows["step"][-1] < best + np.argmax(tip)


@pytest.mark.parametrize(
    "run",
    [
        {"integrator": "leapfrog", "formulation": "total-lagrangian"},
        {"integrator": "leapfrog", "formulation": "updated-lagrangian"},
        {"integrator": "rk4", "formulation": "stress-points"},
        {"integrator": "lf4", "formulation": "stress-points"},
        {"integrator": "leapfrog", "formulation": "stress-points", "precision": "f32"},
    ],
    ids=str,
)
def test_resumed_is_straight_byte_for_byte(run: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted in the middle of its relaxation, and gone on with."""
    scene = column(run={"end": 1.0, **run}, tables={"output": {"formats": ["npz"], "history": 3}})
    wsph.run(scene, tmp_path / "straight")
    between = relaxation.Relaxation._look
    looks = []

    def look(self: relaxation.Relaxation) -> bool:
        looks.append(1)
        if len(looks) == 3:
            signal.raise_signal(signal.SIGINT)
        return between(self)

    monkeypatch.setattr(relaxation.Relaxation, "_look", look)
    stopped = wsph.run(scene, tmp_path / "resumed", throw=False)
    assert stopped.status == "interrupted"
    assert "in a relaxation before step 0, after 96 steps of it" in stopped.reason
    wsph.run(scene, tmp_path / "resumed", resume=True)
    for name in ("history.csv", "relax.csv", "probes/top.csv", "frames/frame_000001.npz"):
        assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()
    told = [
        json.loads((tmp_path / name / "summary.json").read_text())["relaxation"] for name in ("straight", "resumed")
    ]
    assert told[0] == told[1]


def test_resumed_after_it_is_straight_byte_for_byte(tmp_path: Path) -> None:
    scene = column(run={"end": 1.0}, tables={"output": {"formats": ["npz"]}, "checkpoint": {"every": 40, "keep": 9}})
    wsph.run(scene, tmp_path / "straight")
    wsph.run(scene, tmp_path / "resumed", end=0.6)
    wsph.run(scene, tmp_path / "resumed", resume=True)
    for name in ("relax.csv", "probes/top.csv"):
        assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()
    last = [np.genfromtxt(tmp_path / name / "history.csv", delimiter=",")[-1] for name in ("straight", "resumed")]
    assert (last[0] == last[1]).all()


def test_the_same_for_any_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wsph.backend.graph.SMALL_PAIRS", 0)
    one, two = (
        wsph.run(cook(8, cfl=0.6, relax={"until": 1e-3}), threads=threads, end=0.5, **{"output.history": 1})
        for threads in (1, 2)
    )
    assert one.summary["relaxation"] == two.summary["relaxation"]
    assert all((one.particles[name] == two.particles[name]).all() for name in one.particles)


def test_steps_after_it_take_the_pairs_that_it_has_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of a body that was compressed by a quarter in it, as if every step were listed anew."""
    stages = [{"name": "a", "duration": 3.0}, {"name": "b", "duration": 3.0, "relax": {"until": 1e-2}}]
    made = scenes.scene(
        scenes.body(scenes.box(12.0, 4.0), 1.0, state="strain", material=scenes.material()),
        run={"formulation": "updated-lagrangian", "dt": 0.3, "end": None},
        steps=stages,
        boundary=[scenes.held("-x", 2), {"body": "b", "face": "+x", "traction": {"x": -0.3}, "steps": ["b"]}],
    )
    straight = wsph.run(made)
    follow = UpdatedRates.follow
    monkeypatch.setattr(UpdatedRates, "follow", lambda rates: follow(rates) or True)
    listed = wsph.run(made)
    for name in ("velocity", "stress"):
        np.testing.assert_array_equal(straight.particles[name], listed.particles[name])


def test_what_is_driven_waits_and_velocities_come_after() -> None:
    """A bar under its weight, whose foot is driven: before t = 0 that stays, and the bar's own velocity comes then."""
    foot = scenes.driven("-x", x="step")
    tables = {"boundary": [foot], "functions": {"step": {"t": [0.0, 1.0], "value": [0.01, 0.01]}}}
    result = wsph.run(column(run={"end": 0.1}, tables=tables, velocity=["1e-3*x"]))
    # The foot is at rest until t = 0, and drives from then on.
    assert result.probes["top"]["velocity_x"][0] == pytest.approx(1e-3, rel=1e-12)
    assert result.probes["top"]["displacement_x"][0] == pytest.approx(-5e-5, rel=2e-3)
    assert result.history["external_work"][0] < result.history["external_work"][-1]


def test_a_load_is_that_of_the_start() -> None:
    """A traction that falls from its first value: the body rests under that."""
    pull = {"body": "b", "face": "+x", "traction": {"x": "1e-4*(1 - t)"}}
    scene = column(tables={"boundary": [scenes.held("-x", 1), pull], "gravity": {}})
    assert wsph.run(scene).probes["top"]["displacement_x"][0] == pytest.approx(1e-4, rel=2e-3)


def test_a_large_compression_is_that_of_the_law() -> None:
    """A block between walls, pressed by a fifth of its modulus: P = mu (s - 1/s) + lambda ln s/s of the stretch s."""
    walls = [{"body": "b", "face": face, "symmetry": face[1]} for face in ("-y", "-x", "+x")]
    tables = {"boundary": [*walls, {"body": "b", "face": "+y", "traction": {"y": -0.2}}], "relax": {},
              "probes": [{"name": "top", "at": [[0.5, 1.0]], "fields": ["displacement"], "every": 1}]}  # fmt: skip
    result = wsph.run(scenes.block(2, 6, model="neo-hookean", run={"cfl": 0.6, "end": 0.2}, tables=tables))
    second = 1.0 / 2.6
    first = 0.3 / (1.3 * 0.4)
    low, high = 0.3, 1.0
    for _ in range(60):
        s = 0.5 * (low + high)
        low, high = (s, high) if second * (s - 1.0 / s) + first * np.log(s) / s < -0.2 else (low, s)
    # sqrt(until) of the strain.
    assert result.probes["top"]["displacement_y"][0] == pytest.approx(low - 1.0, rel=2e-3)


def test_bodies_in_contact_settle() -> None:
    """A bar that falls a hundredth of a cell on another and rests there."""
    lower = scenes.body(scenes.box(1.0), 0.1, name="a", state="stress")
    upper = scenes.body(scenes.box((1.1, 2.1)), 0.1, name="b", state="stress")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = wsph.run(scenes.scene(lower, upper, boundary=[scenes.held("-x", 1, "a")], gravity={"x": -1e-3},
                                       contact=[{"between": ["a", "b"]}], relax={"until": 1e-5}, run={"cfl": 0.3, "end": 3.0}))  # fmt: skip
    assert result.summary["relaxation"]["status"] == "at rest"
    assert kinetic_part(result) < 1e-4


def test_an_unloaded_body_is_at_rest_at_once() -> None:
    told = wsph.run(column(tables={"gravity": {}})).summary["relaxation"]
    assert (told["status"], told["peaks"], told["energy_taken"]) == ("at rest", 0, 0.0)
    assert told["steps"] == relaxation.LOOK


def test_no_rest_is_a_stop_by_name(tmp_path: Path) -> None:
    with pytest.raises(Unstable, match=r"not at rest after 64 steps.*relax.until = 1e-06.*raise relax.max_steps"):
        wsph.run(column(tables={"relax": {"max_steps": 64}}), tmp_path / "out")
    told = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (told["status"], told["relaxation"]["status"]) == ("stopped", "not at rest")
    assert len((tmp_path / "out" / "relax.csv").read_text().splitlines()) == 3
    with pytest.raises(Unstable, match="none has passed a peak, as of a body that nothing holds"):
        wsph.run(column(tables={"boundary": [], "relax": {"max_steps": 200}}))


def test_what_cannot_relax_is_refused_by_name() -> None:
    for name in ("tsph", "ul-tsph"):
        material = scenes.material("jaumann")
        with pytest.raises(Refused, match=f"relax: the stress of two sets.*{name}.*leapfrog"):
            wsph.run(column(run={"integrator": name}, material=material))
    with pytest.raises(SceneError, match="until"):
        column(tables={"relax": {"until": 0.0}})
    with pytest.raises(SceneError, match="max_steps"):
        column(tables={"relax": {"max_steps": 0}})


def test_check_tells() -> None:
    told = dict(described(column(), "scene"))
    assert "below 1e-06 of the strain energy, in at most 100000 steps" in told["relaxation"]
