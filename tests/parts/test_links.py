"""Virtual links: each criterion at its threshold, a torn spinning block, particles that come free."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

pytestmark = pytest.mark.filterwarnings("ignore:.*follow the lattice")
JAUMANN = scenes.material("jaumann", poisson_ratio=0.25)
STRETCH = {"criterion": "stretch", "threshold": 0.1}


def block(*, dim: int = 2, end: float = 3.0, run: dict | None = None, **body: Any) -> wsph.Scene:
    """A free block of side 1."""
    keys = {"formulation": "total-lagrangian", "end": end, "cfl": 0.15, **(run or {})}
    return scenes.block(
        dim, 20 if dim < 3 else 8, centred=True, run=keys, **{"material": JAUMANN, "links": STRETCH, **body}
    )


def held(composition: Composition, gradient: np.ndarray) -> Any:
    """The body at u = gradient X, after its criterion was asked once."""
    system = composition.bodies[0].system
    system.state.write("displacement", system.position / composition.scales.length @ gradient.T)
    system.refresh(system.state)
    system.attached["links"].advance()
    return system


def broken(system: Any) -> dict[str, float]:
    """Broken links and free particles."""
    return {name: count for name, count in system.fracture().items() if name not in ("released_energy", "crack_area")}


@pytest.mark.parametrize(("links", "at"), [
    ({"criterion": "stretch", "threshold": 0.1}, 0.1),
    ({"criterion": "energy", "fracture_energy": 1e-3}, 0.2),  # sqrt(2 G_c/(E spacing)) with spacing 0.05
    ({"criterion": "plastic-strain", "threshold": 0.17}, np.expm1(0.17)),
])  # fmt: skip
def test_a_link_breaks_at_its_threshold_along_what_stretches_it(links: dict, at: float) -> None:
    assert held(compose(block(links=links)), np.diag([0.999 * at, 0.0])).fracture()["broken_links"] == 0
    system = held(compose(block(links=links)), np.diag([1.001 * at, 0.0]))
    # Rows of 20 along x break whole, columns stay: every particle has one direction left, and is free.
    assert broken(system) == {"broken_links": 19 * 20, "free": 400}


def test_plastic_strain_leaves_out_what_stress_explains() -> None:
    links = {"criterion": "plastic-strain", "threshold": 0.01}
    composition = compose(block(links=links))
    system, unit = composition.bodies[0].system, 1.2
    buffer, start = system.state.buffer.numpy(), system.state.start["stress"]
    # The stress of uniaxial strain 0.05: lambda = mu = 0.4 E.
    buffer[start : start + 1600] = np.tile(np.array([1.2, 0.4, 0.4, 0.0]) * 0.05 / unit, 400)
    system.state.buffer.assign(buffer)
    assert held(composition, np.diag([np.expm1(0.0599), 0.0])).fracture()["broken_links"] == 0
    assert held(composition, np.diag([np.expm1(0.0601), 0.0])).fracture()["broken_links"] == 380


def test_principal_stress_breaks_the_links_it_pulls_on() -> None:
    composition = compose(block(links={"criterion": "principal-stress", "threshold": 0.02}))
    system = composition.bodies[0].system
    buffer, start = system.state.buffer.numpy(), system.state.start["stress"]
    buffer[start : start + 1600] = np.tile(np.array([0.01, 0.021, 0.0, 0.0]) / 1.2, 400)
    system.state.buffer.assign(buffer)
    system = held(composition, np.zeros((2, 2)))
    assert broken(system)["broken_links"] == 380
    left = system.breakable_weights.numpy()
    along = np.repeat(np.arange(400), np.diff(system.neighbours.offsets.numpy()))
    gone = left == 0.0
    apart = system.position[system.neighbours.indices.numpy()] - system.position[along]
    assert np.abs(apart[gone][:, 0]).max() < 1e-9


@pytest.mark.parametrize("dim", [2, 3])
def test_a_torn_spinning_block_keeps_momentum_and_creates_no_energy(dim: int) -> None:
    # At small strains: the energy of a rate law is that of its stress as far as they are.
    velocity = ["0.1*x - 0.1*y", "0.1*x", "0.0"][:dim]
    links = {"criterion": "stretch", "threshold": 0.02}
    scene = block(dim=dim, velocity=velocity, viscosity={"alpha": 0.5, "beta": 0.5}, links=links).with_(
        output={"fields": ["damage"]}
    )
    composition = compose(scene)
    system = composition.bodies[0].system
    mass = system.density * system.volume

    def spin() -> float:
        x = system.position / composition.scales.length + system.state.read("displacement")
        v = system.state.read("velocity")
        return mass @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])

    before = spin()
    composition.program.run(composition.steps)
    assert abs(spin() / before - 1.0) < 1e-12
    v = system.state.read("velocity")
    assert np.abs(mass @ v).max() < 1e-14 * (mass @ np.abs(v)).max() * np.sqrt(len(v))
    result = wsph.run(scene)
    energy, found = result.summary["energy"], result.summary["fracture"]["b"]
    assert found["broken_links"] > 50
    assert energy["residual"] > -1e-3 * energy["external_work"]
    assert energy["residual"] < 0.01 * energy["external_work"]
    damage = result.field("damage")
    assert damage.min() >= 0.0
    assert damage.max() > 0.5


def test_a_particle_without_links_is_harmless() -> None:
    """It flies on: no stress, no force, its deformation that of a body at rest."""
    composition = compose(block(velocity=["0.3", "0.1"]))
    system = held(composition, np.diag([0.2, 0.2]))
    assert broken(system) == {"broken_links": 760, "free": 400}
    composition.program.run(50)
    assert (
        system.state.read("velocity") == [0.3 / composition.scales.velocity, 0.1 / composition.scales.velocity]
    ).all()
    assert np.abs(system.state.read("stress")).max() == 0.0
    assert np.abs(system.state.read("deformation")).max() == 0.0


def test_links_that_are_nowhere_are_refused_with_where_the_particles_are() -> None:
    with pytest.raises(
        wsph.Refused, match=r"links.where: 'x > 9' selects no particle: they have x from -0\.\d+ to 0\.\d+ m"
    ):
        compose(block(links={**STRETCH, "where": "x > 9"}))


def test_links_break_only_where_the_scene_says() -> None:
    system = held(compose(block(links={**STRETCH, "where": "x < 0"})), np.diag([0.2, 0.0]))
    assert broken(system)["broken_links"] == 9 * 20


@pytest.mark.parametrize(("keys", "error", "text"), [
    ({"material": {**JAUMANN, "model": "elastic"}}, wsph.Refused, "use jaumann, mises or perzyna"),
    ({"phase_field": {"fracture_energy": 1.0, "length": 0.1}}, wsph.Refused, "leave one out"),
    ({"run": {"correction": "paper"}}, wsph.Refused, "symmetric correction"),
    ({"viscosity": {"alpha": 1.0, "correction": "paper"}}, wsph.Refused, "symmetric viscosity"),
    ({"links": {"criterion": "energy", "threshold": 0.1}}, wsph.SceneError, "needs fracture_energy and nothing else"),
    ({"links": {"criterion": "stretch"}}, wsph.SceneError, "needs threshold and nothing else"),
    ({"links": {"criterion": "stretch", "threshold": -0.1}}, wsph.SceneError, "not above zero"),
])  # fmt: skip
def test_what_it_cannot_do_is_refused(keys: dict, error: type, text: str) -> None:
    with pytest.raises(error, match=text):
        compose(block(**keys))


@pytest.mark.parametrize("strain", [1.0, -0.6])
def test_doubled_and_crushed_to_two_fifths_without_breaking(strain: float) -> None:
    """100 % tension, and compression to J = 0.4: the body survives, and what holds it together stays small."""
    speed = 0.05 * np.sign(strain)
    grip = [
        {"body": "b", "where": "x > 0.44", "velocity": {"x": speed}},
        {"body": "b", "where": "x < -0.44", "velocity": {"x": 0.0}},
    ]
    material = scenes.material("mises", yield_stress=0.01, hardening_modulus=0.05)
    data = block(end=abs(strain / speed), velocity=[f"{speed}*(x+0.5)", "0"], material=material, viscosity={"alpha": 0.5},
                 links={"criterion": "stretch", "threshold": 50.0}).data()  # fmt: skip
    result = wsph.run(wsph.Scene(**data | {"boundary": grip, "output": {"fields": ["displacement", "damage"]}}))
    assert result.status == "completed"
    assert result.field("damage").max() == 0.0
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 0.03 * energy["external_work"]
    assert energy["hourglass"] < 0.1 * (energy["strain"] + energy["dissipated"])
    assert (
        result.field("displacement_x").max() * np.sign(strain) == pytest.approx(abs(strain), rel=0.05) or strain < 0.0
    )


def test_it_says_that_its_cracks_follow_the_lattice() -> None:
    with pytest.warns(RuntimeWarning, match="follow the lattice"):
        compose(block())
