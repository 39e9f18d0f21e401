"""Runs: right or loud, the same in all units, one after the other from any thread."""

import json
import threading
from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.errors import Unstable
from wsph.simulation.compose import compose


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
    with pytest.warns(RuntimeWarning, match="energy was lost by the end, 12.9 %"):  # the slow body runs at C = 0.1
        result = wsph.run(wsph.Scene(**data))
    alone = wsph.run(shock_bar)
    first = result.particles["body"] == 0
    assert np.array_equal(result.particles["stress"][first], alone.particles["stress"])
    assert result.particles["id"].tolist() == list(range(101 + 21))
    late = result.probes["b"]
    assert np.abs(late["stress_xx"][late["time"] < 5e-3]).max() < 100.0  # the slow wave arrives at 10 ms
    assert np.abs(late["stress_xx"]).max() > 1e5


def test_runs_from_several_threads_follow_one_another(shock_bar: wsph.Scene) -> None:
    scene, results = shock_bar.with_(end="2 ms"), []
    threads = [threading.Thread(target=lambda: results.append(wsph.run(scene))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 3
    assert all(np.array_equal(r.particles["velocity"], results[0].particles["velocity"]) for r in results)


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
