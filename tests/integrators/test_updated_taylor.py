"""Updated-Lagrangian Taylor-SPH: the Hugoniot plateau, the small-strain limit, density, spin, and where it is stopped."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Unstable
from wsph.simulation.compose import compose


@pytest.fixture(scope="module")
def scene() -> wsph.Scene:
    """examples/shock_bar_ul.toml."""
    return wsph.load(Path(__file__).resolve().parents[2] / "examples" / "shock_bar_ul.toml")


def plateau(scene: wsph.Scene, velocity: float) -> np.ndarray:
    """Compression on the reflected plateau over the linear 2 rho c v0."""
    pulse = {"t": [0.0, 2.5e-3], "value": [velocity, 0.0], "interp": "step"}
    probe = wsph.run(scene.with_(**{"functions.pulse": pulse})).probes["fixed-end"]
    on = (probe["time"] > 5.8e-3) & (probe["time"] < 6.8e-3)
    return -probe["stress_xx"][on] / (8e5 * velocity)


@pytest.mark.parametrize("courant", [0.8, 0.9])
def test_the_plateau_is_that_of_the_hugoniot(scene: wsph.Scene, courant: float) -> None:
    assert plateau(scene.with_(cfl=courant), 10.0).mean() == pytest.approx(1.026, rel=0.005)


def test_small_strain_is_the_linear_bar(scene: wsph.Scene) -> None:
    """At C = 1 the scheme is exact, so what is left is the material's own nonlinearity: v0/(2c), half of it per passage."""
    fixed = scene.with_(cfl=1.0, guard="off")
    for velocity in (1e-3, 1e-5):
        assert np.abs(plateau(fixed, velocity) - 1.0).max() == pytest.approx(velocity / 400.0, rel=0.05)


def test_a_step_that_deformation_makes_too_long_is_stopped_by_name_and_a_courant_number_followed(
    scene: wsph.Scene,
) -> None:
    dt = compose(scene.with_(cfl=1.0)).dt
    with pytest.raises(
        Unstable, match=r"own Courant number has become 1\.0\d+ by deformation; use a smaller run.dt, .*limit 1.000"
    ):
        wsph.run(scene.with_(dt=dt))
    result = wsph.run(scene.with_(cfl=1.0))
    assert result.status == "completed"
    steps = result.history["dt"]
    assert steps[0] == dt
    assert 0.9 * dt < steps[-1] < dt
    assert (np.diff(steps) <= 0.0).all()
    # Times are those of steps that differ in length, records at or after theirs.
    np.testing.assert_allclose(np.diff(result.history["time"]), np.diff(result.history["step"]) * steps[1:], rtol=0.1)
    assert result.time == pytest.approx(scene.run.end, abs=dt)
    assert result.time >= scene.run.end - 1e-9 * dt


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_density_follows_a_prescribed_stretch(dim: int) -> None:
    """Every particle moves as v = rate x: J = (1 + rate t)^dim."""
    axes = ["x", "y", "z"][:dim]
    material = scenes.material("jaumann", density=2.0, poisson_ratio=0.0)
    motion = {"body": "b", "where": "x >= 0", "velocity": {axis: f"0.1*{axis}" for axis in axes}}
    run = {"integrator": "ul-tsph", "end": 2.0, "cfl": 0.5}
    tables = {"boundary": [motion], "output": {"fields": ["density", "stress"]}}
    velocity = [f"0.1*{axis}" for axis in axes]
    result = wsph.run(scenes.block(dim, 4, run=run, tables=tables, velocity=velocity, material=material))
    stretch = 1.0 + 0.1 * result.time
    np.testing.assert_allclose(result.particles["density"], 2.0 / stretch**dim, rtol=2e-3)
    # Hypoelastic with nu = 0: stress = E ln(stretch) along every axis.
    np.testing.assert_allclose(result.particles["stress"][:, 0], np.log(stretch) / 1.0, rtol=5e-3)


def test_faces_turn_with_the_body() -> None:
    """A free block turned by any angle has no growing mode, and its faces stay free: the step sees its own frame."""
    scene = scenes.block(2, 4, model="jaumann", run={"integrator": "ul-tsph", "cfl": 0.8})
    largest, steps = [], 200
    for angle in (0.0, 0.3, np.pi / 4, 2.0):
        composition = compose(scene)
        system = composition.bodies[0].system
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        nodes, _ = system.lattice.centred
        system.state.write("displacement", nodes @ (turn - np.eye(2)).T)
        system.state.write("deformation", np.tile((turn - np.eye(2)).reshape(-1), (system.count, 1)))
        velocity = 1e-6 * np.random.default_rng(0).standard_normal((system.count, 2))
        system.state.write("velocity", velocity @ turn.T)
        composition.program.run(steps)
        largest.append(np.linalg.norm(system.state.read("velocity")))
    assert np.abs(np.array(largest) / largest[0] - 1.0).max() < 1e-4


def test_a_bar_spun_once_round_under_prestress_keeps_its_invariants() -> None:
    """Held at its ends, which turn: trace and von Mises stress of the inside stay at what they are after an eighth of the
    turn to 1e-4 of the prestress (1 % of E); the constant part beside them is the centrifugal stress."""
    omega, prestress = 0.01, 0.01
    turning = {
        "x": f"-{omega}*(sin({omega}*t)*x+cos({omega}*t)*y)",
        "y": f"{omega}*(cos({omega}*t)*x-sin({omega}*t)*y)",
    }
    body = scenes.body(scenes.box((-0.5, 0.5), (-0.1, 0.1)), 0.1, state="stress", velocity=[f"-{omega}*y", f"{omega}*x"],
                       material=scenes.material("jaumann"))  # fmt: skip
    run = {"integrator": "ul-tsph", "end": 2 * np.pi / omega, "cfl": 0.8, "guard": "off"}
    scene = scenes.scene(body, run=run, boundary=[scenes.driven(face, **turning) for face in ("-x", "+x")])
    composition = compose(scene)
    system = composition.bodies[0].system
    start = np.zeros((system.count, 3))
    start[:, 0] = prestress
    system.state.write("stress", start / composition.scales.stress)
    found = []
    for _ in range(8):
        composition.program.run(composition.steps // 8)
        xx, yy, xy = (system.state.read("stress")[~system.lattice.on_face] * composition.scales.stress / prestress).T
        found.append([np.mean(xx + yy), np.mean(np.sqrt(xx**2 - xx * yy + yy**2 + 3 * xy**2))])
    found = np.array(found)
    assert np.abs(found - 1.0).max() < 5e-4
    assert np.abs(found - found[0]).max() < 1e-4
    angle = np.arctan2(*system.current_position()[np.argmax(system.position @ [1.0, 1e-3])][::-1])
    assert abs(angle - np.arctan2(0.1, 0.5)) < 0.02


def test_a_free_spin_keeps_its_energy_for_a_while_and_is_stopped_by_name() -> None:
    """Collocation does not keep angular momentum. At 5 % of the wave speed a free block of 8 cells loses 1 % of its energy
    in the first half turn, then creates some, and is stopped after more than a turn with the reason."""
    omega = 0.05
    body = scenes.body(scenes.box((-0.5, 0.5), (-0.25, 0.25)), 0.125, velocity=[f"-{omega}*y", f"{omega}*x"],
                       material=scenes.material("jaumann", youngs_modulus=0.743))  # fmt: skip
    scene = scenes.scene(body, run={"integrator": "ul-tsph", "end": 4 * np.pi / omega, "cfl": 0.5})
    half = wsph.run(scene, end=np.pi / omega).history
    energy = half["kinetic"] + half["strain"]
    assert np.abs(energy / energy[0] - 1.0).max() < 0.015
    with (
        pytest.warns(RuntimeWarning, match="energy was created"),
        pytest.raises(Unstable, match="energy was created|Courant number has become") as caught,
    ):
        wsph.run(scene)
    assert caught.value.time * omega > 2 * np.pi


def test_a_particle_that_is_turned_inside_out_stops_the_run_whatever_the_guard(scene: wsph.Scene) -> None:
    """Ten times the wave speed: a whole cell is passed in a step."""
    wild = scene.with_(cfl=0.3, end="4 ms", guard="off", stop={"energy": 1e9}, **{"bodies.0.spacing": 0.05})
    pulse = {"t": [0.0, 1.0], "value": [2000.0, 0.0], "interp": "step"}
    result = wsph.run(wild.with_(**{"functions.pulse": pulse}), throw=False)
    assert result.status == "unstable"
    assert "inside out (J <= 0)" in result.reason or "is not finite" in result.reason


def test_the_density_of_a_moving_body_is_for_frames(scene: wsph.Scene) -> None:
    with pytest.raises(
        wsph.SceneError, match="the density cannot be probed in the updated-lagrangian form; frames carry it"
    ):
        wsph.run(scene.with_(probes=[{"name": "p", "at": [[0.2]], "fields": ["density"]}]))
