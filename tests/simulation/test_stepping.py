"""Runs that Python steps: the bits of `wsph.run`, states in between, callbacks, fields written and shared."""

import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph

SCENE = Path(__file__).resolve().parents[2] / "examples" / "vibrating_bar.toml"


@pytest.fixture(scope="module")
def scene() -> wsph.Scene:
    return wsph.load(SCENE).with_(end="0.4 s")


def test_a_run_that_is_stepped_has_the_bits_of_one_that_is_not(scene: wsph.Scene) -> None:
    whole = wsph.run(scene)
    with wsph.Simulation(scene) as sim:
        states = [state.step for state in sim]
    assert states[0] == 0
    assert states[-1] == whole.summary["steps"]
    with wsph.Simulation(scene) as single:
        while not single.done:
            single.step(7)
    for result in (sim.result, single.result):
        assert result.status == "completed"
        assert np.array_equal(result.particles["velocity"], whole.particles["velocity"])
        for name, values in whole.probes.items():
            assert all(np.array_equal(values[key], result.probes[name][key]) for key in values)


def test_states_come_at_multiples_of_a_time(scene: wsph.Scene) -> None:
    with wsph.Simulation(scene) as sim:
        times = [state.time for state in sim.every("0.1 s")]
        dt = sim.state.dt
    wanted = [0.0, 0.1, 0.2, 0.3, 0.4]
    assert len(times) == 5
    assert all(t0 - 1e-9 * dt <= t < t0 + dt for t, t0 in zip(times, wanted, strict=True))


def test_callbacks_are_called_at_their_events(scene: wsph.Scene) -> None:
    seen: list[int] = []
    with wsph.Simulation(scene) as sim:
        sim.at(5, lambda state: seen.append(state.step))
        sim.run()
        last = sim.steps
    assert seen[:-1] == list(range(5, last, 5))
    assert seen[-1] == last


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4", "lf4"])
@pytest.mark.parametrize("every", [1, 8])
def test_the_state_that_a_result_is_taken_at_is_recorded(scene: wsph.Scene, integrator: str, every: int) -> None:
    changes = {"output.history": 8, "probes.0.every": every, "run.integrator": integrator}
    changes["run.formulation"] = "total-lagrangian"
    name, probe = scene.bodies[0].name, scene.probes[0].name
    whole = 0.0
    for factor in (None, 0.5):
        with wsph.Simulation(scene, **changes) as sim:
            assert (sim.steps, sim.steps_total > 10) == (0, True)
            for count in (8, 10):
                sim.step(count - sim.steps)
                if factor is not None:
                    before = sim.state[name].velocity
                    sim.state[name].velocity = factor * before
            v, time = sim.state[name].velocity, sim.time
            assert sim.steps == 10
        result = sim.result
        assert result.history["step"].tolist() == [0, 8, 10]
        assert result.probes[probe]["time"][-1] == result.history["time"][-1] == time
        assert len(set(result.probes[probe]["time"])) == len(result.probes[probe]["time"])
        assert np.allclose(result.particles["velocity"], v, rtol=1e-6, atol=1e-12)
        energy = result.summary["energy"]
        assert result.summary["energy_step"] == 10
        size = 0.5 * result.particles["velocity"][:, 0] @ result.particles["velocity"][:, 0]
        assert energy["kinetic"] > 0.0
        if factor is None:
            whole = energy["kinetic"] / size
        else:
            # The sum of squares over the same particles, whose masses are as they were.
            assert energy["kinetic"] / size == pytest.approx(whole, rel=1e-3)
            assert abs(energy["residual"]) < 0.02 * energy["kinetic"]


def test_fields_are_read_in_si_and_shared_without_copies(scene: wsph.Scene) -> None:
    result = wsph.run(scene)
    with wsph.Simulation(scene) as sim:
        sim.step(sim.steps_total)
        body = sim.state[scene.bodies[0].name]
        assert np.array_equal(body["velocity"], result.particles["velocity"])
        assert np.allclose(body.velocity, body["velocity"], atol=1e-3 * np.abs(body.velocity).max())
        assert np.array_equal(body["stress"], result.particles["stress"])
        assert body.stress.shape == (len(body.position), 6)
        shared = body.array("velocity").numpy()
        assert np.allclose(shared * body.scale("velocity"), body.velocity, rtol=1e-12, atol=0.0)
        assert shared.ctypes.data == body.array("velocity").ptr
        assert {"velocity", "stress"} <= set(dir(body))
        with pytest.raises(KeyError, match="has no field 'damage'; there is velocity"):
            body["damage"]
        with pytest.raises(AttributeError, match="has no field 'damage'"):
            _ = body.damage
        with pytest.raises(KeyError, match="'von_mises' is no array of the state"):
            body.array("von_mises")


def test_a_velocity_that_is_set_goes_on_and_is_on_the_ledger(scene: wsph.Scene) -> None:
    """A bar that is stopped in the middle of its way: what it had stored is all that it has, and nothing was created."""
    with wsph.Simulation(scene) as sim:
        sim.step(sim.steps_total // 2)
        body = sim.state[scene.bodies[0].name]
        body.velocity = np.zeros_like(body.velocity)
        assert not body.velocity.any()
        sim.run()
    energy = sim.result.summary["energy"]
    held = wsph.run(scene).summary["energy"]
    assert energy["dissipated"] > 0.01 * held["external_work"]
    assert abs(energy["residual"]) < 1e-3 * energy["external_work"]
    with pytest.raises(ValueError, match=r"velocities of body '.*' are \(\d+, 1\), not"):
        body.velocity = np.zeros(3)
    with pytest.raises(ValueError, match="are to be finite numbers"):
        body.velocity = np.full_like(body.velocity, np.nan)


def test_a_simulation_ends_with_its_result(scene: wsph.Scene, tmp_path: Path) -> None:
    with wsph.Simulation(scene, tmp_path / "out") as sim:
        sim.step(3)
        result = sim.result
    assert (result.status, result.summary["steps"]) == ("interrupted", 3)
    assert (tmp_path / "out" / "summary.json").exists()
    assert not (tmp_path / "out" / ".lock").exists()
    with pytest.raises(wsph.WsphError, match="has ended: its result was taken"):
        sim.step()


def test_what_cannot_go_on_is_raised(scene: wsph.Scene) -> None:
    beyond = scene.with_(**{"run.cfl": 3.0, "run.guard": "off", "run.end": 10.0})
    with pytest.raises(wsph.Unstable), wsph.Simulation(beyond) as sim:
        sim.run()
    assert not sim.result.stable


def test_names_are_short_and_complete(scene: wsph.Scene) -> None:
    assert dir(wsph) == sorted(wsph.__all__)
    assert len(repr(scene)) < 200
    result = wsph.run(scene)
    assert len(repr(result)) < 200
    assert "completed" in repr(result)
    page = result._repr_html_()
    assert page.startswith("<table>")
    assert "right-hand sides" in page
    assert "<pre>" in scene._repr_html_()
    with wsph.Simulation(scene) as sim:
        assert len(repr(sim)) < 200
        assert "step 0" in repr(sim.state)


def test_tables_go_to_pandas_and_xarray_with_units(scene: wsph.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins where those are not installed: what they are given."""

    class Frame:
        def __init__(self, columns: dict[str, np.ndarray]):
            self.columns, self.attrs, self.index = columns, dict[str, Any](), ""

        def set_index(self, name: str) -> "Frame":
            self.index = name
            return self

    given: dict[str, Any] = {}

    def dataset(variables: Any, coords: Any, attrs: Any) -> object:
        given.update(variables=variables, coords=coords, attrs=attrs)
        return given

    monkeypatch.setitem(sys.modules, "pandas", types.SimpleNamespace(DataFrame=Frame))
    monkeypatch.setitem(sys.modules, "xarray", types.SimpleNamespace(Dataset=dataset))
    result = wsph.run(scene)
    table: Any = result.to_pandas()
    assert table.index == "time"
    assert table.attrs["units"]["kinetic"] == "J/m2"
    probe = next(iter(result.probes))
    result.to_xarray()
    name = next(key for key in result.probes[probe] if key != "time")
    along, values, attributes = given["variables"][f"{probe}.{name}"]
    assert along == f"time_{probe}"
    assert np.array_equal(values, result.probes[probe][name])
    assert attributes["units"]
    assert given["coords"]["time"][2] == {"units": "s"}
    with pytest.raises(KeyError, match="no table 'nothing'; there is history"):
        result.to_pandas("nothing")


def test_without_pandas_the_way_to_it_is_said(scene: wsph.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(wsph.OutputError, match=r'pandas is not installed: pip install "wsph\[notebook\]"'):
        wsph.run(scene).to_pandas()


def test_a_bar_follows_the_run(scene: wsph.Scene) -> None:
    from wsph.output.view.bar import Bar

    with Bar() as bar:
        wsph.run(scene, progress=bar)
    assert bar.done == 1.0
    assert wsph.run(scene, progress=True).status == "completed"


def test_a_result_can_be_turned(scene: wsph.Scene) -> None:
    """A plotter that holds the field by its name and unit; nothing is rendered."""
    pytest.importorskip("pyvista")
    beam = wsph.load(SCENE.with_name("oscillating_beam.toml")).with_(end="10 us")
    result = wsph.run(beam)
    made = result.interactive("velocity_y")
    grids = [each.mapper.dataset for each in made.actors.values() if getattr(each, "mapper", None)]
    (grid,) = [each for each in grids if "velocity_y [m/s]" in each.array_names]
    assert np.allclose(np.asarray(grid["velocity_y [m/s]"]), result.field("velocity_y"))
    made.close()
    with pytest.raises(wsph.OutputError, match="no field 'nothing' in the frame"):
        result.interactive("nothing")


def test_a_format_whose_package_is_missing_is_refused_before_a_folder_is_made(
    scene: wsph.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wsph.output.formats.importlib.util.find_spec", lambda name: None)
    with pytest.raises(wsph.OutputError, match="the format xdmf needs h5py"):
        wsph.Simulation(scene.with_(**{"output.formats": ["xdmf"]}), tmp_path / "out")
    assert not (tmp_path / "out").exists()
