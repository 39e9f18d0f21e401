"""Reactions and works of boundaries: with gravity they are the change of momentum, step by step, and the external work."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import FORMS, body, box, cube, held, scene
from wsph.errors import SceneError

ROUNDING = 1e-11
"""Of some hundreds of forces added up, beside the largest."""

ONE_SET = (*FORMS, "updated-lagrangian")


def of_side(result: wsph.Result, axis: str, dim: int, at_ends: tuple[str, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
    """The change of momentum in every step over dt, and the sum of the reactions. Of the boundaries `at_ends` it is the
    mean of both ends of the step."""
    history = result.history
    change = np.diff(history[f"momentum_{axis}"]) / np.diff(history["time"])
    total = np.zeros_like(change)
    for name, values in history.items():
        if name.startswith("reaction_") and name.endswith(f"_{axis}"):
            ends = name[len("reaction_") : -2] in at_ends
            total += 0.5 * (values[1:] + values[:-1]) if ends else values[1:]
    return change, total


def gap(result: wsph.Result, dim: int, weight: np.ndarray, at_ends: tuple[str, ...] = ()) -> float:
    """How far reactions and the `weight` (dim,) are from the change of momentum, beside the largest reaction."""
    largest = max(np.abs(v).max() for name, v in result.history.items() if name.startswith("reaction_"))
    assert largest > 0.0
    sides = [of_side(result, axis, dim, at_ends) for axis in "xyz"[:dim]]
    return max(np.abs(a - b - w).max() for (a, b), w in zip(sides, weight, strict=True)) / largest


def works(result: wsph.Result) -> np.ndarray:
    return sum(values for name, values in result.history.items() if name.startswith("work_"))


def loaded(dim: int, run: Any, **keys: Any) -> wsph.Scene:
    """A block held on the left, driven on the right, loaded on top in two ways and pulled by gravity."""
    entries = [held("-x", dim), {"body": "b", "face": "+x", "name": "driven", "velocity": {"x": "0.02*sin(3*t)"}}]
    if dim > 1:
        top = {"y": "1e-3*cos(2*t)*(1+x)", "x": 2e-4}
        entries.append({"body": "b", "face": "+y", "name": "top", "traction": top})
        entries.append({"body": "b", "where": "y > 0.7", "traction": {"y": 3e-4}})
        entries.append({"body": "b", "face": "-y", "fixed": ["y"]})
    gravity = {"xyz"[dim - 1]: -1e-3}
    shape = body(cube(dim), 0.25 if dim == 3 else 0.125)
    return scene(shape, run=run, boundary=entries, gravity=gravity, output={"history": 1}, **keys)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("form", FORMS)
def test_they_are_the_change_of_momentum_step_by_step_and_the_external_work(form: str, dim: int) -> None:
    result = wsph.run(loaded(dim, {"formulation": form, "end": 1.5, "cfl": 0.3}))
    weight = np.zeros(dim)
    weight[-1] = -1e-3
    assert gap(result, dim, weight) < ROUNDING
    external = result.history["external_work"] - result.history["external_work"][0]
    # The rate of gravity's work is g times the momentum, and what this is between steps is known to dt^2.
    momentum, time = result.history[f"momentum_{'xyz'[dim - 1]}"], result.history["time"]
    gravity = np.concatenate([[0.0], np.cumsum(0.5 * (momentum[1:] + momentum[:-1]) * np.diff(time))]) * -1e-3
    assert np.abs(external - works(result) - gravity).max() < 1e-3 * np.abs(external).max()


@pytest.mark.parametrize("form", ONE_SET)
def test_the_works_of_all_boundaries_are_the_external_work(form: str) -> None:
    result = wsph.run(loaded(2, {"formulation": form, "end": 1.5, "cfl": 0.3}).with_(gravity={}))
    external = result.history["external_work"] - result.history["external_work"][0]
    assert np.abs(external - works(result)).max() < 1e-12 * np.abs(external).max()


WALLS = [
    [held("-x", 2), {"body": "b", "face": "+x", "velocity": {"x": -0.02}}, {"body": "b", "face": "-y", "fixed": ["y"]}],
    [{"body": "b", "face": side, "symmetry": side[1]} for side in ("-x", "-y", "+y")]
    + [{"body": "b", "face": "+x", "velocity": {"x": "-0.02*t"}, "fixed": ["y"]}],
    [held("-x", 2), {"body": "b", "face": "+x", "fixed": ["x"]}, {"body": "b", "face": "+x", "velocity": {"y": 0.01}}],
    [held(side, 2) for side in ("-x", "+x", "-y")] + [{"body": "b", "face": "+y", "velocity": {"x": 0.01, "y": 0.0}}],
]  # fmt: skip


@pytest.mark.parametrize("entries", WALLS)
def test_those_of_walls_with_images_too(entries: list) -> None:
    """Forces of walls are those of an instant: leapfrog takes the mean of both ends."""
    made = scene(
        body(box(1.0, 0.8), 0.1),
        run={"formulation": "updated-lagrangian", "end": 0.5, "cfl": 0.3},
        boundary=entries,
        output={"history": 1},
    )
    result = wsph.run(made)
    names = tuple(f"b-{k + 1}" for k in range(len(entries)))
    assert gap(result, 2, np.zeros(2), names) < ROUNDING
    external = result.history["external_work"] - result.history["external_work"][0]
    assert np.abs(external - works(result)).max() < 1e-12 * np.abs(external).max()


def test_walls_of_symmetry_are_pushed_alike() -> None:
    """A square that is squeezed alike from two sides: corners are shared alike."""
    sides = [
        *({"body": "b", "face": f"-{axis}", "fixed": ["x", "y"]} for axis in "xy"),
        *({"body": "b", "face": f"+{axis}", "fixed": ["x", "y"]} for axis in "xy"),
    ]
    run = {"formulation": "updated-lagrangian", "end": 0.3, "cfl": 0.3}
    velocity = ["0.01*(x - 0.5)", "0.01*(y - 0.5)"]
    history = wsph.run(scene(body(cube(2), 0.1, velocity=velocity), run=run, boundary=sides)).history
    last = {name: values[-1] for name, values in history.items() if name.startswith("reaction")}
    size = abs(last["reaction_b-1_x"])
    assert size > 0.0
    for one, other in (("b-1_x", "b-2_y"), ("b-3_x", "b-4_y")):
        assert abs(last[f"reaction_{one}"] - last[f"reaction_{other}"]) < 1e-12 * size
    assert abs(last["reaction_b-1_x"] + last["reaction_b-3_x"]) < 1e-12 * size
    assert abs(last["reaction_b-1_y"]) < 1e-12 * size


METHODS = ["leapfrog", {"name": "leapfrog", "lagged": True}, "rk4", "kg4-8", "w20-2-8", "blanes-moan4", "pc2",
           {"name": "rkc", "stages": 4}]  # fmt: skip


@pytest.mark.parametrize("integrator", METHODS, ids=str)
def test_with_every_integrator_where_loads_do_not_change(integrator: Any) -> None:
    """Supports exactly, at rest and moved; a load that is the same at all stages too."""
    entries = [
        held("-x", 2),
        {"body": "b", "face": "+x", "traction": {"x": 1e-3, "y": 2e-4}},
        {"body": "b", "face": "-y", "velocity": {"y": "0.01*sin(3*t)"}},
    ]
    viscous = {"viscosity": {"alpha": 0.5, "beta": 0.0, "kind": "pair"}}
    needs = {} if integrator in ("blanes-moan4",) else viscous
    made = scene(
        body(cube(2), 0.2, **needs),
        run={"integrator": integrator, "end": 0.5, "cfl": 0.1, "formulation": "total-lagrangian", "guard": "warn"},
        boundary=entries,
        output={"history": 1},
    )
    assert gap(wsph.run(made), 2, np.zeros(2)) < ROUNDING


def test_rkc_and_processed_leapfrog_with_faces_that_stand_still() -> None:
    entries = [held("-x", 2), {"body": "b", "face": "+x", "traction": {"x": 1e-3}}]
    for integrator, keys, most in (
        ({"name": "rkc", "stages": 4}, {"viscosity": {"alpha": 0.5, "beta": 0.0, "kind": "pair"}}, ROUNDING),
        # Its momentum is that of the processed variables, dt^2/12 da/dt off.
        ("lf4", {}, 1e-2),
    ):
        run = {"integrator": integrator, "end": 0.5, "cfl": 0.1, "formulation": "total-lagrangian", "guard": "warn"}
        result = wsph.run(scene(body(cube(2), 0.2, **keys), run=run, boundary=entries, output={"history": 1}))
        assert gap(result, 2, np.zeros(2)) < most


def test_of_sliding_faces_along_their_own_normals_alone() -> None:
    """A disc between two half planes at an angle, held and driven along their normals, with a component held beside."""
    wedge = {"type": "polygon", "points": [[0.0, 0.0], [1.0, 0.0], [1.2, 0.7], [0.2, 0.7]]}
    entries = [
        {"body": "b", "where": "y < 0.001", "name": "base", "fixed": ["y"]},
        {"body": "b", "where": "abs(0.7*(x - 1) - 0.2*y) < 1e-6", "name": "slope", "normal": "-0.01*sin(3*t)"},
        {"body": "b", "where": "abs(0.7*x - 0.2*y) < 1e-6", "name": "other", "normal": 0.0},
    ]
    made = scene(
        body(wedge, 0.1, surface="fitted"),
        run={"formulation": "stress-points", "end": 0.5, "cfl": 0.3},
        boundary=entries,
        output={"history": 1},
    )
    result = wsph.run(made)
    assert gap(result, 2, np.zeros(2)) < ROUNDING
    history = result.history
    external = history["external_work"] - history["external_work"][0]
    assert np.abs(external - works(result)).max() < 1e-12 * np.abs(external).max()
    # Each pushes along its normal.
    for name in ("slope", "other"):
        x, y = (history[f"reaction_{name}_{axis}"][1:] for axis in "xy")
        assert np.abs(0.2 * x + 0.7 * y).max() < 1e-12 * np.abs(x).max()
    assert np.abs(history["reaction_base_x"]).max() < 1e-12 * np.abs(history["reaction_base_y"]).max()


def test_of_pressure_that_follows_and_of_two_loads_on_one_particle() -> None:
    entries = [
        held("-x", 2),
        {"body": "b", "face": "+y", "name": "gas", "pressure": "2e-3*min(t, 1)"},
        {"body": "b", "face": "+x", "name": "pull", "traction": {"x": 1e-3}},
    ]
    made = scene(
        body(cube(2), 0.2),
        run={"formulation": "stress-points", "end": 1.5, "cfl": 0.3},
        boundary=entries,
        output={"history": 1},
    )
    result = wsph.run(made)
    assert gap(result, 2, np.zeros(2)) < ROUNDING
    assert result.history["reaction_pull_x"] == pytest.approx(1e-3, rel=1e-12)
    external = result.history["external_work"] - result.history["external_work"][0]
    assert np.abs(external - works(result)).max() < 1e-12 * np.abs(external).max()


SPRINGS = {"body": "b", "face": "+x", "name": "springs", "spring": {"stiffness": {"normal": 0.5, "tangential": 0.1}}}


@pytest.mark.parametrize("form", FORMS)
def test_of_springs_to_rounding_and_none_of_periodic_faces(form: str) -> None:
    made = scene(
        body(cube(2), 0.1, velocity=["0.02*cos(pi*x)", "0.01*x"]),
        run={"formulation": form, "end": 1.0, "cfl": 0.3},
        boundary=[SPRINGS, {"body": "b", "face": "+y", "periodic": "-y"}],
        output={"history": 1},
    )
    result = wsph.run(made)
    assert gap(result, 2, np.zeros(2)) < ROUNDING
    assert result.history["work_springs"][-1] < 0.0
    assert not [name for name in result.history if "b-2" in name]


def test_of_quiet_faces_to_the_square_of_the_step() -> None:
    """Leapfrog finds the forces of dashpots with predicted velocities."""
    gaps: list[tuple[float, float]] = []
    for cfl in (0.1, 0.05):
        made = scene(
            body(cube(2), 0.1, velocity=["0.02*(1 - cos(2*pi*x))", "0.01*x^2"]),
            run={"formulation": "stress-points", "end": 1.0, "cfl": cfl},
            boundary=[SPRINGS, {"body": "b", "face": "-x", "name": "quiet", "quiet": True}],
            output={"history": 1},
        )
        result = wsph.run(made)
        dissipated = result.history["dissipated"]
        lost = np.abs(result.history["work_quiet"] + dissipated).max() / dissipated.max()
        gaps.append((gap(result, 2, np.zeros(2)), lost))
    assert gaps[0][0] < 3e-3
    for first, second in zip(*gaps, strict=True):
        assert second < 0.3 * first


def test_a_body_force_is_of_no_boundary() -> None:
    made = scene(
        body(cube(2), 0.2, body_force={"x": 1e-3}),
        run={"formulation": "stress-points", "end": 0.5, "cfl": 0.3},
        boundary=[held("-x", 2)],
        output={"history": 1},
    )
    assert gap(wsph.run(made), 2, np.array([1e-3, 0.0])) < ROUNDING


def test_a_bar_at_rest_between_its_load_and_its_support() -> None:
    """Damped to rest: what holds it is what pulls at it, in single precision too."""
    entries = [{"body": "b", "face": "-x", "fixed": ["x"]}, {"body": "b", "face": "+x", "traction": {"x": 1e-3}}]
    damped = body(box(1.0), 0.1, damping={"rate": 3.0})
    for precision, most in (("f64", 1e-9), ("f32", 1e-4)):
        run = {"end": 30.0, "cfl": 0.5, "precision": precision}
        history = wsph.run(scene(damped, run=run, boundary=entries)).history
        assert history["reaction_b-1_x"][-1] == pytest.approx(-1e-3, rel=most)


def test_names_are_given_or_counted_and_are_columns(tmp_path: Path) -> None:
    entries = [held("-x", 2), {"body": "b", "face": "+x", "name": "pull", "traction": {"x": 1e-3}}, {"body": "b", "face": "+y", "fixed": ["y"]}]  # fmt: skip
    made = scene(body(cube(2), 0.2), run={"end": 0.1}, boundary=entries)
    wsph.run(made, tmp_path / "out")
    names = (tmp_path / "out" / "history.csv").read_text().splitlines()[0].split(",")
    assert names[-9:] == [
        *("reaction_b-1_x", "reaction_b-1_y", "work_b-1"),
        *("reaction_pull_x", "reaction_pull_y", "work_pull"),
        *("reaction_b-3_x", "reaction_b-3_y", "work_b-3"),
    ]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["one", "One"], "boundary.1.name: 'One' names boundary.0 already"),
        (["b-2", None], "boundary.1.name: 'b-2' names boundary.0 already"),
        (["a b", None], "boundary.0.name: 'a b': a name has at most 100"),
    ],
)
def test_two_of_one_name_are_refused(names: list, message: str) -> None:
    sides = [{"body": "b", "face": face, "fixed": ["x"]} for face in ("-x", "+x")]
    entries = [side | ({"name": name} if name else {}) for side, name in zip(sides, names, strict=True)]
    with pytest.raises(SceneError, match=message):
        scene(body(cube(2), 0.2), boundary=entries)


def test_a_resumed_run_has_the_same_bits(tmp_path: Path) -> None:
    made = loaded(2, {"formulation": "updated-lagrangian", "end": 0.6, "cfl": 0.3}, checkpoint={"every": 5})
    straight = wsph.run(made)
    wsph.run(made.with_(end=0.3), tmp_path / "cut")
    resumed = wsph.run(made, tmp_path / "cut", resume=True)
    for name, values in straight.history.items():
        assert np.array_equal(values, resumed.history[name]), name


def test_two_sets_have_none(tmp_path: Path) -> None:
    made = scene(body(cube(2), 0.2), run={"integrator": "tsph", "end": 0.1, "cfl": 0.3}, boundary=[held("-x", 2)])
    assert not [name for name in wsph.run(made).history if name.startswith(("reaction", "work"))]
