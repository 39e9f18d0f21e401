"""Bodies that hit each other: waves through a contact, restitution, corners, bars that cross, an arm that folds."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.contact.meeting.cases import (
    OFFSETS,
    OVERLAPS,
    SPEED,
    corner_on_corner,
    face_on_face,
    made_in,
    mean_velocity,
    rods,
)  # fmt: skip
from wsph.backend import graph

ONE_SET = {"blanes-moan4", "kg4-8", "leapfrog", "rk4", "w20-2-8"}
"""Methods of particles that carry the whole motion that ask for no number beside the step, and hold a wave."""


def restitution(run: Any) -> float:
    return float((mean_velocity(run, 1) - mean_velocity(run, 0))[0] / 0.01)


def joint_bars(spacing: str, shift: str, form: str, other: str | None = None) -> wsph.Scene:
    """A pulse of 39.62 MPa, at 1 m/s, from a bar of steel of cells of 1 mm into one of others, `shift`ed aside."""
    steel = {"model": "elastic", "density": 7850.0, "youngs_modulus": "200 GPa", "poisson_ratio": 0.0}
    high = f"{4 + float(shift):g} mm"
    boxes = {"one": (["0 mm", "0 mm"], ["200 mm", "4 mm"]), "two": (["200 mm", f"{shift} mm"], ["400 mm", high])}
    bodies = [
        {"name": name, "shape": {"type": "box", "min": low, "max": up}, "state": "stress", "material": steel,
         "spacing": "1 mm" if name == "one" else spacing}
        for name, (low, up) in boxes.items()
    ]  # fmt: skip
    pulse = {"t": [0.0, 2e-6, 26e-6, 28e-6, 1.0], "value": [0.0, 39.62e6, 39.62e6, 0.0, 0.0]}
    probe = {"name": "two", "body": "two", "where": "x > 0.2499 and x < 0.2521", "reduce": "mean"}
    return wsph.Scene(
        schema=1, dim=2, run={"integrator": "leapfrog", "formulation": form, "end": "70 us", "cfl": 0.3},
        bodies=bodies, functions={"pulse": pulse}, contact=[{"between": ["one", "two"]}],
        boundary=[{"body": "one", "face": "-x", "traction": {"x": "pulse"}}],
        probes=[probe | {"fields": ["stress_xx", "velocity_x"]}],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("spacing", "shift", "form"),
    [
        ("0.5 mm", "0", "stress-points"),
        pytest.param("2 mm", "0", "stress-points", marks=pytest.mark.slow),
        pytest.param("1 mm", "0.5", "stress-points", marks=pytest.mark.slow),
        pytest.param("0.5 mm", "0", "total-lagrangian", marks=pytest.mark.slow),
    ],
)
def test_a_pulse_goes_through_lattices_that_do_not_match(spacing: str, shift: str, form: str) -> None:
    """As it goes through one bar: -39.62 MPa, 1 m/s. In one bar of the total Lagrangian form it is .13 % less, by what
    its waves are spread. A bar that is shifted aside by half a cell of four is not met over an eighth of its height."""
    run = wsph.run(joint_bars(spacing, shift, form))
    probe = run.probes["two"]
    there = 0.25 / np.sqrt(200e9 / 7850.0)
    on = (probe["time"] > there + 8e-6) & (probe["time"] < there + 20e-6)
    wanted = 1.0 - (0.006 if shift != "0" else 0.0)
    assert probe["stress_xx"][on].mean() == pytest.approx(-39.62e6 * wanted, rel=3e-3)
    assert probe["velocity_x"][on].mean() == pytest.approx(wanted, rel=3e-3)
    assert abs(run.history["contact_numerical"][-1]) < 1e-5 * run.history["external_work"][-1]


@pytest.mark.parametrize(
    ("form", "least"), [("stress-points", 0.985), ("total-lagrangian", 0.98), ("updated-lagrangian", 0.98)]
)
def test_rods_bounce(form: str, least: float) -> None:
    """Two rods that hit each other part after the time of a wave to the far end and back, with all of their speed but what
    the front of the wave leaves in vibrations, which falls with the cells."""
    found = [restitution(wsph.run(rods(cells, form))) for cells in (50, 100)]
    assert least < found[0] < found[1] < 1.0


def test_rods_of_unlike_cells_bounce() -> None:
    run = wsph.run(rods(50, "stress-points", ratio=0.5, stiffness=1.0))
    assert restitution(run) > 0.98
    assert np.abs([run.history[f"momentum_{axis}"][-1] for axis in "xy"]).max() < 1e-15


@pytest.mark.parametrize("method", ["rk4", "w20-2-8"])
def test_other_methods_see_the_same_contact(method: str) -> None:
    """Of several stages a step, whose forces have the other body where it is in the same stage."""
    lagged = wsph.run(rods(50, "stress-points", stiffness=1.0))
    run = wsph.run(rods(50, "stress-points", stiffness=1.0, run={"integrator": method, "cfl": 0.15}))
    assert restitution(run) == pytest.approx(restitution(lagged), abs=3e-3)
    assert abs(run.history["contact_numerical"][-1]) < 2e-3 * run.history["kinetic"][0]
    assert np.abs([run.history[f"momentum_{axis}"][-1] for axis in "xy"]).max() < 1e-14


@pytest.mark.parametrize("method", sorted(ONE_SET))
def test_a_step_that_is_left_open_keeps_energy(method: str) -> None:
    """With every method whose limit is known, of as many stages as it has: where the contact's stiffness is left open too,
    the step leaves it a cell's at least."""
    run = wsph.run(rods(20, "stress-points", run={"integrator": method, "cfl": "auto"}))
    assert 0.97 < restitution(run) < 1.0
    assert abs(run.history["contact_numerical"][-1]) < 5e-3 * run.history["kinetic"][0]
    assert np.abs([run.history[f"momentum_{axis}"][-1] for axis in "xy"]).max() < 1e-14


def test_damping_takes_part_of_a_bounce() -> None:
    run = wsph.run(rods(50, "stress-points", stiffness=1.0, damping=1.0))
    assert 0.97 < restitution(run) < 0.99
    history = run.history
    assert 0.002 < history["contact_dissipated"][-1] / history["kinetic"][0] < 0.03
    assert abs(history["contact_numerical"][-1]) < 2e-3 * history["kinetic"][0]


QUICK = {(corner_on_corner, 0.0), (corner_on_corner, 0.5), (face_on_face, 0.25)}
CORNERS = [
    pytest.param(case, offset, marks=[] if (case, offset) in QUICK else pytest.mark.slow)
    for case, offsets in ((corner_on_corner, OFFSETS), (face_on_face, OVERLAPS))
    for offset in offsets
]
"""Ten offsets of corners and eight overlaps of faces."""


@pytest.mark.parametrize(("case", "offset"), CORNERS)
def test_corners_make_no_energy(case: Any, offset: float) -> None:
    """Where nearest faces flip by a right angle. Without an account of what was put in contact made 12 % here."""
    run = wsph.run(case(offset))
    made, end, momentum = made_in(run)
    assert made < 5e-3
    assert end > -2e-2
    assert momentum < 1e-14


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [{"form": "total-lagrangian"}, {"ratio": 0.625}, {"stiffness": 4.0, "run": {"cfl": 0.15}}, {"friction": 0.3}],
    ids=["total-lagrangian", "ratio", "stiff", "friction"],
)
@pytest.mark.parametrize(("case", "offset"), [param.values for param in CORNERS if param.values[1] > 0.0])
def test_corners_of_all_kinds_make_no_energy(case: Any, offset: float, changes: dict[str, Any]) -> None:
    made, end, momentum = made_in(wsph.run(case(offset, **changes)))
    assert made < 5e-3
    assert end > -3e-2
    assert momentum < 1e-14


def crossed_bars(shift: float, speed: float, threads: int = 1, **contact: Any) -> wsph.Scene:
    """Two bars, 12 cells long and four wide, turned by 45 degrees about their axes and across each other: edges meet,
    `shift` cells from their vertices."""
    h, length, width = 0.1, 1.2, 0.4
    high, made = width * np.sqrt(0.5) + 0.02 * h, []
    for name, axis, side in (("a", 0, -1.0), ("b", 1, 1.0)):
        ends = [[-width / 2, width / 2] for _ in range(3)]
        ends[axis] = [-length / 2 + shift * h, length / 2 + shift * h]
        ends[2] = [side * high - width / 2, side * high + width / 2]
        turn = {"rotate": [[1 - axis, axis, 0], 45.0]}
        box = scenes.box(*map(tuple, ends)) | turn
        made.append(scenes.body(box, h, name, velocity=[0.0, 0.0, -0.5 * side * speed * SPEED]))
    run = {"formulation": "stress-points", "end": 12.0, "threads": threads}
    return scenes.scene(*made, run=run, contact=[{"between": ["a", "b"], **contact}])


def parting(run: Any, speed: float) -> np.ndarray:
    """Mean velocity of the second bar against the first's, in the speed of approach."""
    v = [run.particles["velocity"][run.particles["body"] == k].mean(0) for k in (0, 1)]
    return (v[1] - v[0]) / (speed * SPEED)


@pytest.mark.parametrize(
    ("shift", "sideways"),
    [(0.25, 0.02), *[pytest.param(*each, marks=pytest.mark.slow) for each in ((0.0, 0.1), (0.1, 0.02), (0.4, 0.02), (0.5, 0.02))]],
)  # fmt: skip
def test_crossed_bars_part_upright(shift: float, sideways: float) -> None:
    """They bounce without going sideways, wherever edges cross; with a little where vertices of both lie at the crossing."""
    run = wsph.run(crossed_bars(shift, 0.02))
    away = parting(run, 0.02)
    assert away[2] > 0.94
    assert np.abs(away[:2]).max() < sideways
    made, end, momentum = made_in(run)
    assert made < 1e-3
    assert end > -3e-2
    assert momentum < 1e-15


def test_threads_do_not_show() -> None:
    """The same bits, whatever the number of threads."""
    runs = [wsph.run(crossed_bars(0.3, 0.04, threads, friction=0.3)) for threads in (1, 3)]
    for field in ("velocity", "stress"):
        assert (runs[0].particles[field] == runs[1].particles[field]).all()
    assert all((runs[0].history[name] == runs[1].history[name]).all() for name in runs[0].history)


def test_threads_do_not_show_where_bodies_come_from_afar(monkeypatch: pytest.MonkeyPatch) -> None:
    """Launches come with the first search that finds anything, and go with the last: no step is the one that was timed."""
    monkeypatch.setattr(graph, "SMALL_PAIRS", 0)
    made = []
    for name, x, v in (("a", 0.0, 0.05), ("b", 1.3, -0.05)):
        made.append(scenes.body(scenes.box((x, x + 1.0), (0.0, 1.0)), 0.05, name, velocity=[v * SPEED, 0.0]))
    runs = []
    for threads in (1, 2):
        settings = {"formulation": "stress-points", "end": 12.0 / SPEED, "threads": threads}
        runs.append(wsph.run(scenes.scene(*made, run=settings, contact=[{"between": ["a", "b"], "friction": 0.2}])))
    assert np.abs(made_in(runs[0])[0]) < 1e-3
    assert mean_velocity(runs[0], 0)[0] < 0.0 < mean_velocity(runs[0], 1)[0]  # they have met and parted
    for field in ("velocity", "stress"):
        assert (runs[0].particles[field] == runs[1].particles[field]).all()


def test_a_resumed_run_goes_on_to_the_bit(tmp_path: Path) -> None:
    """In the middle of an impact with friction, from the memory of every contact."""
    scene = corner_on_corner(0.5, speed=0.1, friction=0.3, run={"end": 4.0})
    straight = wsph.run(scene, tmp_path / "straight")
    assert straight.history["contact_dissipated"][-1] > 0.0
    wsph.run(scene.with_(end=1.0, checkpoint={"every": 20}), tmp_path / "resumed")
    resumed = wsph.run(scene, tmp_path / "resumed", resume=True)
    # Its history has rows at checkpoints too.
    rows = np.isin(resumed.history["step"], straight.history["step"])
    steps = resumed.history["step"][rows]
    kept = np.isin(straight.history["step"], steps)
    assert steps.max() == straight.history["step"].max()
    for name, column in straight.history.items():
        assert (column[kept] == resumed.history[name][rows]).all(), name
    for name, field in straight.particles.items():
        assert np.array_equal(field, resumed.particles[name]), name


def test_single_precision() -> None:
    """A bounce and a corner, as in double precision to the digits that a float has."""
    for scene in (rods(30, "stress-points", stiffness=1.0), corner_on_corner(0.5, cells=12, run={"end": 6.0})):
        double, single = (wsph.run(scene.with_(precision=precision)) for precision in ("f64", "f32"))
        for name in ("kinetic", "contact_stored"):
            scale = double.history["kinetic"][0]
            assert np.abs(double.history[name] - single.history[name]).max() < 2e-3 * scale, name
        assert np.abs(single.history["contact_numerical"]).max() < 1e-2 * double.history["kinetic"][0]


def folded_strip(speed: float, form: str, contact: bool = True, **keys: Any) -> wsph.Scene:
    """A strip bent to a U: its arms, five cells apart, are thrown at each other."""
    h = 0.05
    parts = [
        scenes.box((0.0, 2.0), (0.0, 0.2)),
        scenes.box((0.0, 0.2), (0.0, 0.65)),
        scenes.box((0.0, 2.0), (0.45, 0.65)),
    ]
    half = f"{0.5 * speed * SPEED}*(x > 0.2)"
    made = scenes.body(
        {"type": "union", "shapes": parts}, h, "strip", velocity=["0", f"{half}*(2*(y < 0.3) - 1)*(x/2)"]
    )
    tables: dict[str, Any] = {"contact": [{"self": "strip", **keys}]} if contact else {}
    ends = [
        {"name": name, "body": "strip", "at": [[2.0, y]], "fields": ["displacement_y"]}
        for name, y in (("low", 0.2), ("high", 0.45))
    ]
    run = {"formulation": form, "end": 12.0 * h / (speed * SPEED)}
    return scenes.scene(made, run=run, probes=ends, **tables)


@pytest.mark.parametrize(
    ("form", "speed", "friction"),
    [
        ("stress-points", 0.05, 0.0),
        *[
            pytest.param(*each, marks=pytest.mark.slow)
            for each in (("stress-points", 0.14, 0.0), ("stress-points", 0.05, 0.3), ("total-lagrangian", 0.05, 0.0))
        ],
    ],
)
def test_the_arms_of_a_folded_strip_do_not_pass_through_each_other(form: str, speed: float, friction: float) -> None:
    """Their ends, five cells apart at the start, hit each other. Without contact they pass through."""
    run = wsph.run(folded_strip(speed, form, friction=friction))
    gap = least_gap(run)
    assert -0.3 < gap < 0.1
    made, end, momentum = made_in(run)
    assert made < 2e-3
    assert end > -1e-2
    assert momentum < 1e-13
    assert least_gap(wsph.run(folded_strip(speed, form, contact=False))) < -2.0


def least_gap(run: Any) -> float:
    """Between the inner corners of the ends, over all times [cells]."""
    low, high = (run.probes[name]["displacement_y"] for name in ("low", "high"))
    return float((0.25 + high - low).min()) / 0.05
