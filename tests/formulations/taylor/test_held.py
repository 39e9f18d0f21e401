"""Held and driven particles inside two-set bodies, cracks that open and close, and density in small strain."""

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Unstable
from wsph.simulation.compose import compose

FORMS = ("tsph", "ul-tsph")


def block(integrator: str, dim: int, where: str, cells: int, *, jitter: float = 0.0, **run: object) -> wsph.Scene:
    """A body 2 long under gravity, held where `where` says."""
    axes = list("xyz"[:dim])
    material = scenes.material("elastic" if integrator == "tsph" else "jaumann")
    body = scenes.body(scenes.box(*[2.0, 1.0, 1.0][:dim]), 1.0 / cells, material=material, jitter=jitter)
    return scenes.scene(
        body,
        run={"integrator": integrator, **run},
        boundary=[{"body": "b", "where": where, "fixed": axes}],
        gravity={axes[min(1, dim - 1)]: -1e-3},
        output={"fields": ["velocity", "stress", "displacement", "density"]},
    )


@pytest.mark.parametrize("integrator", FORMS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_body_that_is_held_everywhere_stays_at_rest_under_gravity(integrator: str, dim: int) -> None:
    result = wsph.run(block(integrator, dim, "x > -1", 4 if dim < 3 else 2, end=10.0, cfl=0.5))
    for name in ("velocity", "stress", "displacement"):
        assert not result.particles[name].any(), name
    assert (result.particles["density"] == 1.0).all()
    for name in ("kinetic", "strain", "external_work", "residual"):
        assert (result.history[name] == 0.0).all(), name


@pytest.mark.parametrize("integrator", FORMS)
@pytest.mark.parametrize("where", ["x <= 0.5", "x >= 0.5 and x <= 1"])
def test_a_block_hangs_from_a_patch_that_is_held_inside(integrator: str, where: str) -> None:
    """Its ledger closes; what is held has a density that does not change."""
    result = wsph.run(block(integrator, 2, where, 24, end=4.0, cfl=0.9))
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 5e-3 * energy["external_work"]
    inside = ~result.particles["displacement"].any(1) & (result.particles["position"][:, 0] < 0.4)
    assert np.abs(result.particles["density"][inside] - 1.0).max(initial=0.0) < 1e-3


@pytest.mark.parametrize("integrator", FORMS)
def test_cells_between_driven_particles_move_as_those(integrator: str) -> None:
    """All corners are driven by one velocity that changes in time: the body moves as it is told, free of stress."""
    drive = {"body": "b", "where": "x > -1", "velocity": {"x": "0.1*t*t", "y": "-0.05*t"}}
    run = {"integrator": integrator, "end": 1.0, "cfl": 0.5}
    scene = scenes.block(2, 4, run=run, tables={"boundary": [drive]})
    composition = compose(scene)
    composition.program.run(composition.steps)
    system, half = composition.bodies[0].system, composition.bodies[0].integrator.half
    assert np.abs(system.state.read("stress")).max() < 1e-15
    velocity, t, dt = (
        half.read("velocity") * composition.scales.velocity,
        composition.steps * composition.dt,
        composition.dt,
    )
    # The mean of both ends of the last step.
    assert velocity[:, 0] == pytest.approx(0.05 * ((t - dt) ** 2 + t**2), rel=1e-9)
    assert velocity[:, 1] == pytest.approx(-0.05 * (t - 0.5 * dt), rel=1e-9)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_density_in_small_strain_follows_a_prescribed_stretch(dim: int, jitter: float) -> None:
    """rho_0/(1 + tr eps)."""
    rates = [0.1, -0.03, 0.05][:dim]
    velocity = [f"({rate})*{axis}" for rate, axis in zip(rates, "xyz", strict=False)]
    motion = {"body": "b", "where": "x > -1", "velocity": dict(zip("xyz", velocity, strict=False))}
    tables = {"boundary": [motion], "output": {"fields": ["density"]}}
    run = {"integrator": "tsph", "end": 1.0, "cfl": 0.5, "guard": "off"}
    result = wsph.run(scenes.block(dim, 4, run=run, tables=tables, velocity=velocity, jitter=jitter))
    np.testing.assert_allclose(result.particles["density"], 1.0 / (1.0 + sum(rates) * result.time), rtol=1e-12)


def test_a_plane_wave_changes_the_density_in_small_strain(shock_bar: wsph.Scene) -> None:
    """Behind a front of the velocity v the strain is -v/c."""
    scene = shock_bar.with_(end="1 ms", probes=[], output={"fields": ["density", "velocity", "position"]})
    particles = wsph.run(scene).particles
    behind = particles["density"][2] / 2000.0 - 1.0
    assert behind == pytest.approx(particles["velocity"][2, 0] / 200.0 / (1.0 - particles["velocity"][2, 0] / 200.0))


@pytest.mark.parametrize("integrator", FORMS)
def test_a_crack_that_closes_stops_the_run_by_name_and_one_that_opens_does_not(integrator: str) -> None:
    cracked = scenes.body(scenes.cube(2), 0.125, cracks=[{"from": [0.25, 0.5], "to": [0.75, 0.5]}],
                          material=scenes.material("jaumann"))  # fmt: skip

    def pulled(speed: float) -> wsph.Scene:
        faces = [scenes.driven("-y", y=-speed), scenes.driven("+y", y=speed)]
        return scenes.scene(cracked, run={"integrator": integrator, "end": 1.0, "cfl": 0.5}, boundary=faces,
                            stop={"energy": 1.0})  # fmt: skip

    with pytest.raises(Unstable, match=r"a crack closes at \(0\..*overlap by .* m: .*\[\[contact\]\]"):
        wsph.run(pulled(-1e-3))
    assert wsph.run(pulled(1e-3)).status == "completed"
