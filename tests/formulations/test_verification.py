"""Symmetries of the equations and symbols of the operators: what every method has to keep whatever its parameters."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

METHODS = [
    ("tsph", "small-strain"),
    ("ul-tsph", "updated-lagrangian"),
    ("leapfrog", "stress-points"),
    ("leapfrog", "total-lagrangian"),
    ("leapfrog", "updated-lagrangian"),
    ("rk4", "total-lagrangian"),
]


def block(method: tuple[str, str], velocity: list[str], size: tuple[float, float] = (1.0, 1.0), precision: str = "f64",
          **run: Any) -> wsph.Scene:  # fmt: skip
    """A free block about the origin, seven cells along every unit of length: as little aligned as a block can be."""
    shape = scenes.box(*((-0.5 * side, 0.5 * side) for side in size))
    body = scenes.body(shape, 1.0 / 7.0, velocity=velocity, material=scenes.material("jaumann"))
    keys = {"integrator": method[0], "formulation": method[1], "cfl": 0.4, "precision": precision, **run}
    return scenes.scene(body, run=keys)


def fields(result: wsph.Result) -> tuple[np.ndarray, np.ndarray]:
    """Velocities (n, 2) and in-plane stresses xx, yy, xy (n, 3)."""
    velocity = np.stack([result.field(f"velocity_{a}") for a in "xy"], 1)
    return velocity, np.stack([result.field(f"stress_{c}") for c in ("xx", "yy", "xy")], 1)


def matching(places: np.ndarray, images: np.ndarray) -> np.ndarray:
    """For every image the particle at its place."""
    apart = np.linalg.norm(images[:, None] - places[None], axis=2)
    assert apart.min(1).max() < 1e-9
    return apart.argmin(1)


def gap(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max() / np.abs(b).max())


@pytest.mark.parametrize(("precision", "gate"), [("f64", 1e-11), ("f32", 1e-3)])
@pytest.mark.parametrize("method", METHODS, ids="-".join)
class TestSymmetries:
    """Fields of one unit of time, in which waves cross the block."""

    def test_a_common_velocity_changes_nothing(self, method: tuple[str, str], precision: str, gate: float) -> None:
        swirl = ["0.01*sin(3*y)", "0.01*x"]
        still = fields(wsph.run(block(method, swirl, precision=precision)))
        moving = fields(wsph.run(block(method, [f"{v} + 0.1" for v in swirl], precision=precision)))
        assert gap(moving[0] - 0.1, still[0]) < gate
        assert gap(moving[1], still[1]) < gate

    def test_a_mirror_image_stays_one(self, method: tuple[str, str], precision: str, gate: float) -> None:
        result = wsph.run(block(method, ["0.01*sin(3*x)*(1 + y)", "0.01*cos(2*x)*y"], precision=precision))
        velocity, stress = fields(result)
        order = matching(result.particles["position"], result.particles["position"] * [-1.0, 1.0])
        bound = 1e-12 if precision == "f64" else 1e-5
        assert gap(velocity[order] * [-1.0, 1.0], velocity) < bound
        assert gap(stress[order] * [1.0, 1.0, -1.0], stress) < bound

    def test_the_order_of_particles_and_axes_does_not_matter(
        self, method: tuple[str, str], precision: str, gate: float
    ) -> None:
        """x and y exchanged: the same particles stand in another order."""
        one = wsph.run(block(method, ["0.01*sin(3*y)", "0.02*x*y"], (1.0, 2.0), precision))
        two = wsph.run(block(method, ["0.02*x*y", "0.01*sin(3*x)"], (2.0, 1.0), precision))
        order = matching(two.particles["position"], one.particles["position"][:, ::-1])
        assert not (np.diff(order) == 1).all()
        (v, s), (v2, s2) = fields(one), fields(two)
        bound = 1e-14 if precision == "f64" else 1e-6
        assert gap(v2[order][:, ::-1], v) < bound
        assert gap(s2[order][:, [1, 0, 2]], s) < bound


@pytest.mark.parametrize(("name", "order", "fewest"), [
    ("euler", 1, 40_000), ("rk2", 2, 4000), ("leapfrog", 2, 4000), ("rk4", 4, 800),
])  # fmt: skip
def test_a_prestress_turns_with_the_body_ten_times(name: str, order: int, fewest: int) -> None:
    """Jaumann's rate in a block that is turned as it is prescribed: sigma = R sigma_0 R^T at the integrator's order."""
    turn = 20.0 * np.pi
    where = {"body": "b", "where": "x > -9", "velocity": {"x": f"-{turn}*(x*sin({turn}*t) + y*cos({turn}*t))", "y": f"{turn}*(x*cos({turn}*t) - y*sin({turn}*t))"}}  # fmt: skip
    start = np.array([0.0, 1.0, 0.0, 0.0])
    errors = []
    for steps in (fewest, 2 * fewest):
        scene = block((name, "total-lagrangian"), [f"-{turn}*y", f"{turn}*x"], guard="off", cfl=None, dt=1.0 / steps)
        composition = compose(scene.with_(boundary=[where]))
        system = composition.bodies[0].system
        stress = system.state.read("stress")
        stress[:, 1] = start[1]
        system.state.write("stress", stress)
        composition.program.prepare(steps)
        composition.program.run(steps)
        composition.publish()
        found = system.state.read("stress")
        errors.append(float(np.abs(found - start).max() / start[1]))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)
    assert errors[1] < 0.3


def bar(integrator: str, formulation: str, wave: float, support: float | None = None, **body: Any) -> Composition:
    """A bar of 41 cells with a small displacement or velocity sin(wave x/spacing) along it."""
    made = scenes.body(scenes.box(41.0), 1.0, state="stress", velocity=[f"1e-7*sin({wave}*x)"], **body)
    run = {"integrator": integrator, "formulation": formulation, "cfl": 0.5, "guard": "off", "support": support}
    return compose(scenes.scene(made, run=run))


@pytest.mark.parametrize("wave", [0.3, 1.0, 2.0, 3.0])
class TestSymbols:
    """What an operator makes of a wave is a number that can be written down: waves travel as that says, no other."""

    @pytest.mark.parametrize(
        ("formulation", "support", "offsets"),
        [
            ("total-lagrangian", None, range(1, 3)),
            ("stress-points", 1.8, (0.5, 1.5)),
            ("stress-points", 1.5, (0.5,)),
            ("stress-points", None, (0.5,)),
        ],
    )
    @pytest.mark.parametrize("residual", [0.0, 0.6])
    def test_frequencies(
        self, formulation: str, support: float | None, offsets: Any, residual: float, wave: float
    ) -> None:
        """omega^2 = c^2 (s^2 + chi sum w |e|^2/sum w r^2), s = sum w r sin(k r)/sum w r^2, e what a linear field leaves."""
        held = {"coefficient": residual} if residual else False
        composition = bar("leapfrog", formulation, wave, support, residual=held, placement="cells")
        system = composition.bodies[0].system
        v = system.state.read("velocity")
        system.state.write("displacement", v)
        out = system.new()
        system.rate(system.state, out, "velocity")
        # In the scene's units: spacing, wave speed and density are one.
        scales = composition.scales
        accelerations = out.read("velocity")[:, 0] * scales.time**-2 * scales.length / scales.velocity * scales.time
        r = np.array([*(-x for x in offsets), *offsets], float)
        x = np.abs(r) / (1.3 if formulation == "total-lagrangian" else 0.9)
        if formulation == "total-lagrangian":
            w = -np.where(x < 1.0, -3.0 * x + 2.25 * x**2, -0.75 * (2.0 - x) ** 2) / x
        else:
            w = np.where(x < 1.0, 1.0 - 1.5 * x**2 + 0.75 * x**3, 0.25 * (2.0 - x) ** 3)
        at_point = 1.0 if formulation == "total-lagrangian" else (w * np.exp(1j * wave * r)).sum() / w.sum()
        s = (w * r * np.exp(1j * wave * r)).sum() / (w * r**2).sum()
        left = np.exp(1j * wave * r) - at_point - s * r
        square = abs(s) ** 2 + residual * (w * np.abs(left) ** 2).sum() / (w * r**2).sum()
        inside = slice(8, -8)
        expected = -square * v[inside, 0]
        assert np.abs(accelerations[inside] - expected).max() < 1e-5 * np.abs(expected).max()

    @pytest.mark.parametrize("residual", [0.0, 0.2])
    def test_frequencies_along_edges(self, residual: float, wave: float) -> None:
        """omega^2 = c^2 ((theta s)^2 + chi ((1 - cos k)^2 + (s - sin k)^2)), s = sin k, theta = 1 - (1 - cos k)/6: the
        average over the edges, which what holds the misfit does not take."""
        held = {"coefficient": residual} if residual else False
        composition = bar("leapfrog", "total-lagrangian", wave, residual=held)
        system = composition.bodies[0].system
        v = system.state.read("velocity")
        system.state.write("displacement", v)
        out = system.new()
        system.rate(system.state, out, "velocity")
        scales = composition.scales
        accelerations = out.read("velocity")[:, 0] * scales.time**-2 * scales.length / scales.velocity * scales.time
        away = 1.0 - np.cos(wave)
        square = ((1.0 - away / 6.0) * np.sin(wave)) ** 2 + residual * away**2
        inside = slice(4, -4)
        expected = -square * v[inside, 0]
        assert np.abs(accelerations[inside] - expected).max() < 1e-5 * np.abs(expected).max()

    def test_a_step_of_taylor_sph_is_that_of_lax_and_wendroff(self, wave: float) -> None:
        """Two sets half a cell apart: G = 1 - 2 C^2 sin^2(k/2) - i C sin(k) for the wave that goes one way."""
        composition = bar("tsph", "small-strain", wave)
        system, courant = composition.bodies[0].system, 0.5
        v = system.state.read("velocity")[:, 0]
        composition.program.prepare(1)
        composition.program.run(1)
        now, stress = system.state.read("velocity")[:, 0], system.state.read("stress")[:, 0]
        x = np.arange(len(v))
        amplitude = np.abs(v).max() / np.abs(np.sin(wave * x)).max()
        inside = slice(3, -3)
        expected = (1.0 - 2.0 * courant**2 * np.sin(0.5 * wave) ** 2) * v
        assert np.abs(now - expected)[inside].max() < 1e-9 * amplitude
        expected = courant * np.sin(wave) * amplitude * np.cos(wave * x)
        assert np.abs(stress - expected)[inside].max() < 1e-6 * amplitude


@pytest.mark.parametrize("method", METHODS, ids="-".join)
def test_single_precision_is_far_more_exact_than_the_cells(method: tuple[str, str]) -> None:
    """What single precision changes is below a tenth of what half the spacing changes."""
    scene = block(method, ["0.01*sin(3*y)", "0.01*x"])
    middle = [{"name": "m", "at": [[0.2, 0.1]], "fields": ["velocity", "stress_xy"]}]

    def found(**keys: Any) -> np.ndarray:
        probe = wsph.run(scene.with_(probes=middle, **keys)).probes["m"]
        return np.array([np.asarray(probe[name])[-1] for name in ("velocity_x", "velocity_y", "stress_xy")])

    double = found()
    cells = np.abs(found(**{"bodies.0.spacing": 1.0 / 14.0}) - double)
    assert (np.abs(found(precision="f32") - double) < 0.1 * cells.max()).all()
