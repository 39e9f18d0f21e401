"""Runs: records at their times, the ledger, right or loud, the same bits however a run is cut."""

import copy
import csv
import json
import os
import signal
import threading
from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.backend.graph import SMALL_PAIRS, Program
from wsph.errors import OutputError, Unstable
from wsph.simulation.compose import compose


def test_records_are_the_first_state_at_or_after_their_time(shock_bar: wsph.Scene) -> None:
    dt = 5e-5
    probe = {"name": "p", "at": [[1.0]], "fields": ["velocity_x"], "every": "0.12 ms"}
    result = wsph.run(
        shock_bar.with_(dt=dt, end="1.03 ms", probes=[probe, probe | {"name": "q", "every": 7}], output={"history": 5})
    )
    assert result.summary["steps"] == 21  # ceil(1.03 ms / dt)
    expected = sorted({0, 21} | {int(np.ceil(k * 1.2e-4 / dt - 1e-9)) for k in range(1, 9)})
    assert np.rint(result.probes["p"]["time"] / dt).astype(int).tolist() == expected
    assert np.rint(result.probes["q"]["time"] / dt).astype(int).tolist() == [0, 7, 14, 21]
    assert result.history["step"].tolist() == [0, 5, 10, 15, 20, 21]


def test_every_step_means_every_step_across_blocks(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(end="0.15 s"))  # 3000 steps: three rings
    times = result.probes["fixed-end"]["time"]
    np.testing.assert_allclose(np.diff(times), 5e-5, rtol=1e-9)
    assert len(times) == 3001


def test_the_cadence_of_records_does_not_change_the_bits(shock_bar: wsph.Scene) -> None:
    scene = shock_bar.with_(cfl=0.7)
    finals = [
        wsph.run(scene.with_(output={"history": every, "every": frames})).particles
        for every, frames in ((1, None), (13, "0.7 ms"), (1000, 17))
    ]
    for other in finals[1:]:
        for name, values in finals[0].items():
            assert np.array_equal(values, other[name]), name


def test_a_captured_graph_gives_the_bits_of_direct_launches(shock_bar: wsph.Scene) -> None:
    states = []
    for pairs in (1, SMALL_PAIRS + 1):
        composition = compose(shock_bar.with_(cfl=0.7))
        program = Program(composition.program.step, composition.clock, pairs)
        assert program.small == (pairs == 1)
        program.run(301)
        states.append(composition.bodies[0].system.state.buffer.numpy())
    assert np.array_equal(*states)
    assert np.abs(states[0]).max() > 1e-3  # a velocity over the wave speed


def test_the_ledger_closes_at_courant_one_and_loses_below(shock_bar: wsph.Scene) -> None:
    energy = wsph.run(shock_bar).summary["energy"]
    assert energy["external_work"] == pytest.approx(
        1005.0, rel=1e-10
    )  # rho c v^2 for 2.5 ms, and the driven node's start
    assert energy["kinetic"] + energy["strain"] == pytest.approx(1005.0, rel=1e-10)
    assert abs(energy["residual"]) < 1e-6
    lossy = wsph.run(shock_bar.with_(cfl=0.5)).summary["energy"]
    assert 0.02 < lossy["residual"] / lossy["external_work"] < 0.05  # numerical dissipation, reported: 3.2 %


def test_dissipation_is_on_the_ledger(viscoplastic_bar: wsph.Scene) -> None:
    result = wsph.run(viscoplastic_bar.with_(**{"bodies.0.spacing": 0.0025}))
    energy = result.summary["energy"]
    assert energy["dissipated"] > 10.0
    assert abs(energy["residual"]) < 0.01 * energy["external_work"]
    assert (np.diff(result.history["dissipated"]) >= 0.0).all()


def test_growth_beyond_the_limit_is_stopped_by_name_and_reported_without_throwing(
    shock_bar: wsph.Scene, tmp_path: Path
) -> None:
    scene = shock_bar.with_(cfl=1.2, guard="off", end="50 ms")
    with pytest.raises(
        Unstable,
        match=r"unstable at step \d+, t = .*energy of body 'bar': energy was created: .*Courant number 1.2, limit 1.000",
    ) as caught:
        wsph.run(scene)
    assert caught.value.limit == pytest.approx(1.0)
    assert caught.value.step > 0
    result = wsph.run(scene, tmp_path / "out", throw=False)
    assert result.status == "stopped"
    assert not result.stable
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "stopped"
    assert "energy was created" in summary["reason"]


def test_a_state_that_is_not_finite_names_the_particle(shock_bar: wsph.Scene) -> None:
    # Without the energy stop in the way, growth ends in infinities.
    with pytest.raises(
        Unstable, match=r"velocity or stress of particle \d+ at \([0-9.]+\) m .*is not finite"
    ) as caught:
        wsph.run(shock_bar.with_(cfl=3.0, guard="off", end="1 s", stop={"energy": 1e300}, output={"history": 100_000}))
    assert caught.value.particle >= 0
    assert len(caught.value.position) == 1


def test_an_existing_run_is_never_clobbered(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    out = tmp_path / "out"
    scene = shock_bar.with_(end="0.5 ms")
    wsph.run(scene, out)
    before = (out / "summary.json").read_bytes()
    with pytest.raises(OutputError, match="holds files already.*--overwrite"):
        wsph.run(scene, out)
    assert (out / "summary.json").read_bytes() == before
    wsph.run(scene.with_(end="1 ms"), out, overwrite=True)
    assert (out / "summary.json").read_bytes() != before
    foreign = tmp_path / "photos"
    foreign.mkdir()
    (foreign / "cat.jpg").touch()
    with pytest.raises(OutputError, match="holds no run of wsph"):
        wsph.run(scene, foreign, overwrite=True)


@pytest.mark.parametrize("where", ["/dev/null/out", "/proc/out", "a\0b"])
def test_a_folder_that_cannot_be_written_is_refused_before_anything(
    shock_bar: wsph.Scene, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "wsph.simulation.run.compose", lambda scene: pytest.fail("composed before the folder was checked")
    )
    with pytest.raises(OutputError):
        wsph.run(shock_bar, where)


def test_a_folder_that_is_a_link_is_refused(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    with pytest.raises(OutputError, match="is a symbolic link"):
        wsph.run(shock_bar, tmp_path / "link", overwrite=True)
    assert not list((tmp_path / "there").iterdir())


def test_tables_read_back_exactly(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    result = wsph.run(shock_bar.with_(cfl=0.7), tmp_path / "out")
    with open(tmp_path / "out" / "probes" / "fixed-end.csv") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time", "stress_xx", "velocity_x"]
    assert [float(row["stress_xx"]) for row in rows] == result.probes["fixed-end"]["stress_xx"].tolist()
    with open(tmp_path / "out" / "history.csv") as file:
        history = list(csv.DictReader(file))
    assert [float(row["residual"]) for row in history] == result.history["residual"].tolist()


def test_the_summary_says_what_was_run(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    wsph.run(shock_bar, tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "completed"
    assert summary["plugins"] == {
        "integrator tsph": "wsph " + wsph.__version__,
        "material elastic": "wsph " + wsph.__version__,
    }
    assert wsph.Scene(**summary["scene"]) == shock_bar
    assert summary["particles"] == 101
    assert summary["pairs"] == 400
    assert summary["right_hand_sides"] == 400
    assert summary["particle_steps_per_second"] > 0


def test_units_do_not_matter(shock_bar: wsph.Scene) -> None:
    """The same bar in nanometres and picoseconds gives the same numbers, scaled."""
    reference = wsph.run(shock_bar.with_(cfl=0.7))
    for length, time in ((1e-9, 1e-12), (1e3, 3e7)):
        data = shock_bar.with_(cfl=0.7).data()
        data["run"]["end"] = 10e-3 * time
        body = data["bodies"][0]
        body["shape"]["max"], body["spacing"] = [length], 0.01 * length
        body["material"]["youngs_modulus"] = 80e6 * (length / time) ** 2
        data["functions"]["pulse"] = {"t": [0.0, 2.5e-3 * time], "value": [length / time, 0.0], "interp": "step"}
        for probe, x in zip(data["probes"], (1.0, 0.5), strict=True):
            probe["at"] = [[x * length]]
        data["output"] = {}
        for precision, gate in (("f64", 1e-11), ("f32", 1e-5)):
            data["run"]["precision"] = precision
            other = wsph.run(wsph.Scene(**data))
            a, b = reference.particles["velocity"][:, 0], other.particles["velocity"][:, 0] * time / length
            assert np.abs(a - b).max() <= gate, (length, time, precision)


def test_bodies_run_side_by_side(shock_bar: wsph.Scene) -> None:
    data = shock_bar.data()
    second = json.loads(json.dumps(data["bodies"][0])) | {
        "name": "slow",
        "shape": {"type": "box", "min": [2.0], "max": [3.0]},
        "spacing": 0.05,
    }
    second["material"]["density"] = 8000.0
    data["bodies"].append(second)
    data["boundary"] += [{**condition, "body": "slow"} for condition in data["boundary"]]
    data["probes"] = [{"name": "b", "at": [[3.0]], "fields": ["stress_xx"]}]
    with pytest.warns(RuntimeWarning, match="energy was lost by the end, 12.9 %"):  # the slow body runs at C = .1
        result = wsph.run(wsph.Scene(**data))
    alone = wsph.run(shock_bar)
    first = result.particles["body"] == 0
    assert np.array_equal(result.particles["stress"][first], alone.particles["stress"])
    assert result.particles["id"].tolist() == list(range(101 + 21))
    late = result.probes["b"]
    assert np.abs(late["stress_xx"][late["time"] < 5e-3]).max() < 100.0  # the slow wave arrives at 10 ms
    assert np.abs(late["stress_xx"]).max() > 1e5


def test_an_initial_velocity_and_reduced_probes(shock_bar: wsph.Scene) -> None:
    probes = [
        {"name": name, "where": "x > 0.495 and x < 0.605", "reduce": name, "fields": ["velocity_x"]}
        for name in ("mean", "sum", "max")
    ]  # fmt: skip
    scene = shock_bar.with_(
        end="0.1 ms",
        probes=probes,
        **{"bodies.0.velocity": ["2*x"], "boundary": [{"body": "bar", "face": "+x", "velocity": {"x": 2.0}}]},
    )
    result = wsph.run(scene)
    first = {name: result.probes[name]["velocity_x"][0] for name in ("mean", "sum", "max")}
    assert first == {"mean": pytest.approx(1.1), "sum": pytest.approx(12.1), "max": pytest.approx(1.2)}
    density = wsph.run(
        scene.with_(probes=[{"name": "d", "at": [[0.5], [0.7]], "fields": ["density", "von_mises"]}])
    ).probes["d"]
    assert set(density) == {"time", "density[0]", "density[1]", "von_mises[0]", "von_mises[1]"}
    assert (density["density[1]"] == 2000.0).all()


def test_equal_loads_on_two_faces_are_both_applied(shock_bar: wsph.Scene) -> None:
    faces = [{"body": "bar", "face": face, "stress": {"xx": "1 MPa"}} for face in ("-x", "+x")]
    stress = wsph.run(shock_bar.with_(end="1 ms", boundary=faces, probes=[])).particles["stress"][:, 0]
    assert stress[[0, -1]].tolist() == pytest.approx([1e6, 1e6])
    assert np.abs(stress - stress[::-1]).max() < 1e-6 * 1e6


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ({"face": "-x", "velocity": {"x": 1.0}, "stress": {"xx": 1.0}}, "the face prescribes the velocity x too"),
        ({"where": "x > 0.3 and x < 0.4", "stress": {"xx": 1.0}}, "acts on no face selected here"),
    ],
)
def test_contradicting_conditions_are_faults(shock_bar: wsph.Scene, condition: dict, message: str) -> None:
    with pytest.raises(wsph.SceneError, match=message):
        compose(shock_bar.with_(boundary=[{"body": "bar", **condition}]))


def test_a_start_that_is_not_finite_is_refused(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    for change in (
        {"bodies.0.velocity": ["0/(x - 0.5)"]},
        {"boundary": [{"body": "bar", "face": "-x", "velocity": {"x": "1/t"}}]},
    ):
        with pytest.raises(wsph.Refused, match="not finite"):
            wsph.run(shock_bar.with_(**change), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_interrupt_ends_after_a_whole_step_and_says_where(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    scene = shock_bar.with_(end="1e6 s", output={"history": 10_000}, probes=[])
    result = wsph.run(scene, tmp_path / "out", throw=False)
    assert result.status == "interrupted"
    steps = result.summary["steps"]
    assert result.history["step"][-1] == steps
    again = wsph.run(shock_bar.with_(end=steps * 5e-5, output={"history": 10_000}, probes=[]))
    assert again.summary["steps"] == steps
    assert np.array_equal(again.particles["velocity"], result.particles["velocity"])
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "interrupted"


def test_the_energies_of_a_stopped_run_are_those_of_its_last_step(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(cfl=1.2, guard="off", end="50 ms", output={"history": 50}), throw=False)
    assert result.history["step"][-1] == result.summary["steps"]
    energy = result.summary["energy"]
    assert energy["residual"] < -0.1 * (energy["kinetic"] + energy["strain"])


def test_overwriting_touches_only_what_a_run_wrote(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    film = tmp_path / "video" / "frames"
    film.mkdir(parents=True)
    (film / "film.mov").touch()
    with pytest.raises(OutputError, match="holds no run of wsph"):
        wsph.run(shock_bar.with_(end="0.1 ms"), film.parent, overwrite=True)
    out = tmp_path / "out"
    wsph.run(shock_bar.with_(end="0.1 ms"), out)
    (out / "frames" / "notes.txt").touch()
    wsph.run(shock_bar.with_(end="0.1 ms"), out, overwrite=True)
    assert (out / "frames" / "notes.txt").exists()


def test_a_probe_that_lies_in_two_bodies_has_to_name_one(shock_bar: wsph.Scene) -> None:
    data = shock_bar.with_(end="0.1 ms").data()
    data["bodies"].append(json.loads(json.dumps(data["bodies"][0])) | {"name": "twin"})
    probe = {"name": "p", "where": "x >= 0", "reduce": "sum", "fields": ["velocity_x"]}
    data["probes"] = [probe]
    with pytest.raises(wsph.SceneError, match="probes.0.where: lies in 'bar', 'twin': name one with `body`"):
        wsph.run(wsph.Scene(**data))
    data["probes"] = [probe | {"body": "bar"}]
    assert wsph.run(wsph.Scene(**data)).probes["p"]["velocity_x"][0] == 1.0


def test_errors_against_an_exact_field(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(end="4 ms"))
    exact = lambda x, t: np.where((x[:, 0] > 0.3) & (x[:, 0] <= 0.8), 1.0, 0.0)  # noqa: E731
    assert result.error(exact, "velocity_x", 1) < 0.05
    assert result.error(exact, "velocity", 2) == result.error(exact(result.particles["position"], 0.0), "velocity_x", 2)
    for norm, values, message in (
        (3, exact, "norm 3"),
        (2, np.ones(3), "3 values for 101"),
        (2, np.zeros(101), "zero everywhere"),
    ):
        with pytest.raises(ValueError, match=message):
            result.error(values, "velocity_x", norm)
    with pytest.raises(KeyError, match="name a component of stress"):
        result.error(np.ones(101), "stress") if result.particles["stress"].shape[1] > 1 else None


def test_errors_survive_copying_and_so_the_way_between_processes() -> None:
    fault = wsph.SceneError("s", [])
    unstable = Unstable("m", step=3, time=1.0, dt=0.1, field="energy", limit=1.0)
    for error in (fault, unstable):
        again = copy.deepcopy(error)  # by the same way as pickling
        assert (str(again), vars(again)) == (str(error), vars(error))


def test_what_is_not_finite_is_null_in_the_summary(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    wild = shock_bar.with_(cfl=3.0, guard="off", stop={"energy": 1e300}, end=0.2, output={"history": 1})
    with pytest.warns(RuntimeWarning, match="energy was created"):
        wsph.run(wild, tmp_path / "out", throw=False)
    text = (tmp_path / "out" / "summary.json").read_text()
    summary = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert summary["status"] in ("unstable", "stopped")


def test_runs_from_several_threads_follow_one_another(shock_bar: wsph.Scene) -> None:
    scene, results = shock_bar.with_(end="2 ms"), []
    threads = [threading.Thread(target=lambda: results.append(wsph.run(scene))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 3
    assert all(np.array_equal(r.particles["velocity"], results[0].particles["velocity"]) for r in results)


def test_an_interrupt_takes_its_course_in_a_program(shock_bar: wsph.Scene) -> None:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        wsph.run(shock_bar.with_(end="1e6 s", output={"history": 10_000}, probes=[]))


@pytest.mark.parametrize(
    "change",
    [
        {"density": 1e-320},
        {"density": 1e-300},
        {"youngs_modulus": 1e-300},
        {"density": 1e-300, "youngs_modulus": 1e300},
    ],
)
def test_numbers_beyond_double_precision_are_refused(shock_bar: wsph.Scene, change: dict[str, float]) -> None:
    with pytest.raises(wsph.Refused, match="too far out|not finite"):
        compose(shock_bar.with_(**{f"bodies.0.material.{key}": value for key, value in change.items()}))


def test_a_cadence_may_be_longer_than_any_run(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(end="1 ms", output={"every": 1e308, "history": 2**52}))
    assert result.history["step"].tolist() == [0, 20]
