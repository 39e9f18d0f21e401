"""Rows that follow from the lattice and rows of pairs: the same body to rounding, whatever is cut out of it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lattice.bodies import CELL, answers, apart, random_body
from wsph.formulations.lattice import pieces, rates
from wsph.formulations.lattice.edges import rows as edge_rows
from wsph.formulations.lattice.pieces import Pieces, pieces_of
from wsph.formulations.lattice.rates import LatticeRates
from wsph.formulations.lattice.runs import FIRST, OWN, runs_of
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

PARTS: dict[str, dict[str, Any]] = {
    "elastic": {},
    "without a residual": {"residual": False},
    "neo-hookean": {"material": scenes.material("neo-hookean")},
    "begun with a stress": {"initial": {"stress": {"xx": "1e-3*x"}}},
    "viscous": {"viscosity": {"alpha": 0.5, "kind": "pair"}},
    "mises": {"material": scenes.material("mises", yield_stress=1e-3, hardening_modulus=0.1)},
    "jaumann and bulk viscosity": {"material": scenes.material("jaumann"), "viscosity": {"alpha": 0.5, "beta": 1.0}},
}


def composed(shape: dict[str, Any], keys: dict[str, Any], precision: str = "f64", spacing: float = CELL) -> Composition:
    body = scenes.body(shape, spacing, **keys)
    run = {"formulation": "stress-points", "precision": precision, "guard": "off", "cfl": 0.2, "end": 1.0}
    return compose(scenes.scene(body, run=run))


def ball(dim: int, radius: float) -> dict[str, Any]:
    return {"type": "disc" if dim == 2 else "sphere", "center": [0.5] * dim, "radius": radius}


FITTED: dict[str, tuple[dict[str, Any], float]] = {
    "disc": (ball(2, 0.65), CELL),
    "turned plate with a hole and a notch": (
        {
            "type": "difference",
            "shapes": [
                scenes.box(1.0, 2.0) | {"rotate": 20.0},
                {"type": "disc", "center": [0.5, 1.0], "radius": 0.18},
                scenes.box((-0.2, 0.2), (0.2, 0.3)),
            ],
        },
        0.025,
    ),
    "sphere": (ball(3, 0.8), CELL),
    "rod": ({"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 0.0, 0.4], "radius": 0.6}, CELL),
}
"""Shapes of bodies with a fitted surface, and spacings."""


def both(monkeypatch: pytest.MonkeyPatch, seed: int, dim: int, precision: str, **parts: Any) -> float:
    """The largest difference between rows of the lattice and rows of pairs, as a part of the largest number."""
    shape, keys = random_body(seed, dim)
    return compared(monkeypatch, seed, precision, shape, keys | parts)


def compared(
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
    precision: str,
    shape: dict[str, Any],
    keys: dict[str, Any],
    spacing: float = CELL,
) -> float:
    ours = composed(shape, keys, precision, spacing)
    assert isinstance(ours.bodies[0].system.rates, LatticeRates)
    monkeypatch.setattr(rates, "boxes_of", lambda host: None)
    theirs = composed(shape, keys, precision, spacing)
    assert not isinstance(theirs.bodies[0].system.rates, LatticeRates)
    assert ours.pairs == theirs.pairs
    return apart(answers(ours, seed), answers(theirs, seed))


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_rows_of_the_lattice_are_rows_of_pairs(seed: int, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, seed, dim, "f64") < 1e-11


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", list(PARTS)[1:])
def test_so_they_are_of_every_law_and_part(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 1, dim, "f64", **PARTS[name]) < 1e-10


@pytest.mark.parametrize("name", list(FITTED))
def test_so_they_are_of_fitted_bodies(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shape, spacing = FITTED[name]
    system = composed(shape, {}, "f64", spacing).bodies[0].system
    assert 0.25 < system.regular < 0.95
    assert compared(monkeypatch, 1, "f64", shape, {}, spacing) < 1e-10


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize(
    "part", ["without a residual", "begun with a stress", "viscous", "mises", "jaumann and bulk viscosity"]
)
def test_so_they_are_of_every_law_on_them(part: str, precision: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shape, spacing = FITTED["disc"]
    within = 1e-10 if precision == "f64" else 2e-3
    assert compared(monkeypatch, 1, precision, shape, PARTS[part], spacing) < within


@pytest.mark.parametrize("part", ["viscous", "mises"])
def test_so_they_are_on_them_where_a_thread_has_a_row(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    monkeypatch.setattr(rates, "width_of", lambda device, precision: 1)
    shape, spacing = FITTED["disc"]
    assert compared(monkeypatch, 1, "f64", shape, PARTS[part], spacing) < 1e-10


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_so_they_are_in_single_precision(dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 2, dim, "f32") < 2e-3


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", ["elastic", "viscous", "mises"])
def test_so_they_are_where_a_thread_has_a_row(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    monkeypatch.setattr(rates, "width_of", lambda device, precision: 1)
    assert both(monkeypatch, 3, dim, "f64", **PARTS[name]) < 1e-10


@pytest.mark.parametrize("width", [16, 32])
@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_every_cell_and_every_node_is_in_one_block(seed: int, dim: int, width: int) -> None:
    shape, keys = random_body(seed, dim)
    body = composed(shape, keys).bodies[0].system.lattice
    assert body.boxes is not None
    runs = runs_of(body.boxes, (len(body.nodes), len(body.cells)), width, 13)
    for blocks, rows in ((runs.cells, len(body.cells)), (runs.nodes, len(body.nodes))):
        taken = np.concatenate([np.arange(block[FIRST], block[FIRST] + block[OWN]) for block in blocks])
        assert sorted(taken.tolist()) == list(range(rows))


@pytest.mark.parametrize("material", ["elastic", "mises"])
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_steps_have_the_same_bits_for_any_number_of_threads(
    form: str, material: str, share: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each has a part of the body, piece by piece, and what takes of two parts is left until both have ended."""
    share()
    parts: list[int] = []

    def noting(*given: Any) -> Pieces:
        found = pieces_of(*given)
        parts.append(len(found.parts))
        return found

    monkeypatch.setattr(pieces, "pieces_of", noting)
    for each in (rates, edge_rows):
        monkeypatch.setattr(each, "PIECE_BYTES", 2**14)
    shape, law = scenes.box(0.9, 1.0, 1.7), PARTS[material]
    keys = {"velocity": ["0.1*sin(3*y)", "0.1*x*z", "0"], **law}
    found = []
    for threads in (1, 2, 3):
        run = {"formulation": form, "guard": "off", "cfl": 0.4, "end": 0.2, "threads": threads}
        scene = scenes.scene(scenes.body(shape, CELL, **keys), run=run)
        found.append(wsph.run(scene).particles)
    assert set(parts) == {1, 2, 3}
    for name in found[0]:
        assert np.array_equal(found[0][name], found[1][name]), name
        assert np.array_equal(found[0][name], found[2][name]), name
