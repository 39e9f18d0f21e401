"""Phase-field fracture: closed forms of the damage, forces from the energy, what is kept while a body tears, refusals."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.scenes import FORMS
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

ELASTIC = scenes.material(poisson_ratio=0.25)
TOUGH = {"fracture_energy": 1e-3, "length": 0.1}


def block(*, dim: int = 2, end: float = 4.0, run: dict | None = None, **body: Any) -> wsph.Scene:
    """A free block of side 1."""
    keys = {"formulation": "total-lagrangian", "end": end, "cfl": 0.2, **(run or {})}
    tough = {"material": ELASTIC, "phase_field": {**TOUGH, "length": 0.1 if dim < 3 else 0.2}}
    tables = {"output": {"fields": ["damage", "stress", "velocity"]}}
    return scenes.block(dim, 20 if dim < 3 else 8, centred=True, run=keys, tables=tables, **{**tough, **body})


def stretched(composition: Composition, gradient: np.ndarray, sweeps: int) -> np.ndarray:
    """The damage of a body held at u = gradient X, after as many sweeps."""
    system = composition.bodies[0].system
    x = system.position / composition.scales.length
    system.state.write("displacement", x @ gradient.T)
    for _ in range(sweeps):
        system.refresh(system.state)
        system.attached["phase_field"].advance()
    return system.state.read("damage")[:, 0]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("model", "dim"), [
    ("AT1", 1), ("AT1", 2), ("AT1", 3), ("AT2", 2), *(pytest.param("AT2", dim, marks=pytest.mark.slow) for dim in (1, 3)),
])  # fmt: skip
def test_uniform_strain_has_the_damage_of_the_closed_form_up_to_the_faces(model: str, dim: int, form: str) -> None:
    """d = 1 - 1/q for AT1 where q > 1, q/(1 + q) for AT2, q = (16/3 or 2) psi l/G_c, psi of uniaxial strain."""
    length = 0.1 if dim < 3 else 0.2
    composition = compose(
        block(dim=dim, run={"formulation": form}, phase_field={**TOUGH, "model": model, "length": length})
    )
    strain = 0.08
    psi = 0.5 * 1.2 * strain**2  # lambda + 2 mu = 1.2 E at nu = 1/4
    gradient = np.zeros((dim, dim))
    gradient[0, 0] = strain
    q = {"AT1": 16.0 / 3.0, "AT2": 2.0}[model] * psi * length / 1e-3
    assert q > 1.0 or model == "AT2"
    exact = 1.0 - 1.0 / q if model == "AT1" else q / (1.0 + q)
    assert stretched(composition, gradient, 400) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("dim", [1, 2])
@pytest.mark.parametrize("model", ["elastic", "jaumann"])
def test_a_free_plane_has_no_stress_across_it(model: str, dim: int) -> None:
    """AT1 under one strain e: the n axes of zero stress contract by lambda g e/(n lambda g + 2 mu), and psi+ = lambda/2
    (e - n z)^2 + mu e^2 is what that leaves of what opens."""
    strain, lame, mu, free = 0.08, 0.4, 0.4, 3 - dim
    composition = compose(block(dim=dim, state="stress", material={**ELASTIC, "model": model}))
    system = composition.bodies[0].system
    if model == "jaumann":
        whole = lame * mu * 2.0 / (free * lame + 2.0 * mu)  # lambda after the free axes have given way
        system.state.buffer.assign(
            evolved(system, [(whole + 2.0 * mu) * strain, whole * strain, 0.0][: 1 if dim == 1 else 3])
        )
    d = 0.0
    for _ in range(300):
        g = (1.0 - d) ** 2
        z = lame * g * strain / (free * lame * g + 2.0 * mu)
        psi = 0.5 * lame * (strain - free * z) ** 2 + mu * strain**2
        d = max(d, 1.0 - 1.0 / (16.0 / 3.0 * psi * 0.1 / 1e-3))
    gradient = np.zeros((dim, dim))
    gradient[0, 0] = strain if model == "elastic" else 0.0
    assert d > 0.3
    assert stretched(composition, gradient, 400) == pytest.approx(d, rel=1e-5)
    acting = system.state.read("stress")[:, 0] * composition.scales.stress
    first_piola = g * (lame * (strain - free * z) + 2.0 * mu * strain)
    current = (1.0 - z) ** -free if model == "elastic" else 1.0
    assert acting == pytest.approx(first_piola * current, rel=1e-4)


@pytest.mark.parametrize("strain", [-0.08, 0.03])
def test_at1_leaves_compression_and_what_is_below_its_strength_whole(strain: float) -> None:
    q = 16.0 / 3.0 * 0.5 * 1.2 * strain**2 * 0.1 / 1e-3
    assert strain < 0.0 or q < 1.0
    assert stretched(compose(block()), np.diag([strain, 0.0]), 50).max() == 0.0


@pytest.mark.parametrize("form", FORMS)
def test_a_crack_has_the_profile_and_the_energy_of_the_model(form: str) -> None:
    """AT1: d = (1 - |x|/2l)^2 about a row that is broken, and G_c per length."""
    length, spacing = 0.1, 0.0125
    composition = compose(block(spacing=spacing, run={"formulation": form}, phase_field={**TOUGH, "length": length}))
    system = composition.bodies[0].system
    x = system.lattice.cells
    row = np.abs(x[:, 0] - 0.5 * spacing) < 1e-6
    broken = np.where(row, 1.0, 0.0)
    system.attached["phase_field"].response.damage.assign(broken)
    found = stretched(composition, np.zeros((2, 2)), 3000)
    exact = np.clip(1.0 - np.abs(x[:, 0] - 0.5 * spacing) / (2.0 * length), 0.0, None) ** 2
    assert np.abs(found - exact).max() < 0.025
    scale = composition.scales.stress * composition.scales.length**2
    energy = system.fracture()["surface_energy"] * scale
    assert energy == pytest.approx(1e-3, rel=0.03)


@pytest.mark.parametrize("model", ["elastic", "jaumann"])
def test_damaged_stress_is_what_is_read(model: str) -> None:
    composition = compose(block(material={**ELASTIC, "model": model}))
    system = composition.bodies[0].system
    system.attached["phase_field"].response.damage.assign(np.full(system.count, 0.5))
    if model == "jaumann":
        # lambda = mu = 0.4 E, in units of the wave modulus 1.2 E
        system.state.buffer.assign(evolved(system, [0.012, 0.004, 0.004, 0.0]))
    stretched(composition, np.diag([0.01, 0.0]), 1)
    stress = system.state.read("stress")
    assert stress[:, 0] == pytest.approx(0.25 * 0.01, rel=0.02)
    assert stress[:, 1] == pytest.approx(0.25 * 0.01 / 3.0, rel=0.02)


def evolved(system: Any, stress: list[float]) -> np.ndarray:
    """The buffer of a body's state with the same undamaged stress everywhere, given in units of E."""
    buffer, start, width = system.state.buffer.numpy(), system.state.start["stress"], len(stress)
    buffer[start : start + width * system.count] = np.tile(np.array(stress) / system.scales.stress, system.count)
    return buffer


@pytest.mark.parametrize("state", ["strain", "stress"])
@pytest.mark.parametrize("form", FORMS)
def test_forces_are_the_gradient_of_the_energy_at_fixed_damage(form: str, state: str) -> None:
    tough = {**TOUGH, "length": 0.3, "fracture_energy": 1e9}
    composition = compose(block(spacing=0.2, jitter=0.1, run={"formulation": form}, state=state, phase_field=tough))
    run = composition.bodies[0]
    system, random = run.system, np.random.default_rng(1)
    system.attached["phase_field"].response.damage.assign(random.uniform(0.0, 0.9, len(system.point_volume)))
    base = 0.3 * random.standard_normal((system.count, 2))

    def energy(u: np.ndarray) -> float:
        system.state.write("displacement", u)
        system.refresh(system.state)
        return run.diagnostics.measure(system.state).strain + system.held_energy()

    way = random.standard_normal(base.shape)
    slope = (energy(base + 1e-6 * way) - energy(base - 1e-6 * way)) / 2e-6
    system.state.write("displacement", base)
    out = system.new()
    system.rate(system.state, out, "velocity")
    force = out.read("velocity") * (system.density * system.volume)[:, None]
    assert -(force * way).sum() == pytest.approx(slope, rel=1e-7)


def test_what_is_whole_needs_no_eigenvectors_in_3d() -> None:
    """The same accelerations with a damage of nothing, which takes the way by principal strains."""
    composition = compose(block(dim=3, phase_field={**TOUGH, "length": 0.2, "fracture_energy": 1.0}))
    system, random = composition.bodies[0].system, np.random.default_rng(2)
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    x = system.position / composition.scales.length
    system.state.write("displacement", x @ turn.T - x + 1e-3 * random.standard_normal(x.shape))
    found = []
    for damage in (0.0, 1e-30):
        system.attached["phase_field"].response.damage.assign(np.full(system.count, damage))
        out = system.new()
        system.rate(system.state, out, "velocity")
        found.append((out.read("velocity"), system.state.read("stress")))
    for quick, principal in zip(*found, strict=True):
        assert np.abs(quick).max() > 1e-4
        assert np.abs(quick - principal).max() < 1e-10 * np.abs(principal).max()


TORN = [(2, "total-lagrangian", "strain"), (2, "total-lagrangian", "stress"), (2, "stress-points", "strain"),
        (3, "total-lagrangian", None), (3, "stress-points", None)]  # fmt: skip


@pytest.mark.parametrize(("model", "dim", "form", "state"), [
    pytest.param(model, *row, marks=pytest.mark.slow if (model, row[0]) == ("jaumann", 3) else ())
    for model in ("elastic", "jaumann") for row in TORN
])  # fmt: skip
def test_a_tearing_block_keeps_momentum_and_creates_no_energy(
    model: str, dim: int, form: str, state: str | None
) -> None:
    velocity = ["0.8*x - 0.3*y", "0.3*x - 0.1*y", "0.0"][:dim]
    chosen = {"state": state} if state is not None else {}
    run = {"cfl": 0.1, "formulation": form}
    scene = block(dim=dim, velocity=velocity, end=2.0, run=run, material={**ELASTIC, "model": model}, **chosen)
    composition = compose(scene)
    system = composition.bodies[0].system
    mass = system.density * system.volume

    def spin() -> np.ndarray:
        x = system.position / composition.scales.length + system.state.read("displacement")
        v = system.state.read("velocity")
        return mass @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])

    before = spin()
    composition.program.run(composition.steps)
    after = spin()
    assert abs(after / before - 1.0) < 1e-12
    assert (
        np.abs(mass @ system.state.read("velocity")).max()
        < 1e-12 * np.abs(mass @ np.abs(system.state.read("velocity"))).max()
    )
    result = wsph.run(scene)
    energy, fracture = result.summary["energy"], result.summary["fracture"]["b"]
    assert fracture["broken"] > 0
    assert abs(energy["residual"]) < {"elastic": 1e-3, "jaumann": 1e-2}[model] * energy["external_work"]
    assert energy["residual"] > -1e-3 * energy["external_work"]
    assert 0.0 <= result.field("damage").min() <= result.field("damage").max() <= 1.0


@pytest.mark.parametrize("form", FORMS)
def test_it_breaks_without_a_residual_too(form: str) -> None:
    scene = block(velocity=["0.8*x", "-0.1*y"], end=1.0, run={"cfl": 0.1, "formulation": form}, residual=False)
    result = wsph.run(scene)
    assert result.summary["fracture"]["b"]["broken"] > 0
    assert np.isfinite(result.summary["fracture"]["b"]["released_energy"])
    assert abs(result.summary["energy"]["residual"]) < 1e-2 * result.summary["energy"]["external_work"]


@pytest.mark.parametrize(("body", "text"), [
    ({"state": "stress", "material": {**ELASTIC, "poisson_ratio": -0.2}}, "Poisson ratio below zero"),
    ({"material": {**ELASTIC, "model": "neo-hookean"}}, "use elastic or jaumann"),
    ({"phase_field": {**TOUGH, "length": 0.04}}, "below the spacing"),
    ({"map": ["x*(1+0.1*y)", "y"]}, "without `map`"),
])  # fmt: skip
def test_what_it_cannot_do_is_refused(body: dict, text: str) -> None:
    with pytest.raises(wsph.Refused, match=text):
        compose(block(**body))


def test_a_form_without_it_refuses_it() -> None:
    with pytest.raises(
        wsph.Refused, match="phase_field is a part of the one-set form total-lagrangian and stress-points"
    ):
        compose(block(run={"formulation": "updated-lagrangian"}))
