"""Phase-field fracture where cells differ: closed forms of the damage, toughness, cracks from notches, refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lagrangian.bodies import composed
from tests.parts.test_phase_field import ELASTIC, TOUGH, stretched
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.validation import meshes

FORM = "stress-points"
WAVY = ["x + 0.01*sin(10*x)*cos(4*y)", "y + 0.015*sin(4*y)*cos(5*x)"]


@pytest.mark.parametrize("name", ["jittered notch", "jittered cube", "fitted disc", "quads and triangles"])
def test_uniform_strain_has_the_damage_of_the_closed_form_up_to_the_faces(name: str) -> None:
    """AT1: d = 1 - 1/q, q = 16/3 psi l/G_c, psi of uniaxial strain: no cell, and no face, makes a difference."""
    length, strain = 0.35, 0.08
    body = {"material": ELASTIC, "phase_field": {"fracture_energy": 3.5e-3, "length": length}}
    composition = composed(name, FORM, **body)
    dim = composition.bodies[0].system.space.dim
    q = 16.0 / 3.0 * 0.5 * 1.2 * strain**2 * length / 3.5e-3
    gradient = np.zeros((dim, dim))
    gradient[0, 0] = strain
    assert q > 1.5
    assert stretched(composition, gradient, 1200) == pytest.approx(1.0 - 1.0 / q, rel=1e-6)


SQUARE = scenes.cube(2, centred=True)
ACROSS: dict[str, tuple[dict[str, Any], float]] = {
    "jitter": ({"jitter": 0.25}, 0.03),
    "map": ({"map": WAVY}, 0.04),
    "fitted": ({"shape": {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}}, 0.03),
}


@pytest.mark.parametrize("name", list(ACROSS))
def test_a_crack_across_cells_that_differ_has_its_toughness(name: str) -> None:
    """The points of the cells at a line are broken: the profile of AT1 about them, and G_c per length."""
    keys, most = ACROSS[name]
    own = {key: value for key, value in keys.items() if key != "shape"}
    made = scenes.body(keys.get("shape", SQUARE), 0.02, material=ELASTIC, phase_field={**TOUGH, "length": 0.1}, **own)
    composition = compose(scenes.scene(made, run={"formulation": FORM}))
    system = composition.bodies[0].system
    rows, x = system.geometry.rows, system.geometry.nodes[:, 0] - 0.01
    low, high = (each.reduceat(x[rows.indices], rows.offsets[:-1]) for each in (np.minimum, np.maximum))
    system.attached["phase_field"].response.damage.assign(((low < 0.0) & (high > 0.0)).astype(float))
    found = stretched(composition, np.zeros((2, 2)), 1500)
    exact = np.clip(1.0 - np.abs(system.geometry.cells[:, 0] - 0.01) / 0.2, 0.0, None) ** 2
    assert np.sqrt(np.mean((found - exact) ** 2)) < 0.02
    near = system.geometry.nodes[np.abs(x) < 0.02, 1]
    energy = system.fracture()["surface_energy"] * composition.scales.stress * composition.scales.length**2
    assert energy / (1e-3 * np.ptp(near)) == pytest.approx(1.0, abs=most)


def pulled(shape: dict[str, Any], end: float, **keys: Any) -> Composition:
    """A strip of 1.2 x 0.825, G_c = 1e-3, l of two spacings, pulled at its long sides so slowly that a crack is stable."""
    speed, half = 0.002, 0.4125
    made = scenes.body(shape, 0.025, material=ELASTIC, phase_field={"fracture_energy": 1e-3, "length": 0.05},
                       damping={"rate": 0.3}, velocity=["0", f"{speed / half}*y"], **keys)  # fmt: skip
    tables = {"boundary": [scenes.driven("+y", y=speed), scenes.driven("-y", y=-speed)]}
    composition = compose(scenes.scene(made, run={"formulation": FORM, "end": end, "cfl": 0.3}, **tables))
    composition.program.run(composition.steps)
    return composition


def torn(composition: Composition, tip: float) -> tuple[float, float, float]:
    """Length of the crack from `tip`, how far it leaves the line y = 0, and its surface energy per length over G_c."""
    system = composition.bodies[0].system
    place = system.geometry.cells[system.attached["phase_field"].response.damage.numpy() > 0.95]
    length = float(place[:, 0].max()) + 0.0125 - tip
    energy = system.fracture()["surface_energy"] * composition.scales.stress * composition.scales.length**2
    return length, float(np.abs(place[:, 1]).max()), energy / (1e-3 * length)


STRIP = scenes.box((0.0, 1.2), (-0.4125, 0.4125))


def test_a_crack_from_a_round_notch_costs_its_toughness() -> None:
    """Along the line of symmetry, through the whole strip; beyond G_c stand the zone in front of the notch, and cells that
    break beside the line."""
    notch = [scenes.box((0.0, 0.3), (-0.0625, 0.0625)), {"type": "disc", "center": [0.3, 0.0], "radius": 0.0625}]
    length, off, energy = torn(pulled({"type": "difference", "shapes": [STRIP, *notch]}, 15.0), 0.3625)
    assert length == pytest.approx(1.2 - 0.3625, abs=0.03)
    assert off < 0.03
    assert energy == pytest.approx(1.0, abs=0.1)


def test_on_a_mapped_lattice_a_strip_tears_as_on_a_lattice() -> None:
    """In time, on its line, and at the same cost."""
    slotted = {"type": "difference", "shapes": [STRIP, scenes.box((0.0, 0.35), (-0.0125, 0.0125))]}
    (straight, off, energy), (wavy, beside, other) = (
        torn(pulled(slotted, 13.3, **keys), 0.35) for keys in ({}, {"map": WAVY})
    )
    assert 0.4 < straight < 0.7
    assert wavy == pytest.approx(straight, abs=0.06)
    assert max(off, beside) < 1e-3
    assert other == pytest.approx(energy, rel=0.05)


@pytest.mark.parametrize(("model", "dim", "precision"), [("elastic", 2, "f64"), ("elastic", 2, "f32"), ("jaumann", 2, "f64"),
                                                         ("elastic", 3, "f64")])  # fmt: skip
def test_a_tearing_body_with_a_fitted_surface_creates_no_energy(model: str, dim: int, precision: str) -> None:
    round_one = {"type": "disc" if dim == 2 else "sphere", "center": [0.0] * dim, "radius": 0.5}
    spacing = 0.1 if dim == 2 else 0.125
    made = scenes.body(round_one, spacing, material={**ELASTIC, "model": model}, phase_field={**TOUGH, "length": 0.2},
                       velocity=["0.8*x - 0.3*y", "0.3*x - 0.1*y", "0.0"][:dim])  # fmt: skip
    result = wsph.run(scenes.scene(made, run={"formulation": FORM, "end": 1.5, "cfl": 0.15, "precision": precision}))
    energy = result.summary["energy"]
    assert result.summary["fracture"]["b"]["broken"] > 0
    assert -1e-3 < energy["residual"] / energy["external_work"] < {"elastic": 1e-3, "jaumann": 2e-2}[model]


@pytest.mark.parametrize(("keys", "text"), [
    ({"map": ["2*x", "y"]}, "too long for their width"),
    ({"map": WAVY, "phase_field": {**TOUGH, "length": 0.04}}, "below the spacing, 0.05"),
])  # fmt: skip
def test_what_cells_cannot_show_is_refused(keys: dict[str, Any], text: str) -> None:
    body = {"material": ELASTIC, "phase_field": {**TOUGH, "length": 0.2}, **keys}
    with pytest.raises(wsph.Refused, match=text):
        compose(scenes.block(2, 20, centred=True, run={"formulation": FORM}, **body))


def test_a_body_of_one_row_of_triangles_is_refused(tmp_path: Path) -> None:
    nodes, corners = meshes.moved_grid((1.0, 0.1), (10, 1), 0.0)
    meshes.write(tmp_path / "row.vtu", nodes, triangle=meshes.triangles(corners))
    data = scenes.block(2, 10, run={"formulation": FORM}, material=ELASTIC, phase_field={**TOUGH, "length": 0.2}).data()
    del data["bodies"][0]["shape"], data["bodies"][0]["spacing"]
    data["bodies"][0]["mesh"] = {"file": str(tmp_path / "row.vtu")}
    with pytest.raises(wsph.Refused, match="too thin"):
        compose(wsph.Scene(**data))
