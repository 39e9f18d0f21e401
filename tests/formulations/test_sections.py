"""Forces and moments through planes of a body: in balance with what acts on either part, to rounding."""

from functools import cache

import numpy as np
import pytest

import wsph
from tests.scenes import FORMS, body, box, cube, held, scene
from wsph.errors import SceneError
from wsph.simulation.compose import compose
from wsph.simulation.probing.numbers import Numbers
from wsph.validation.case import example

ONE_SET = (*FORMS, "updated-lagrangian")
REST = {"damping": {"rate": 0.9}}
"""Near the critical damping of the slowest mode of the blocks here."""


@cache
def at_rest(form: str) -> wsph.Result:
    """A short cantilever under a load at its end, damped until it rests."""
    entries = [held("-x", 2), {"body": "b", "face": "+x", "name": "tip", "traction": {"y": -1e-3, "x": 5e-4}}]
    planes = [
        {"name": "mid", "body": "b", "point": [0.51, 0.25], "normal": [1.0, 0.0]},
        {"name": "back", "body": "b", "point": [0.51, 0.25], "normal": [-3.0, 0.0]},
        {"name": "oblique", "body": "b", "point": [0.45, 0.1], "normal": [1.0, 0.2]},
    ]
    run = {"formulation": form, "end": 90.0, "cfl": 0.5}
    spacing = 0.0625 if form == "updated-lagrangian" else 0.125
    block, output = body(box(1.0, 0.5), spacing, **REST), {"fields": ["displacement"]}
    return wsph.run(scene(block, run=run, boundary=entries, sections=planes, output=output))


@pytest.mark.parametrize("form", ONE_SET)
def test_at_rest_they_are_the_loads_in_front(form: str) -> None:
    result = at_rest(form)
    last = {name: values[-1] for name, values in result.history.items()}
    assert last["kinetic"] < 1e-22
    # All loads act in front of the planes: in the current configuration on up to six layers behind the face, and what holds
    # the body there on as many beside the wall.
    force = np.array([5e-4, -1e-3]) * 0.5
    for name in ("mid", "oblique"):
        there = np.array([last[f"section_{name}_x"], last[f"section_{name}_y"]])
        assert np.abs(there - force).max() < 1e-9 * np.abs(force).max()
        assert there == pytest.approx(-np.array([last["reaction_b-1_x"], last["reaction_b-1_y"]]), rel=1e-8)
    # From the other side: the other way, about the same point.
    for number in ("x", "y", "moment"):
        assert last[f"section_back_{number}"] == pytest.approx(-last[f"section_mid_{number}"], rel=1e-9)


def test_in_the_current_configuration_moments_grow_by_the_force_times_the_way() -> None:
    last = {name: values[-1] for name, values in at_rest("updated-lagrangian").history.items()}
    arm, force = np.array([0.06, 0.15]), np.array([last["section_mid_x"], last["section_mid_y"]])
    further = arm[0] * force[1] - arm[1] * force[0]
    assert last["section_oblique_moment"] == pytest.approx(last["section_mid_moment"] + further, rel=1e-8)


@pytest.mark.parametrize("form", FORMS)
def test_their_moments_are_those_of_the_loads_where_they_act_now(form: str) -> None:
    result = at_rest(form)
    last = {name: values[-1] for name, values in result.history.items()}
    X, u = result.particles["position"], result.particles["displacement"]
    on = np.flatnonzero(X[:, 0] > 1.0 - 1e-9)
    length = np.where((X[on, 1] < 1e-9) | (X[on, 1] > 0.5 - 1e-9), 0.0625, 0.125)
    f = length[:, None] * np.array([5e-4, -1e-3])
    for name, point in (("mid", [0.51, 0.25]), ("oblique", [0.45, 0.1])):
        r = X[on] + u[on] - np.array(point)
        moment = float((r[:, 0] * f[:, 1] - r[:, 1] * f[:, 0]).sum())
        assert last[f"section_{name}_moment"] == pytest.approx(moment, rel=1e-8)


def test_a_long_cantilever_has_the_moment_of_its_load_at_the_root() -> None:
    entries = [held("-x", 2), {"body": "b", "face": "+x", "traction": {"y": -1e-6}}]
    root = {"name": "root", "body": "b", "point": [0.0, 0.1], "normal": [1.0, 0.0]}
    beam = body(box(1.0, 0.2), 0.05, damping={"rate": 0.4}, state="stress")
    history = wsph.run(scene(beam, run={"end": 150.0, "cfl": 0.5}, boundary=entries, sections=[root])).history
    assert history["section_root_y"][-1] == pytest.approx(-0.2e-6, rel=1e-6)
    assert history["section_root_moment"][-1] == pytest.approx(-0.2e-6, rel=1e-4)
    assert history["section_root_x"][-1] == pytest.approx(0.0, abs=1e-11)


def test_in_motion_they_are_the_inertia_of_the_part_behind() -> None:
    """Of a body that nothing holds, the momentum of the part behind changes by the force through the plane alone: leapfrog
    takes the mean of those at both ends of a step."""
    spin = ["-0.05*(y - 0.5) + 0.02*x", "0.05*(x - 0.5)"]
    plane = {"name": "cut", "body": "b", "point": [0.5, 0.5], "normal": [1.0, 0.0]}
    probe = {"name": "sum", "where": "x < 0.5", "reduce": "sum", "fields": ["velocity_x", "velocity_y"], "every": 1}
    run = {"formulation": "updated-lagrangian", "end": 0.5, "cfl": 0.3}
    shown = {"sections": [plane], "probes": [probe], "output": {"history": 1}}
    result = wsph.run(scene(body(cube(2), 0.1, velocity=spin), run=run, **shown))
    for axis in "xy":
        force = result.history[f"section_cut_{axis}"]
        # Particles are cells, of one mass.
        change = np.diff(0.01 * result.probes["sum"][f"velocity_{axis}"]) / np.diff(result.history["time"])
        assert np.abs(change - 0.5 * (force[1:] + force[:-1])).max() < 1e-11 * np.abs(force).max()
    assert np.abs(result.history["section_cut_x"]).max() > 0.0


@pytest.mark.parametrize("form", FORMS)
def test_in_motion_what_reaches_the_support_is_its_reaction(form: str) -> None:
    entries = [held("-x", 2), {"body": "b", "face": "+x", "traction": {"y": "-1e-3*sin(5*t)"}}]
    root = {"name": "root", "body": "b", "point": [0.0, 0.0], "normal": [1.0, 0.0]}
    run = {"formulation": form, "end": 4.0, "cfl": 0.3}
    made = scene(
        body(cube(2), 0.1), run=run, boundary=entries, sections=[root], gravity={"y": -1e-3}, output={"history": 1}
    )
    history = wsph.run(made).history
    # Of the column of nodes that is held half a cell's mass hangs at the support itself.
    weight = {"x": 0.0, "y": -1e-3 * 0.05}
    for axis in "xy":
        force, reaction = history[f"section_root_{axis}"], history[f"reaction_b-1_{axis}"]
        gap = reaction[1:] + 0.5 * (force[1:] + force[:-1]) + weight[axis]
        assert np.abs(gap).max() < 1e-11 * np.abs(reaction).max()


def test_in_three_dimensions_and_in_one() -> None:
    entries = [held("-x", 3), {"body": "b", "face": "+x", "traction": {"y": 1e-3, "z": 2e-3}}]
    plane = {"name": "cut", "body": "b", "point": [0.5, 0.25, 0.25], "normal": [1.0, 0.0, 0.0]}
    run = {"end": 90.0, "cfl": 0.5}
    made = scene(body(box(1.0, 0.5, 0.5), 0.25, **REST), run=run, boundary=entries, sections=[plane])
    last = {name: values[-1] for name, values in wsph.run(made).history.items() if name.startswith("section")}
    assert list(last) == [f"section_cut_{part}" for part in ("x", "y", "z", "moment_x", "moment_y", "moment_z")]
    assert [last[f"section_cut_{axis}"] for axis in "xyz"] == pytest.approx([0.0, 0.25e-3, 0.5e-3], rel=1e-8, abs=1e-11)
    assert last["section_cut_moment_z"] == pytest.approx(0.5 * 0.25e-3, rel=0.05)
    assert last["section_cut_moment_y"] == pytest.approx(-0.5 * 0.5e-3, rel=0.05)
    assert last["section_cut_moment_x"] == pytest.approx(0.0, abs=1e-6)
    ends = [{"body": "b", "face": "-x", "fixed": ["x"]}, {"body": "b", "face": "+x", "traction": {"x": 1e-3}}]
    bar = scene(body(box(1.0), 0.1, **REST), run={"end": 40.0, "cfl": 0.5}, boundary=ends, sections=[{"name": "cut", "body": "b", "point": [0.3], "normal": [1.0]}])  # fmt: skip
    history = wsph.run(bar).history
    assert [name for name in history if name.startswith("section")] == ["section_cut_x"]
    assert history["section_cut_x"][-1] == pytest.approx(1e-3, rel=1e-7)


def test_a_cut_through_a_ring_has_the_pressure_on_its_bore() -> None:
    """At rest the force across the plane is that of the pressure on the part behind, to rounding, and that on the bore."""
    made = compose(example("ring").with_(**{"bodies.0.spacing": 0.01, "run.end": 2.5e-3}))
    made.program.run(made.steps)
    system, scales = made.bodies[0].system, made.scales
    system.refresh(system.state)
    cut = next(each for each in system.reported if each.name == "cut")
    x, y, moment = Numbers([cut], scales, 2).values()
    behind = system.position[:, 1] <= 1e-9
    loads = system.loads.following.numpy() * scales.stress * scales.length
    assert np.abs(np.array([x, y]) + loads[behind].sum(0)).max() < 1e-9 * y
    place = system.position + system.state.read("displacement") * scales.length
    turning = (place[:, 0] * loads[:, 1] - place[:, 1] * loads[:, 0])[behind].sum()
    assert abs(moment + turning) < 1e-9 * y * 0.1
    assert y == pytest.approx(1e5, rel=1e-2)


def test_where_it_leaves_nothing_and_where_there_are_no_forces_it_is_refused() -> None:
    plane = {"name": "cut", "body": "b", "point": [1.0, 0.0], "normal": [1.0, 0.0]}
    with pytest.raises(SceneError, match="sections.0.point: the plane leaves no particle of body 'b' in front of it"):
        wsph.run(scene(body(cube(2), 0.2), sections=[plane]))
    two = scene(body(cube(2), 0.2), run={"integrator": "tsph", "cfl": 0.3}, sections=[plane])
    with pytest.raises(SceneError, match="sections.0: the small-strain form has no forces between particles"):
        wsph.run(two)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"normal": [0.0, 0.0]}, "sections.0.normal: is zero: it has no direction"),
        ({"normal": [1.0]}, r"sections.0.normal: \[1.0\] has 1 coordinates in a scene of dim = 2"),
        ({"point": [1.0, 0.0, 0.0]}, r"sections.0.point: .* has 3 coordinates"),
        ({"body": "c"}, "sections.0.body: no body is named 'c'"),
        ({"name": "b-1"}, "sections.0.name: 'b-1' names boundary.0 already"),
    ],
)
def test_faults_name_their_keys(changes: dict, message: str) -> None:
    plane = {"name": "cut", "body": "b", "point": [0.5, 0.0], "normal": [1.0, 0.0]} | changes
    with pytest.raises(SceneError, match=message):
        scene(body(cube(2), 0.2), boundary=[held("-x", 2)], sections=[plane])
