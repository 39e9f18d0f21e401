"""Nodes that see each other along the edges of a lattice, by rows of it and by rows of pairs: the same body to rounding."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests import scenes
from tests.formulations.lattice.bodies import CELL, answers, random_body
from wsph.backend.arrays import Arrays
from wsph.backend.space import Space
from wsph.checking import described
from wsph.formulations.lagrangian.blocks import blocks_of
from wsph.formulations.lattice.edges import rates as edge_rates
from wsph.formulations.lattice.edges import rows as edge_rows
from wsph.formulations.lattice.edges.blocks import block_runs
from wsph.formulations.lattice.edges.rates import EdgeRates
from wsph.formulations.lattice.edges.rows import Rows
from wsph.formulations.lattice.pieces import pieces_of
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
MISES = {"material": scenes.material("mises", yield_stress=1e-3, hardening_modulus=0.1)}
BEGUN = {"initial": {"stress": {"xx": "1e-3*x"}}}
STIFF = {"poisson_ratio": 0.47}
LAWS: dict[str, dict[str, Any]] = {
    "jaumann": {"material": scenes.material("jaumann")},
    "jaumann without a residual": {"material": scenes.material("jaumann"), "residual": False},
    "jaumann begun with a stress": {"material": scenes.material("jaumann"), **BEGUN},
    "stiff jaumann": {"material": scenes.material("jaumann", **STIFF)},
    "perzyna": {
        "material": scenes.material("perzyna", yield_stress=1e-3, hardening_modulus=0.1, fluidity=1.0, exponent=1.0)
    },
    "mises": MISES,
    "mises and all parts": {**MISES, **PARTS["all"]},
    "stiff mises": {"material": scenes.material("mises", yield_stress=1e-3, hardening_modulus=0.1, **STIFF)},
    "stiff": {"material": scenes.material("elastic", **STIFF)},
    "stiff neo-hookean and all parts": {"material": scenes.material("neo-hookean", **STIFF), **PARTS["all"]},
    "begun with a stress": BEGUN,
    "stiff, begun with a stress": {"material": scenes.material("elastic", **STIFF), **BEGUN},
}
"""Laws that integrate their stress, volumes of blocks, and stresses that a body begins with; of bodies that flow the
residual fades."""


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


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", list(LAWS))
def test_so_they_are_of_rates_of_blocks_and_of_initial_stresses(
    name: str, dim: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert both(monkeypatch, 5, dim, "f64", **LAWS[name]) < 1e-10


@pytest.mark.parametrize("name", ["elastic", *LAWS])
@pytest.mark.parametrize("state", ["stress", "strain"])
def test_so_they_are_in_both_states_of_a_plane(state: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 2, 2, "f64", state=state, **LAWS.get(name, {})) < 1e-10


SOME = {
    **{name: PARTS[name] for name in ("residual", "all")},
    **{name: LAWS[name] for name in ("mises and all parts", "stiff", "stiff, begun with a stress")},
}


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", SOME)
def test_so_they_are_in_single_precision(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(monkeypatch, 2, dim, "f32", **SOME[name]) < 2e-4


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", SOME)
def test_so_they_are_where_a_thread_has_a_row(name: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    monkeypatch.setattr(edge_rows, "width_of", lambda device, precision: 1)
    assert both(monkeypatch, 3, dim, "f64", **SOME[name]) < 1e-10


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


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_pieces_take_what_was_found_before(threads: int) -> None:
    """Of their own part; what is left, of all parts. Each block is done once."""
    body = composed(scenes.box(0.5, 0.6, 1.7)).bodies[0].system.lattice
    assert body.boxes is not None
    runs = edge_runs(body.boxes, 16)
    rows = Rows.of(composed(scenes.box(0.5, 0.6, 1.7), **MISES).bodies[0].system.rates._host, body.boxes, "cpu")
    assert rows.blocks is not None
    counts = [len(runs.blocks), len(runs.blocks), len(rows.blocks.runs), len(runs.blocks), len(runs.blocks)]
    stages = [runs.takes, *rows.around, runs.takes]
    found = pieces_of(counts[0], 12, stages, threads)
    assert len(found.parts) == threads
    done = [np.zeros(count, int) for count in counts]
    own = [np.full(count, -1) for count in counts]

    def takes(stage: int, block: int) -> slice:
        return slice(stages[stage - 1].first[block], stages[stage - 1].last[block] + 1)

    for part, pieces in enumerate(found.parts):
        for piece in pieces:
            for stage, (first, end) in enumerate(piece):
                for block in range(first, end):
                    assert stage == 0 or (own[stage - 1][takes(stage, block)] == part).all()
                done[stage][first:end] += 1
                own[stage][first:end] = part
    for stage, spans in enumerate(found.left):
        blocks = [block for first, end in spans for block in range(first, end)]
        assert (len(blocks) == 0) == (threads == 1 or stage == 0)
        for block in blocks:
            assert done[stage - 1][takes(stage, block)].all()
        done[stage][blocks] += 1
    assert all((each == 1).all() for each in done)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_runs_of_blocks_hold_the_nodes_of_blocks(seed: int, dim: int) -> None:
    """Those of lists."""
    shape, _ = random_body(seed, dim)
    body = composed(shape).bodies[0].system.lattice
    count, rows = blocks_of(body, Space(dim), Arrays("cpu"))
    ends, nodes = rows.offsets.numpy(), rows.indices.numpy()
    expected = {tuple(nodes[a:b].tolist()) for a, b in pairwise(ends)}
    found = block_runs(body.index, 8)
    seen: set[tuple[int, ...]] = set()
    for many, *first in found.runs.tolist():
        assert many <= 8
        for k in range(many):
            seen.add(tuple(sorted(at + 2 * k for at in first if at >= 0)))
    assert len(seen) == count
    assert seen == expected


LISTED: dict[str, dict[str, Any]] = {
    "its cells differ": {"jitter": 0.1},
    "its pairs are a kernel's": {"viscosity": {"alpha": 0.5, "kind": "pair"}},
}


def told(composition: Composition) -> str:
    """What `wsph check` says of the rows of a body."""
    return dict(described(composition.scene, "scene"))["  rows"]


@pytest.mark.parametrize("why", list(LISTED))
def test_other_bodies_keep_their_pairs_and_say_why(why: str) -> None:
    composition = composed(scenes.box(0.5, 0.5), **LISTED[why])
    assert not isinstance(composition.bodies[0].system.rates, EdgeRates)
    assert told(composition) == f"0 % follow from the lattice, without lists of pairs: {why}"


@pytest.mark.parametrize("name", ["elastic", "jaumann", "stiff", "stiff mises", "stiff, begun with a stress"])
def test_a_body_that_needs_no_list_says_so(name: str) -> None:
    keys = {"state": "strain", **LAWS.get(name, {})}
    assert told(composed(scenes.box(0.5, 0.5), **keys)) == "100 % follow from the lattice, without lists of pairs"
