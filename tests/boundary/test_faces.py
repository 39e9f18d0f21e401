"""What follows the faces of a body: pressure, and velocities along their own normals."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import SceneError
from wsph.simulation.compose import compose

FORMS = ("stress-points", "total-lagrangian")
SLOPE = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
INNER, OUTER, PRESSURE = 0.25, 0.5, 1e-6


@pytest.mark.parametrize("formulation", FORMS)
def test_a_block_slides_down_a_slope(formulation: str) -> None:
    """What holds it pushes along the normal alone: its momentum along the slope is m g t sin, that across it none."""
    block = scenes.body({**scenes.box(1.0, 0.5), "rotate": 30.0}, 0.125)
    held = {"body": "b", "face": "-y", "normal": 0.0}
    run = {"formulation": formulation, "end": 2.0, "cfl": 0.5}
    result = wsph.run(scenes.scene(block, run=run, boundary=[held], gravity={"y": -0.01}))
    history, energy = result.history, result.summary["energy"]
    along = np.stack([history["momentum_x"], history["momentum_y"]], 1) @ SLOPE
    np.testing.assert_allclose(along, -0.5 * 0.01 * 0.5 * history["time"], atol=1e-15)
    assert abs(energy["residual"]) < 1e-3 * energy["external_work"]


def sector(**keys: Any) -> wsph.Scene:
    """An eighth and some of a ring under inner pressure, cut along x and along an oblique line, on which it slides."""
    cut = [[0.0, 0.0], [-1.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 0.0]]
    beyond = [[0.0, 0.0], [1.0, 2.0], [-2.0, 2.0], [-2.0, -0.1]]
    shape = {
        "type": "difference",
        "shapes": [
            {"type": "ring", "center": [0.0, 0.0], "inner": INNER, "outer": OUTER},
            {"type": "polygon", "name": "below", "points": cut},
            {"type": "polygon", "name": "above", "points": beyond},
        ],
    }
    body = scenes.body(shape, 0.025, state="stress", damping={"rate": 4.0})
    run = {"formulation": "stress-points", "end": 12.0, "cfl": 0.8}
    return scenes.scene(body, run=run, output={"fields": ["displacement"]}, **keys)


def test_a_sector_of_a_ring_under_pressure_slides_on_its_cuts() -> None:
    """Lame's solution of the whole ring: the displacements to half a per cent."""
    patches = compose(sector()).bodies[0].system.geometry.faces.patches
    hole = next(name for name in patches if name.endswith("inner"))
    cuts = [name for name in patches if name.startswith(("below", "above"))]
    slides = [{"body": "b", "patch": name, "normal": 0.0} for name in cuts]
    result = wsph.run(sector(boundary=[{"body": "b", "patch": hole, "pressure": PRESSURE}, *slides]))
    x, u = result.particles["position"], result.particles["displacement"]
    r = np.linalg.norm(x, axis=1)
    assert np.ptp(np.einsum("na,na->n", x, u)[np.abs(r - INNER) < 1e-9]) < 1e-2 * INNER * np.abs(u).max()
    factor = INNER**2 / (OUTER**2 - INNER**2)
    radial = PRESSURE * factor * ((1.0 - 0.3) * r + (1.0 + 0.3) * OUTER**2 / r)
    found = np.einsum("na,na->n", x, u) / r
    assert np.abs(found - radial).max() < 5e-3 * radial.max()
    assert abs(result.summary["energy"]["residual"]) < 1e-2 * result.summary["energy"]["external_work"]


@pytest.mark.parametrize("formulation", FORMS)
@pytest.mark.parametrize("shape", [scenes.box(1.0, 0.6), {**scenes.box(1.0, 0.6), "rotate": 25.0}, scenes.cube(3)],
                         ids=["box", "turned box", "cube"])  # fmt: skip
def test_pressure_all_around_is_a_pressure_inside(shape: dict, formulation: str) -> None:
    """Its resultant is nothing, also of a body that turns, and a neo-Hookean body comes to rest with -p everywhere."""
    dim = 3 if "cube" in str(shape) or len(shape["min"]) == 3 else 2
    law = scenes.material("neo-hookean")
    body = scenes.body(shape, 0.2, material=law, damping={"rate": 3.0})
    faces = [f"{sign}{axis}" for axis in "xyz"[:dim] for sign in "+-"]
    loads = [{"body": "b", "face": face, "pressure": "0.05*min(t/4,1)"} for face in faces]
    run = {"formulation": formulation, "end": 16.0, "cfl": 0.5}
    result = wsph.run(scenes.scene(body, run=run, boundary=loads))
    stress = result.particles["stress"]
    normal = stress[:, :dim]
    assert np.abs(normal + 0.05).max() < 1e-6 * 0.05
    for axis in "xyz"[:dim]:
        assert np.abs(result.history[f"momentum_{axis}"]).max() < 1e-12


@pytest.mark.parametrize("formulation", FORMS)
def test_pressure_follows_a_body_that_turns(formulation: str) -> None:
    """On two opposite faces of a block that spins the forces stay along its length: no resultant, no torque."""
    block = scenes.body({**scenes.box((-0.5, 0.5), (-0.25, 0.25))}, 0.125, velocity=["-0.2*y", "0.2*x"])
    loads = [{"body": "b", "face": face, "pressure": "-1e-3*min(t/8,1)"} for face in ("-x", "+x")]
    run, output = {"formulation": formulation, "end": 12.0, "cfl": 0.3}, {"fields": ["velocity", "displacement"]}
    result = wsph.run(scenes.scene(block, run=run, boundary=loads, output=output))
    x, u, v = (result.particles[name] for name in ("position", "displacement", "velocity"))
    momentum = np.abs([result.history[f"momentum_{axis}"] for axis in "xy"])
    assert momentum.max() < 1e-13
    # Nodes on a face have half a cell, at a corner a quarter.
    mass = np.where(np.abs(x[:, 0]) > 0.49, 0.5, 1.0) * np.where(np.abs(x[:, 1]) > 0.24, 0.5, 1.0)
    place = x + u
    spin = mass @ (place[:, 0] * v[:, 1] - place[:, 1] * v[:, 0])
    assert spin == pytest.approx(0.2 * (mass @ (x**2).sum(1)), rel=1e-4)
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 1e-3 * energy["kinetic"]


def test_what_slides_and_what_presses_is_refused_by_name() -> None:
    block = scenes.body(scenes.box(1.0, 1.0), 0.25)
    for entry, key, text in (
        ({"face": "-y", "normal": 0.0, "fixed": ["x"]}, "boundary.0.normal", "goes with no other velocity"),
        ({"face": "-y", "normal": "1 Pa"}, "boundary.0.normal", "is no number"),
        ({"face": "-y", "pressure": "1 m"}, "boundary.0.pressure", "is no number"),
        ({"patch": "hole", "pressure": 1.0}, "boundary.0.patch", "has no patch 'hole'"),
        ({"where": "x > 0.3 and x < 0.6 and y > 0.3 and y < 0.6", "normal": 0.0}, "boundary.0.normal", "acts on no face"),
        ({"where": "x > 0.3 and x < 0.6 and y > 0.3 and y < 0.6", "pressure": 1.0}, "boundary.0.pressure", "acts on no"),
    ):  # fmt: skip
        with pytest.raises(SceneError) as caught:
            compose(scenes.scene(block, boundary=[{"body": "b", **entry}]))
        assert any(fault.key == key and text in fault.message for fault in caught.value.faults), caught.value
    for run in ({"formulation": "updated-lagrangian"}, {"formulation": "total-lagrangian", "support": 2.6}):
        with pytest.raises(SceneError, match=r"boundary.0.pressure: needs particles on the faces"):
            compose(scenes.scene(block, run=run, boundary=[{"body": "b", "face": "-y", "pressure": 1.0}]))
    for key in ("normal", "pressure"):
        with pytest.raises(SceneError, match=f"boundary.0.{key}: two-set bodies"):
            compose(scenes.scene(block, run={"integrator": "tsph"}, boundary=[{"body": "b", "face": "-y", key: 0.0}]))


@pytest.mark.parametrize("formulation", FORMS)
def test_a_bar_on_a_spring_has_the_frequency_of_its_closed_form(formulation: str) -> None:
    """u = cos(kappa (1 - x)), kappa tan kappa = k/E, omega = kappa c: after a period it is as at the start."""
    kappa = 0.8
    law = scenes.material(poisson_ratio=0.0)
    bar = scenes.body(scenes.box(1.0), 0.05, velocity=[f"1e-4*cos({kappa}*(1 - x))"], material=law)
    held = {"body": "b", "face": "-x", "spring": {"stiffness": kappa * np.tan(kappa)}}
    run = {"formulation": formulation, "end": 2.0 * np.pi / kappa, "cfl": 0.5}
    result = wsph.run(scenes.scene(bar, run=run, boundary=[held], output={"history": 1}))
    x, v = result.particles["position"][:, 0], result.particles["velocity"][:, 0]
    exact = 1e-4 * np.cos(kappa * (1.0 - x)) * np.cos(kappa * result.time)
    assert np.abs(v - exact).max() < 2e-3 * 1e-4
    assert np.abs(result.history["residual"]).max() < 1e-3 * result.history["kinetic"][0]
