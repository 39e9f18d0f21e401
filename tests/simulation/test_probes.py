"""Probes: at places, over selections, in one body."""

import json

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose

FORMS = {
    "tsph": {"integrator": "tsph"},
    "ul-tsph": {"integrator": "ul-tsph"},
    "stress-points": {"formulation": "stress-points"},
    "edges": {"formulation": "total-lagrangian"},
    "kernel pairs": {"formulation": "total-lagrangian", "support": 2.6},
    "updated-lagrangian": {"formulation": "updated-lagrangian"},
}
FIELDS = ["velocity", "stress", "displacement", "plastic_strain", "von_mises"]


def flowing(form: str, dim: int, **keys: object) -> wsph.Scene:
    """A held block of few cells, struck so that it flows."""
    law = scenes.material("perzyna", yield_stress=1e-3, hardening_modulus=0.1, fluidity=0.02, exponent=1.0)
    tables = {"boundary": [scenes.held("-x", dim)], "output": {"fields": FIELDS}}
    run = {**FORMS[form], "cfl": 0.2, "end": 0.5, "guard": "warn"}
    velocity = ["-0.2*x + 0.1*y", "0.05*x", "0.1*z"][:dim] if dim > 1 else ["-0.2*x"]
    return scenes.block(dim, 4 if dim < 3 else 3, run=run, tables=tables, material=law, velocity=velocity, **keys)


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
    both = wsph.run(
        scene.with_(probes=[{"name": "d", "at": [[0.5], [0.7]], "fields": ["velocity_x", "von_mises"]}])
    ).probes["d"]
    assert set(both) == {"time", "velocity_x[0]", "velocity_x[1]", "von_mises[0]", "von_mises[1]"}


def test_the_density_is_for_frames(shock_bar: wsph.Scene) -> None:
    with pytest.raises(wsph.SceneError, match="the density cannot be probed in the small-strain form; frames carry it"):
        wsph.run(shock_bar.with_(probes=[{"name": "d", "at": [[0.5]], "fields": ["density"]}]))


@pytest.mark.filterwarnings("ignore:bodies 'bar' and 'twin' overlap")
def test_a_probe_that_lies_in_two_bodies_has_to_name_one(shock_bar: wsph.Scene) -> None:
    data = shock_bar.with_(end="0.1 ms").data()
    data["bodies"].append(json.loads(json.dumps(data["bodies"][0])) | {"name": "twin"})
    probe = {"name": "p", "where": "x >= 0", "reduce": "sum", "fields": ["velocity_x"]}
    data["probes"] = [probe]
    with pytest.raises(wsph.SceneError, match="probes.0.where: lies in 'bar', 'twin': name one with `body`"):
        wsph.run(wsph.Scene(**data))
    data["probes"] = [probe | {"body": "bar"}]
    # The driven end, and a quarter in its neighbour: frames and probes average to the virtual particles and back.
    assert wsph.run(wsph.Scene(**data)).probes["p"]["velocity_x"][0] == 1.25


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.filterwarnings("ignore:.*energy was")
def test_a_probe_at_a_particle_reads_what_frames_have(form: str, dim: int) -> None:
    """One value for one name: probes, frames, the result and its errors, to rounding."""
    scene = flowing(form, dim)
    places = compose(scene).bodies[0].reading.positions
    at = {"name": "at", "at": places.tolist(), "fields": FIELDS}
    over = [
        {"name": how, "where": "x > -1", "reduce": how, "fields": ["velocity_x", "displacement_x"]}
        for how in ("sum", "max")
    ]
    result = wsph.run(scene.with_(probes=[at, *over]))
    probe, compared = result.probes["at"], 0
    for column, series in probe.items():
        if column != "time":
            name, k = column.removesuffix("]").split("[")
            wanted = result.field(name)
            assert series[-1] == pytest.approx(wanted[int(k)], rel=1e-12, abs=1e-13 * np.abs(wanted).max())
            compared += 1
    assert compared >= 5 * len(places)
    assert np.abs(result.particles["plastic_strain"]).max() > 1e-3
    for name in ("velocity_x", "displacement_x"):
        values = result.field(name)
        assert result.probes["sum"][name][-1] == pytest.approx(values.sum(), abs=1e-12)
        assert result.probes["max"][name][-1] == pytest.approx(values.max(), abs=1e-14)
        read = np.array([probe[f"{name}[{k}]"][-1] for k in range(len(places))])
        assert result.error(read, name) < 1e-12


@pytest.mark.parametrize("form", FORMS)
def test_internals_stay_within_the_range_of_the_places_around(form: str) -> None:
    """A spike in one place, in every place in turn: no frame and no probe shows less than nothing or more than the spike."""
    holed = {"type": "difference", "shapes": [scenes.cube(2), scenes.box((0.5, 1.0), (0.0, 0.5))]}
    for shape in (scenes.cube(2), holed):
        scene = flowing(form, 2, state="stress").with_(**{"bodies.0.shape": shape})
        run = compose(scene).bodies[0]
        state, points = run.system.state, np.random.default_rng(1).uniform((0.02, 0.52), (0.48, 0.98), (20, 2))
        places = len(state.read("internals"))
        names = list(run.constitutive.internals)
        for spike in range(0, places, 3):
            values = np.zeros((places, len(names)))
            values[spike] = 1.0
            state.write("internals", values)
            shown = run.system.filtered("internals")  # the thinning of a sheet and what laws keep for themselves too
            assert shown.min() >= 0.0
            assert shown.max() <= 1.0
            assert run.reading.si("plastic_strain").min() >= 0.0
        probe = {"name": "p", "at": points.tolist(), "fields": ["plastic_strain"], "every": 1}
        recorded = compose(scene.with_(probes=[probe]))
        state, recorder = recorded.bodies[0].system.state, recorded.probes[0]
        for spike in range(0, places, 3):
            values = np.zeros((places, len(names)))
            values[spike] = 1.0
            state.write("internals", values)
            recorder.record()
            recorder.flush([0])
        read = np.stack(list(recorder.columns().values()))
        assert read.min() >= 0.0
        assert 0.1 < read.max() <= 1.0


def test_damage_stays_within_the_range_of_the_points_around() -> None:
    part = {"fracture_energy": 1.0, "length": 0.5}
    scene = scenes.block(2, 4, phase_field=part, tables={"output": {"fields": ["damage"]}})
    run = compose(scene).bodies[0]
    places = run.system.state.counts["damage"]
    assert places < run.reading.count
    for spike in range(places):
        values = np.zeros((places, 1))
        values[spike] = 1.0
        run.system.state.write("damage", values)
        shown = run.reading.si("damage")
        assert shown.min() >= 0.0
        assert 0.2 < shown.max() <= 1.0


@pytest.mark.parametrize("jitter", [0.0, 0.2])
@pytest.mark.parametrize("form", ["stress-points", "tsph", "ul-tsph"])
def test_linear_fields_stay_exact(form: str, jitter: float) -> None:
    """Stress everywhere, and internals where the places around reach beyond a node."""
    run = compose(flowing(form, 2, jitter=jitter)).bodies[0]
    places, nodes = run.reading.where("stress"), run.reading.positions
    slope = np.array([0.3, 0.7])
    state = run.system.state
    state.write("stress", np.repeat((places @ slope)[:, None], state.widths["stress"], 1))
    state.write("internals", np.repeat((places @ slope)[:, None], state.widths["internals"], 1))
    assert run.system.filtered("stress")[:, 0] == pytest.approx(nodes @ slope, abs=1e-12)
    inside = ~run.system.lattice.on_face
    assert inside.sum() == 9
    assert run.system.filtered("internals")[inside, 0] == pytest.approx((nodes @ slope)[inside], abs=1e-12)


def test_cells_of_any_kind_are_read_as_those_of_a_grid() -> None:
    """A fitted disc: weights are small, linear fields exact, probes at its nodes are frames, and bounds hold."""
    disc = {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}
    scene = flowing("stress-points", 2).with_(**{"bodies.0.shape": disc, "bodies.0.spacing": 0.125}, boundary=[])
    run = compose(scene).bodies[0]
    state, nodes = run.system.state, run.reading.positions
    slope = np.array([0.3, 0.7])
    state.write("stress", np.repeat((run.reading.where("stress") @ slope)[:, None], state.widths["stress"], 1))
    assert run.system.filtered("stress")[:, 0] == pytest.approx(nodes @ slope, abs=1e-12)
    for spike in range(0, state.counts["internals"], 5):
        values = np.zeros((state.counts["internals"], state.widths["internals"]))
        values[spike] = 1.0
        state.write("internals", values)
        shown = run.system.filtered("internals")
        assert shown.min() >= 0.0
        assert 0.1 < shown.max() <= 1.0
    probe = {"name": "p", "at": nodes.tolist(), "fields": ["stress_xy", "plastic_strain"]}
    result = wsph.run(scene.with_(probes=[probe]))
    for name in ("stress_xy", "plastic_strain"):
        read = np.array([result.probes["p"][f"{name}[{k}]"][-1] for k in range(len(nodes))])
        assert read == pytest.approx(result.field(name), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("dim", [1, 2])
def test_a_selection_without_a_stress_point_is_refused_by_name(dim: int) -> None:
    """Nodes stand on the face, stress points half a cell inside."""
    probe = {"name": "p", "where": "x <= 0", "reduce": "max", "fields": ["velocity_x", "stress_xx"]}
    with pytest.raises(
        wsph.SceneError,
        match=r"probes.0.where: 'x <= 0' selects no place of 'stress', which stands at the points inside the cells of body 'b': widen it by half a spacing \(0.125 m\), or name points with `at`",
    ):
        wsph.run(flowing("stress-points", dim).with_(probes=[probe]))
    inner = {"name": "p", "where": "x > 0.1 and x < 0.2", "reduce": "mean", "fields": ["stress_xx"]}
    assert len(wsph.run(flowing("stress-points", dim).with_(probes=[inner], end=0.1)).probes["p"]["stress_xx"]) > 2
    with pytest.raises(wsph.SceneError, match=r"selects no place of 'velocity', which stands at the particles"):
        wsph.run(flowing("stress-points", dim).with_(probes=[inner | {"fields": ["stress_xx", "velocity_x"]}]))


def test_a_point_on_a_crack_has_two_values() -> None:
    cracked = scenes.block(2, 4, cracks=[{"from": [0.0, 0.5], "to": [0.5, 0.5]}])
    with pytest.raises(
        wsph.SceneError, match=r"\[0.25, 0.5\] is on a crack, with a value on either side: name a point beside"
    ):
        wsph.run(cracked.with_(probes=[{"name": "p", "at": [[0.25, 0.5]], "fields": ["velocity_x"]}]))


def test_what_is_read_is_the_nearer_of_two_values() -> None:
    """A sheet of two sets that a load pulls to rest: the particles themselves have an odd-even part that nothing sees, by a
    fifth of the displacement of the loaded corner; frames and probes are within 1 % of p x/E."""
    load = {"functions": {"ramp": {"t": [0.0, 5.0, 100.0], "value": [0.0, 1e-3, 1e-3]}}}
    faces = [{"body": "b", "face": "-x", "fixed": ["x"]}, {"body": "b", "face": "-y", "fixed": ["y"]}]
    faces += [{"body": "b", "face": "+x", "stress": {"xx": "ramp", "xy": 0.0}}]
    at = {"name": "corner", "at": [[1.0, 1.0]], "fields": ["displacement"], "every": 100}
    tables = {**load, "boundary": faces, "probes": [at], "output": {"fields": ["displacement"]}}
    run = {"integrator": "ul-tsph", "cfl": 0.5, "end": 40.0}
    result = wsph.run(scenes.block(2, 10, state="stress", damping={"rate": 1.0}, run=run, tables=tables))
    exact = 1e-3 * result.particles["position"] * [1.0, -0.3]
    for k, (name, gate) in enumerate((("displacement_x", 0.005), ("displacement_y", 0.01))):
        assert np.abs(result.field(name) - exact[:, k]).max() < gate * np.abs(exact[:, k]).max()
        assert result.probes["corner"][name][-1] == pytest.approx(result.field(name)[-1], rel=1e-13)


def test_between_particles_the_middles_of_the_cells_are_selected() -> None:
    """A stretching bar of particles at 0, 0.1, 0.2, ...: between two of them its velocity is read in the middle."""
    probe = {"name": "p", "where": "x > 0.2 and x < 0.3", "reduce": "mean", "fields": ["velocity_x"]}
    result = wsph.run(scenes.bar(10, run={"formulation": "total-lagrangian", "end": 0.01}, velocity=["1e-3*x"], tables={"probes": [probe]}))  # fmt: skip
    assert result.probes["p"]["velocity_x"][0] == pytest.approx(0.25e-3)
