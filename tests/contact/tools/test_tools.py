"""Rigid tools against bodies, in scenes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import Data, body, box, driven, held, material, scene
from wsph.simulation.compose import compose

FLOOR: Data = {"name": "floor", "shape": {"type": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]}, "against": ["b"]}
"""All below y = 0."""


def probe(of: str, *fields: str) -> Data:
    return {"name": f"{of}-told", "of": of, "fields": list(fields)}


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
def test_a_block_at_rest_weighs_what_it_weighs_and_the_ledger_stands_still(form: str, integrator: str):
    """The floor feels rho g L^2, about the point of its plane at the block's corner half of a width from its middle; once at
    rest nothing is gained or lost."""
    run = {"formulation": form, "integrator": integrator, "cfl": 0.2, "end": 16.0}
    block = body(box(1.0, 0.5), 0.125, material=material(poisson_ratio=0.0), damping={"rate": 3.0})
    floor = FLOOR | {"stiffness": 4.0}
    result = wsph.run(
        scene(block, tools=[floor], gravity={"y": -1e-3}, run=run, probes=[probe("floor", "force", "torque", "work")])
    )
    told, history = result.probes["floor-told"], result.history
    assert told["force_y"][-1] == pytest.approx(0.5e-3, rel=1e-4)
    assert abs(told["force_x"][-1]) < 1e-12
    assert told["torque"][-1] == pytest.approx(0.25e-3, rel=1e-4)
    assert told["work"][-1] == 0.0
    assert history["tool_floor_y"][-1] == told["force_y"][-1]
    assert history["tool_floor_torque"][-1] == told["torque"][-1]
    assert abs(history["residual"][-1] - history["residual"][-4]) < 1e-9 * history["external_work"][-1]
    # p^2/(2 eps) L, eps = 2 K M/h, M = 1.
    assert history["contact_stored"][-1] == pytest.approx(0.5e-3**2 * 0.125 / 16.0, rel=1e-3)
    assert abs(history["contact_numerical"][-1]) < 1e-9 * history["external_work"][-1]


@pytest.mark.parametrize("angle", [0.0, 25.0])
def test_a_block_slides_down_a_slope_with_coulomb_friction(angle: float):
    """a = g (sin - mu cos) on a plane of any direction: the slope is turned in place of gravity, or gravity in place of the
    slope; below the limit it sticks."""
    t = np.radians(25.0 - angle)
    turned = {"shape": body(box(1.0, 0.25), 0.125)["shape"]}
    turned["shape"] |= {"rotate": -angle}
    along = np.radians(angle)
    normal = [np.sin(along), np.cos(along)]
    middle = np.array([0.5, 0.125])
    point = middle - 0.125 * np.array(normal)
    plane = FLOOR | {"shape": {"type": "plane", "point": point.tolist(), "normal": normal}}
    g = 1e-3
    down = -g * np.array([np.sin(t) * -1.0, np.cos(t)]) if angle == 0.0 else -g * np.array([0.0, 1.0])
    gravity = {"x": float(down[0]), "y": float(down[1])}
    tilt = np.radians(25.0)

    def speed(mu: float) -> float:
        block = body(turned["shape"], 0.125, material=material(youngs_modulus=10.0), surface="stairs")
        run = {"end": 4.0, "cfl": 0.3}
        result = wsph.run(scene(block, tools=[plane | {"friction": mu}], gravity=gravity, run=run))
        v = np.array([result.history[f"momentum_{axis}"][-1] for axis in "xy"]) / 0.25
        return float(np.hypot(*v)) / (g * result.time)

    assert speed(0.0) == pytest.approx(np.sin(tilt), rel=2e-3)
    assert speed(0.2) == pytest.approx(np.sin(tilt) - 0.2 * np.cos(tilt), rel=1e-2)
    assert speed(0.6) < 0.02


def test_a_driven_plane_presses_as_a_driven_face_does():
    """A bar between a wall and a plane that moves into it: E/L times the way less what the penalty gives, h/(2 K L)."""
    speed, end, n, K = 1e-3, 20.0, 16, 4.0
    bar = body(box(1.0), 1.0 / n, material=material(poisson_ratio=0.0), state="stress", damping={"rate": 1.0})
    at = [{"name": "middle", "at": [[0.5]], "fields": ["stress"]}]
    ramp = {"ramp": {"t": [0.0, 2.0, 10.0, 12.0], "value": [0.0, speed, speed, 0.0]}}
    run = {"end": end, "cfl": 0.3}
    push = {"name": "ram", "shape": {"type": "plane", "point": [1.0], "normal": [-1.0]}, "velocity": {"x": "-1e-3*(t<8)"},
            "against": ["b"], "stiffness": K}  # fmt: skip
    by_plane = wsph.run(
        scene(bar, boundary=[held("-x", 1)], tools=[push], run=run, probes=[*at, probe("ram", "force", "work")])
    )
    by_face = wsph.run(
        scene(bar, boundary=[held("-x", 1), driven("+x", x="-1e-3*(t<8)")], run=run, probes=at, functions=ramp)
    )
    told = by_plane.probes["ram-told"]
    stress = by_face.probes["middle"]["stress_xx"][-1]
    given = 1.0 + 1.0 / (2.0 * K * n)
    assert stress == pytest.approx(-8e-3, rel=2e-2)  # of a strain of .8 %, by St Venant and Kirchhoff
    assert by_plane.probes["middle"]["stress_xx"][-1] == pytest.approx(stress / given, rel=1e-3)
    assert told["force_x"][-1] == pytest.approx(stress / given, rel=1e-3)
    # The works of both, and nothing from nowhere: a damped push, half of it at the least is stored.
    work = by_plane.history["external_work"][-1]
    assert told["work"][-1] == pytest.approx(work, rel=1e-12)
    assert work == pytest.approx(by_face.history["external_work"][-1], rel=2e-2)
    assert abs(by_plane.history["residual"][-1]) < 1e-3 * work


def rod_on_block(ratio: float, integrator: str = "leapfrog", form: str = "stress-points") -> tuple[float, Any]:
    """A rod of unit length and speed v hits a free rigid block of `ratio` times its mass; the block's speed over v."""
    n, v, w = 50, 0.005, 0.12
    rod = body(box(1.0, w), 1.0 / n, material=material(poisson_ratio=0.0), velocity=[str(v), "0"])
    block = {"name": "block", "shape": {"type": "box", "from": [1.0, -0.3], "to": [2.0, w + 0.3]}, "mass": ratio * w,
             "velocity": [0.0, 0.0], "against": ["b"], "stiffness": 1.0}  # fmt: skip
    run = {"end": 3.0, "cfl": 0.3, "formulation": form, "integrator": integrator}
    result = wsph.run(scene(rod, tools=[block], run=run, probes=[probe("block", "force", "torque", "work")]))
    momentum = result.history["momentum_x"]
    return (momentum[0] - momentum[-1]) / (ratio * w * v), result


@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_an_elastic_rod_gives_a_rigid_block_the_share_of_one_dimensional_theory(ratio: float):
    """1 - exp(-2 m/M) of its speed, after which the rod lets go (St Venant); the rest is half a cell of the penalty."""
    speed, result = rod_on_block(ratio)
    assert speed == pytest.approx(1.0 - np.exp(-2.0 / ratio), rel=0.012)
    start, history = result.history["kinetic"][0], result.history
    gone = 0.5 * ratio * 0.12 * (0.005 * speed) ** 2
    assert -result.probes["block-told"]["work"][-1] == pytest.approx(gone, rel=1e-3)
    assert abs(history["residual"]).max() < 2e-3 * start
    assert abs(history["contact_numerical"][-1]) < 1e-3 * start
    # The columns of the ledger hold the block's energy too.
    assert history["kinetic"][-1] > gone


def test_a_rod_meets_a_rigid_block_alike_under_runge_kutta():
    speed, _ = rod_on_block(1.0, "rk4")
    assert speed == pytest.approx(rod_on_block(1.0)[0], rel=5e-3)


def brick(path: Path) -> None:
    """A flat box from -1 to 2 in x and y, and -1 to 0 in z, of triangles that cut the block's places askew."""
    low, high = (-1.0, -1.1, -1.0), (2.0, 2.3, 0.0)
    corners = [
        [(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)
    ]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["solid brick"]
    for a, b, c, d in quads:
        for face in ((a, b, c), (a, c, d)):
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {' '.join(map(str, corners[v]))}" for v in face]
            lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid"]))


def test_a_plane_of_triangles_is_the_plane(tmp_path: Path):
    """The forces of both to 1e-12 of the largest, and both as a moving tool: the mesh is asked in the tool's own frame."""
    brick(tmp_path / "brick.stl")
    cube = body(box(1.0, 1.0, 1.0), 0.25, velocity=["0", "0", "-0.01"])
    found = []
    for shape in (
        {"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]},
        {"type": "stl", "file": str(tmp_path / "brick.stl")},
    ):
        tool = {"name": "t", "shape": shape, "velocity": {"z": 0.01, "x": 0.003}, "against": ["b"], "friction": 0.2}
        run = {"end": 1.5, "cfl": 0.2}
        found.append(
            wsph.run(scene(cube, tools=[tool], run=run, probes=[probe("t", "force", "work")])).probes["t-told"]
        )
    plane, triangles = found
    largest = np.abs(plane["force_z"]).max()
    assert largest > 1e-3
    for name in ("force_x", "force_y", "force_z"):
        np.testing.assert_allclose(triangles[name], plane[name], atol=1e-12 * largest)
    np.testing.assert_allclose(triangles["work"], plane["work"], atol=1e-12 * np.abs(plane["work"]).max())


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
def test_a_turning_drum_does_the_work_that_friction_takes(integrator: str):
    """A disc that turns under a block, held aside: friction mu N r on it, and its work mu N r times the angle."""
    block = body(
        box(1.0, 0.5), 0.125, material=material(youngs_modulus=100.0, poisson_ratio=0.0), damping={"rate": 4.0}
    )
    drum = {"name": "drum", "shape": {"type": "disc", "center": [0.5, -2.0], "radius": 2.0}, "against": ["b"], "friction": 0.3,
            "turn": {"about": [0.5, -2.0], "rate": "-0.01*min(t, 1)"}}  # fmt: skip
    run = {"end": 8.0, "cfl": 0.3, "integrator": integrator}
    sides = [{"body": "b", "face": "+y", "fixed": ["x"]}]
    result = wsph.run(
        scene(
            block,
            tools=[drum],
            boundary=sides,
            gravity={"y": -1e-2},
            run=run,
            probes=[probe("drum", "force", "torque", "work")],
        )
    )
    told, history = result.probes["drum-told"], result.history
    # What it does to the block: up, and along +x, the way its top moves; about its middle that is clockwise.
    assert told["force_y"][-1] == pytest.approx(0.5e-2, rel=1e-2)
    assert told["force_x"][-1] == pytest.approx(0.3 * told["force_y"][-1], rel=2e-2)
    assert told["torque"][-1] == pytest.approx(-2.0 * 0.3 * told["force_y"][-1], rel=1e-2)
    late = told["time"] > 6.0
    power = np.polyfit(told["time"][late], told["work"][late], 1)[0]
    assert power == pytest.approx(-0.01 * told["torque"][-1], rel=5e-3)
    # The block still moves a little, against its own damping.
    taken = np.interp([6.0, 8.0], history["time"], history["contact_dissipated"] + history["dissipated"])
    assert taken[1] - taken[0] == pytest.approx(2.0 * power, rel=5e-3)
    assert abs(np.interp(6.0, history["time"], history["residual"]) - history["residual"][-1]) < 1e-6 * power


def test_a_body_stays_inside_of_a_hole():
    """A disc in a round hole a little larger, thrown at its wall: it comes back, and its energy stays."""
    disc = body({"type": "disc", "center": [0.0, 0.0], "radius": 0.5}, 0.1, velocity=["0.02", "0.01"])
    hole = {
        "name": "hole",
        "shape": {"type": "disc", "center": [0.0, 0.0], "radius": 0.55},
        "inside": True,
        "against": ["b"],
    }
    result = wsph.run(
        scene(
            disc,
            tools=[hole],
            run={"end": 10.0, "cfl": 0.3},
            probes=[{"name": "m", "at": [[0.0, 0.0]], "fields": ["displacement"]}],
        )
    )
    way = np.hypot(result.probes["m"]["displacement_x"], result.probes["m"]["displacement_y"])
    assert 0.05 < way.max() < 0.08
    assert way[-1] < way.max()
    assert abs(result.history["residual"][-1]) < 5e-3 * result.history["kinetic"][0]
    assert abs(result.history["contact_numerical"][-1]) < 1.5e-2 * result.history["kinetic"][0]


def test_resuming_gives_the_bits_of_never_having_stopped(tmp_path: Path):
    """With a free tool, a driven one that turns, and friction, past several searches."""
    block = body(box(1.0, 0.5), 0.125, velocity=["0.01", "-0.02"])
    tools = [
        FLOOR | {"velocity": {"y": "0.005*sin(t)"}, "turn": {"about": [0.5, 0.0], "rate": 0.002}, "friction": 0.3},
        {"name": "ball", "shape": {"type": "disc", "center": [0.5, 0.8], "radius": 0.29}, "mass": 0.2, "velocity": [0.0, -0.05],
         "spin": 0.3, "against": ["b"], "friction": 0.2},
    ]  # fmt: skip
    made = scene(block, tools=tools, gravity={"y": -1e-3}, run={"end": 6.0, "cfl": 0.2}, checkpoint={"every": 37},
                 probes=[probe("ball", "force", "torque", "work")])  # fmt: skip
    whole = wsph.run(made)
    wsph.run(made.with_(end=3.0), tmp_path / "out")
    resumed = wsph.run(made, tmp_path / "out", resume=True)
    for name, values in whole.history.items():
        np.testing.assert_array_equal(resumed.history[name][-1], values[-1], err_msg=name)
    for name, values in whole.probes["ball-told"].items():
        np.testing.assert_array_equal(resumed.probes["ball-told"][name], values, err_msg=name)
    np.testing.assert_array_equal(resumed.particles["velocity"], whole.particles["velocity"])


def test_columns_have_their_units(tmp_path: Path):
    cube = body(box(1.0, 1.0, 1.0), 0.5)
    plane = {"name": "t", "shape": {"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}, "against": ["b"]}
    result = wsph.run(
        scene(cube, tools=[plane], run={"end": 0.2, "cfl": 0.3}, probes=[probe("t", "force", "torque", "work")])
    )
    assert [name for name in result.history if name.startswith("tool_")] == [
        *(f"tool_t_{axis}" for axis in "xyz"), *(f"tool_t_torque_{axis}" for axis in "xyz"), "tool_t_work"
    ]  # fmt: skip
    units = result.summary["units"]
    probed = next(iter(units["probes"].values()))
    assert (probed["force_x"], probed["torque_z"], probed["work"]) == ("N", "N m", "J")
    assert units["history"]["tool_t_x"] == "N"


def tatara(depth: float, nu: float) -> float:
    """Force over E R^2 on an elastic ball pressed between two planes by `depth` R each (Tatara 1991, from Hertz)."""

    def pressed(a: float) -> tuple[float, float]:
        force = 4.0 * a**3 / (3.0 * (1.0 - nu**2))
        far = 2.0 * (1.0 + nu) / (a**2 + 4.0) ** 1.5 + (1.0 - nu**2) / (a**2 + 4.0) ** 0.5
        return a**2 - force * far / np.pi, force

    low, high = 0.0, 0.9
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if pressed(middle)[0] < depth else (low, middle)
    return pressed(low)[1]


def test_a_light_ball_on_a_wide_plate_takes_the_step_that_it_can_touch():
    """The bound of the time step counts what the ball can touch at once, not the whole plate; the ball bounces."""
    plate = body(box(8.0, 0.5), 0.125)
    ball = {"name": "ball", "shape": {"type": "disc", "center": [4.0, 0.8], "radius": 0.2}, "mass": 0.02, "velocity": [0.0, -0.05],
            "against": ["b"], "friction": 0.3}  # fmt: skip
    made = scene(
        plate,
        tools=[ball],
        boundary=[held("-y", 2)],
        run={"end": 6.0, "cfl": 0.2},
        probes=[probe("ball", "force", "work")],
    )
    result = wsph.run(made)
    lost = result.probes["ball-told"]["work"][-1] / (0.5 * 0.02 * 0.05**2)
    assert 0.0 < lost < 0.9  # it weighs as much as a particle of the plate
    assert result.probes["ball-told"]["force_y"][-1] == 0.0
    assert result.probes["ball-told"]["force_y"].min() < -1e-3
    assert abs(result.history["residual"]).max() < 1e-2 * result.history["kinetic"][0]


@pytest.mark.slow
def test_a_ball_between_two_planes_follows_tatara():
    """Contact radii of 1.5 to 2.6 spacings. A law that softens where it is compressed, as St Venant and Kirchhoff's, lies
    12 % lower; so a neo-Hookean ball."""
    speed, depths = 0.003, (0.02, 0.04, 0.06)
    ball = body({"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}, 0.1, surface="stairs",
                material=material("neo-hookean"), damping={"rate": 1.5})  # fmt: skip
    planes = [
        {"name": name, "shape": {"type": "plane", "point": [0, 0, -sign], "normal": [0, 0, sign]}, "velocity": {"z": sign * speed},
         "against": ["b"], "stiffness": 4.0}
        for name, sign in (("low", 1.0), ("high", -1.0))
    ]  # fmt: skip
    run = {"end": depths[-1] / speed, "cfl": 0.15, "formulation": "stress-points"}
    probes = [probe(name, "force") for name in ("low", "high")]
    result = wsph.run(scene(ball, tools=planes, run=run, probes=probes))
    low, high = (result.probes[f"{name}-told"] for name in ("low", "high"))
    for depth in depths:
        force = np.interp(depth / speed, low["time"], low["force_z"])
        assert force == pytest.approx(tatara(depth, 0.3), rel=0.03)
    np.testing.assert_allclose(high["force_z"], -low["force_z"], atol=1e-10)


@pytest.mark.parametrize(("dim", "precision"), [(1, "f32"), (2, "f32"), (3, "f32"), (1, "f64")])
def test_a_block_bounces_in_every_dimension_and_precision(dim: int, precision: str):
    """A fixed plane gives twice the momentum; single precision as double."""
    point, normal = [1.0] + [0.0] * (dim - 1), [-1.0] + [0.0] * (dim - 1)
    state = {"state": "stress"} if dim == 1 else {}
    block = body(box(*[1.0] * dim), (0.05, 0.1, 0.2)[dim - 1], velocity=["0.01", "0", "0"][:dim],
                 material=material(poisson_ratio=0.0), **state)  # fmt: skip
    wall = {"name": "wall", "shape": {"type": "plane", "point": point, "normal": normal}, "against": ["b"]}
    made = scene(
        block,
        tools=[wall],
        run={"end": 3.0, "cfl": 0.2, "precision": precision},
        probes=[probe("wall", "force", "work")],
    )
    result = wsph.run(made)
    momentum = result.history["momentum_x"]
    assert momentum[-1] == pytest.approx(-0.01, rel=0.1)
    told = result.probes["wall-told"]
    push = float((np.diff(told["time"]) * 0.5 * (told["force_x"][1:] + told["force_x"][:-1])).sum())
    assert push == pytest.approx(momentum[-1] - momentum[0], rel=1e-2)
    assert np.abs(told["work"]).max() == 0.0


def test_a_surface_that_is_remade_keeps_what_its_vertices_remember():
    """A cell dies at the corner: what the tool knows of the other vertices goes on with them."""
    plate = body(box(1.0, 0.5), 0.125, phase_field={"fracture_energy": 1.0, "length": 0.25})
    composition = compose(scene(plate, tools=[FLOOR], run={"cfl": 0.1}))
    joint = composition.joint
    assert joint is not None
    coupling: Any = joint.couplings[0]
    law, surface = coupling.laws[0], coupling.surfaces["b"]
    marks = np.arange(surface.n, dtype=float)
    law.memory["account"].assign(marks)
    live = np.ones(len(plate_cells(composition)), bool)
    live[0] = False
    rows = surface.remesh(live)
    law.renew(surface, rows)
    kept = law.memory["account"].numpy()
    assert len(kept) == surface.n
    assert (rows >= 0).sum() > 0.8 * len(marks)
    np.testing.assert_array_equal(kept[rows[rows >= 0]], marks[rows >= 0])
    coupling.restored()
    coupling.push(joint.state.parts, joint.new().parts)


def plate_cells(composition: Any) -> np.ndarray:
    return composition.bodies[0].system.geometry.cells
