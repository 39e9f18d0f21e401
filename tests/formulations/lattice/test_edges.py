"""Nodes that see each other along the edges of a lattice, by rows of it and by rows of pairs: the same body to rounding."""

from typing import Any

import numpy as np
import pytest

from tests import scenes
from tests.formulations.lattice.bodies import CELL, answers, random_body
from wsph.checking import described
from wsph.formulations.lattice import edge_rates
from wsph.formulations.lattice.edge_rates import EdgeRates
from wsph.formulations.lattice.runs import CLOSES, FIRST, HEAD, OPENS, OWN, edge_runs
from wsph.geometry.edges import cell_edges
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

HOURGLASS, VISCOSITY = {"hourglass": {"coefficient": 0.1}}, {"viscosity": {"alpha": 0.5, "beta": 0.3}}
PARTS: dict[str, dict[str, Any]] = {
    "residual": {},
    "none": {"residual": False},
    "viscosity": VISCOSITY,
    "hourglass": {"residual": False, **HOURGLASS},
    "all": {"residual": {"coefficient": 0.2}, **HOURGLASS, **VISCOSITY},
    "neo-hookean": {"material": scenes.material("neo-hookean")},
}


def composed(shape: dict[str, Any], precision: str = "f64", **keys: Any) -> Composition:
    run = {"formulation": "total-lagrangian", "precision": precision, "guard": "off", "cfl": 0.2, "end": 1.0}
    return compose(scenes.scene(scenes.body(shape, CELL, **keys), run=run))


def both(monkeypatch: pytest.MonkeyPatch, seed: int, dim: int, precision: str, **keys: Any) -> float:
    """The largest difference between rows of the lattice and rows of pairs, as a part of the largest number."""
    shape, more = random_body(seed, dim)
    keys |= {name: value for name, value in more.items() if name != "cracks"}
    ours = composed(shape, precision, **keys)
    assert isinstance(ours.bodies[0].system.rates, EdgeRates)
    assert ours.bodies[0].system.regular == 1.0
    with monkeypatch.context() as patched:
        patched.setattr(edge_rates, "boxes_of", lambda host: None)
        theirs = composed(shape, precision, **keys)
    assert not isinstance(theirs.bodies[0].system.rates, EdgeRates)
    assert ours.pairs == theirs.pairs
    found, expected = answers(ours, seed), answers(theirs, seed)
    assert found.keys() == expected.keys()
    return max(
        float(np.abs(found[name] - values).max() / np.abs(values).max())
        for name, values in expected.items()
        if values.any()
    )


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_rows_of_the_lattice_are_rows_of_pairs(seed: int, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, seed, dim, "f64", **PARTS["all"]) < 1e-11


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", list(PARTS))
def test_so_they_are_of_every_law_and_part(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 3, dim, "f64", **PARTS[name]) < 1e-11


@pytest.mark.parametrize("state", ["stress", "strain"])
def test_so_they_are_in_both_states_of_a_plane(state: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 2, 2, "f64", state=state) < 1e-11


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", ["residual", "all"])
def test_so_they_are_in_single_precision(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 2, dim, "f32", **PARTS[name]) < 2e-4


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", ["residual", "all"])
def test_so_they_are_where_a_thread_has_a_row(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    monkeypatch.setattr(edge_rates, "width_of", lambda device, precision: 1)
    assert both(monkeypatch, 3, dim, "f64", **PARTS[name]) < 1e-11


@pytest.mark.parametrize("width", [16, 32])
@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_every_node_is_in_one_block_and_sees_its_edges(seed: int, dim: int, width: int) -> None:
    shape, _ = random_body(seed, dim)
    body = composed(shape).bodies[0].system.lattice
    assert body.boxes is not None
    runs = edge_runs(body.boxes, width)
    taken = [np.arange(block[FIRST], block[FIRST] + block[OWN]) for block in runs.blocks]
    assert np.concatenate(taken).tolist() == list(range(len(body.nodes)))
    edges = cell_edges(body.corners, len(body.nodes))
    assert runs.edges == len(edges.start)
    seen = set()
    for block, rows in zip(runs.blocks, taken, strict=True):
        for side, first in enumerate(block[HEAD : HEAD + 2 * dim]):
            ends = first + np.arange(len(rows))
            assert ends.min() >= 0
            assert ends.max() < len(body.nodes)
            seen |= set(zip(rows.tolist(), ends.tolist(), [side // 2] * len(rows), strict=True))
            for column, row, none in ((OPENS, 0, 2 * dim - 2), (CLOSES, -1, 2 * dim - 1)):
                if block[column] and side == none:
                    seen -= {(int(rows[row]), int(ends[row]), dim - 1)}
    assert set(zip(edges.start.tolist(), edges.end.tolist(), edges.axis.tolist(), strict=True)) <= seen


def test_pieces_take_what_was_found_before() -> None:
    body = composed(scenes.box(0.5, 0.6, 1.7)).bodies[0].system.lattice
    assert body.boxes is not None
    runs = edge_runs(body.boxes, 16)
    pieces = runs.pieces(20, 4)
    assert len(pieces) > 5
    done = [0, 0, 0, 0]
    for piece in pieces:
        for stage, (first, end) in enumerate(piece):
            assert first == done[stage]
            done[stage] = end
            assert stage == 0 or end == first or runs.reach[first:end].max() < done[stage - 1]
    assert done == [len(runs.blocks)] * 4


LISTED: dict[str, dict[str, Any]] = {
    "volumes are those of blocks of particles": {"material": scenes.material("elastic", poisson_ratio=0.47), "state": "strain"},
    "its law gives rates": {"material": scenes.material("jaumann")},
    "it begins with a stress": {"initial": {"stress": {"xx": 1e-3}}},
    "its cells differ": {"jitter": 0.1},
    "its pairs are a kernel's": {"viscosity": {"alpha": 0.5, "kind": "pair"}},
}  # fmt: skip


def told(composition: Composition) -> str:
    """What `wsph check` says of the rows of a body."""
    return dict(described(composition.scene, "scene"))["  rows"]


@pytest.mark.parametrize("why", list(LISTED))
def test_other_bodies_keep_their_pairs_and_say_why(why: str) -> None:
    composition = composed(scenes.box(0.5, 0.5), **LISTED[why])
    assert not isinstance(composition.bodies[0].system.rates, EdgeRates)
    assert told(composition) == f"0 % follow from the lattice, without lists of pairs: {why}"


def test_a_body_that_needs_no_list_says_so() -> None:
    assert told(composed(scenes.box(0.5, 0.5))) == "100 % follow from the lattice, without lists of pairs"
