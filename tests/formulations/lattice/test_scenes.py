"""Scenes of a body by its lattice: what acts on it, reads it and interrupts it, against the same body by its pairs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lattice.bodies import same_bits
from wsph.formulations.lattice import rates
from wsph.formulations.lattice.block_rates import BlockRates
from wsph.formulations.lattice.edges import rates as edge_rates
from wsph.formulations.lattice.edges import rows as edge_rows
from wsph.simulation.compose import compose

MISES = {"material": scenes.material("mises", yield_stress=2e-3, hardening_modulus=0.1)}
PULLED = [scenes.held("-x", 2), {"body": "b", "face": "+x", "traction": {"x": 1e-3, "y": "-1e-3*sin(5*t)"}}]
RESISTED = [
    {"body": "b", "face": "-x", "spring": {"stiffness": 0.1, "damping": 0.2}},
    {"body": "b", "face": "+x", "quiet": True},
]
CUT = {"name": "cut", "body": "b", "point": [0.45, 0.3], "normal": [1.0, 0.2]}
PROBE = {"name": "p", "at": [[0.5, 0.5]], "fields": ["stress_xx", "stress_xy", "velocity"], "every": 1}
SEEN = {"sections": [CUT], "probes": [PROBE]}
MOVES = {"velocity": ["0.01*sin(3*y)", "0.01*x*y"]}

CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "sections, probes and reactions": ({}, {"boundary": PULLED, **SEEN}),
    "the same of a law by rates": (MISES, {"boundary": PULLED, **SEEN}),
    "a section under viscosity": ({**MOVES, "viscosity": {"alpha": 0.5, "kind": "pair"}}, {"boundary": PULLED, **SEEN}),
    "dashpots and quiet faces": (MOVES, {"boundary": RESISTED, **SEEN}),
    "the same beside viscosity": ({**MOVES, "viscosity": {"alpha": 0.5}}, {"boundary": RESISTED}),
    "periodic faces": (MOVES | {"velocity": ["0", "0.01*sin(2*pi*x)"]}, {"boundary": [{"body": "b", "face": "+x", "periodic": "-x"}], **SEEN}),
    "gravity and forces in regions": ({"body_force": {"x": "1e-3*y*t"}, "damping": {"rate": 0.1}}, {"boundary": PULLED[:1], "gravity": {"y": "-1e-3*(1 + x)*cos(t)"}, **SEEN}),
    "relaxation": ({}, {"boundary": PULLED[:1], "gravity": {"y": -1e-4}, "relax": {}, **SEEN}),
    "relaxation of a law by rates": (MISES, {"boundary": PULLED[:1], "gravity": {"y": -1e-4}, "relax": {}}),
    "an initial stress of a law by rates": ({**MISES, "initial": {"stress": {"xx": "1e-3*y"}}}, {"boundary": PULLED, **SEEN}),
    "an initial stress of a total law": ({"initial": {"stress": {"xx": "1e-3*y"}}}, {"boundary": PULLED, **SEEN}),
    "steps": ({}, {"boundary": [PULLED[0], {**PULLED[1], "steps": ["pull"]}], "steps": [{"name": "pull", "duration": 0.5}, {"name": "free", "duration": 0.5}], **SEEN}),
}  # fmt: skip


def made(keys: dict[str, Any], tables: dict[str, Any], **run: Any) -> wsph.Scene:
    """A square whose lines are cut into segments."""
    run = {"formulation": "stress-points", "cfl": 0.3, "end": 1.0, **run}
    tables, steps = {"output": {"history": 3}, **tables}, tables.get("steps")
    if steps is None:
        return scenes.block(2, 20, run=run, tables=tables, **keys)
    pulled = tables.pop("boundary")
    del tables["steps"]
    data = scenes.block(2, 20, run=run, tables=tables, **keys).data()
    del data["run"]["end"]
    return wsph.Scene(**{**data, "boundary": pulled, "steps": steps})


def by_lattice(scene: wsph.Scene) -> list[bool]:
    """Whether each of the bodies steps by its lattice."""
    return [isinstance(run.system.rates, BlockRates) for run in compose(scene).bodies]


def compare(scene: wsph.Scene, monkeypatch: pytest.MonkeyPatch, within: float = 1e-8) -> None:
    """Run by the lattice and by pairs."""
    assert all(by_lattice(scene))
    ours = wsph.run(scene)
    with monkeypatch.context() as patched:
        for each in (rates, edge_rates):
            patched.setattr(each, "boxes_of", lambda host: None)
        assert not any(by_lattice(scene))
        theirs = wsph.run(scene)
    assert ours.summary["steps"] == theirs.summary["steps"]
    for name, values in theirs.particles.items():
        assert np.abs(ours.particles[name] - values).max() <= within * max(np.abs(values).max(), 1e-6), name
    work = max(np.abs(theirs.history[name]).max() for name in ("kinetic", "strain", "external_work"))
    for name, values in theirs.history.items():
        # What is left of the energies, and sums that are zero, are roundings.
        scale = work if name in ("residual", "hourglass") else np.abs(values).max()
        assert np.abs(ours.history[name] - values).max() <= within * max(scale, 1e-8), name
    for probe, columns in theirs.probes.items():
        for name, values in columns.items():
            assert np.abs(ours.probes[probe][name] - values).max() <= within * max(np.abs(values).max(), 1e-6), name


@pytest.mark.parametrize("name", list(CASES))
def test_what_acts_on_a_body_and_reads_it_is_that_of_pairs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compare(made(*CASES[name]), monkeypatch)


ONE_SET = {"formulation": "total-lagrangian"}
HELD = {"hourglass": {"coefficient": 0.1}, "viscosity": {"alpha": 0.1, "beta": 0.1}}
STIFF = {"material": scenes.material("elastic", poisson_ratio=0.47), "state": "strain"}
EDGES = {
    **{name: case for name, case in CASES.items() if case[0].get("viscosity", {}).get("kind") is None},
    "volumes of blocks": ({**STIFF, **MOVES}, {"boundary": PULLED, **SEEN}),
    "relaxation of volumes of blocks": (STIFF, {"boundary": PULLED[:1], "gravity": {"x": 1e-4, "y": -1e-4}, "relax": {}, **SEEN}),
    "volumes of blocks of a law by rates": ({**MISES, **MOVES, "state": "strain"}, {"boundary": PULLED, **SEEN}),
    "the same beside hourglass and viscosity": ({**MISES, **MOVES, **HELD, "residual": {"coefficient": 0.1}, "state": "strain"}, {"boundary": PULLED, **SEEN}),
    "an initial stress beside volumes of blocks": ({**STIFF, "initial": {"stress": {"xx": "1e-3*y"}}}, {"boundary": PULLED, **SEEN}),
    "hourglass and viscosity": (MOVES | HELD, {"boundary": PULLED, **SEEN}),
    "hourglass, viscosity and dashpots": (MOVES | HELD | {"residual": False}, {"boundary": RESISTED, **SEEN}),
}  # fmt: skip
"""Those of a body whose nodes see each other along edges."""


@pytest.mark.parametrize("name", list(EDGES))
def test_so_it_is_along_edges(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compare(made(*EDGES[name], **ONE_SET), monkeypatch)


@pytest.mark.parametrize(
    "name",
    [
        "sections, probes and reactions",
        "hourglass, viscosity and dashpots",
        "volumes of blocks",
        "volumes of blocks of a law by rates",
        "an initial stress of a total law",
    ],
)
def test_so_it_is_along_edges_where_a_thread_has_a_row(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    monkeypatch.setattr(edge_rows, "width_of", lambda device, precision: 1)
    compare(made(*EDGES[name], **ONE_SET), monkeypatch)


@pytest.mark.parametrize("name", ["sections, probes and reactions", "the same beside viscosity"])
def test_so_it_is_where_a_thread_has_a_row(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    monkeypatch.setattr(rates, "width_of", lambda device, precision: 1)
    compare(made(*CASES[name]), monkeypatch)


@pytest.mark.parametrize("model", ["elastic", "mises"])
def test_bodies_that_touch_are_those_of_pairs(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    law = MISES if model == "mises" else {}
    pair = [
        scenes.body(scenes.box((x, x + 1.0), (0.0, 0.5)), 0.05, name, velocity=[v, 0.0], **law)
        for name, x, v in (("a", 0.0, 0.005), ("b", 1.005, -0.005))
    ]
    run = {"formulation": "stress-points", "end": 1.5, "cfl": 0.3}
    compare(scenes.scene(*pair, run=run, contact=[{"between": ["a", "b"], "friction": 0.2}]), monkeypatch, 1e-6)


def fitted(keys: dict[str, Any], **run: Any) -> wsph.Scene:
    """A disc, whose cells are those of a grid but for a layer."""
    body = scenes.body({"type": "disc", "center": [0.5, 0.5], "radius": 0.7}, 0.05, **MOVES, **keys)
    held = {"body": "b", "where": "x < 0.0", "velocity": {"x": "1e-3*sin(4*t)"}}
    pulled = {"body": "b", "where": "x > 1.0", "traction": {"x": 1e-3, "y": "-1e-3*sin(5*t)"}}
    cut = {**CUT, "point": [0.52, 0.5]}
    run = {"formulation": "stress-points", "cfl": 0.3, "end": 1.0, **run}
    tables = {"boundary": [held, pulled], "probes": SEEN["probes"], "sections": [cut], "output": {"history": 3}}
    return scenes.scene(body, run=run, **tables)


LAWS = {
    "elastic": {},
    "mises": MISES,
    "viscous": {"viscosity": {"alpha": 0.5, "kind": "pair"}},
    "begun with a stress": {**MISES, "initial": {"stress": {"xx": "1e-3*y"}}},
    "a total law about a stress": {"initial": {"stress": {"xx": "1e-3*y"}}},
}


@pytest.mark.parametrize("law", LAWS)
def test_a_fitted_body_is_that_of_pairs(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compare(fitted(LAWS[law]), monkeypatch)


@pytest.mark.parametrize("law", LAWS)
def test_its_bits_are_those_of_two_threads_and_of_a_resumed_run(
    law: str, tmp_path: Path, share: Callable[[], None]
) -> None:
    share()
    scene = fitted(LAWS[law], threads=1)
    same_bits(scene, fitted(LAWS[law], threads=2), 0.5, tmp_path / "out")


BITS = {
    "residual": {},
    "hourglass and viscosity": HELD,
    "by rates": MISES,
    "by rates, of blocks": {**MISES, "state": "strain"},
    "blocks": STIFF,
    "begun with a stress": {"initial": {"stress": {"xx": "1e-3*y"}}},
}


@pytest.mark.parametrize("keys", BITS.values(), ids=list(BITS))
@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_along_edges_it_has_the_same_bits_resumed_and_on_two_threads(
    keys: dict[str, Any], precision: str, tmp_path: Path, share: Callable[[], None]
) -> None:
    share()
    scene = made(
        {**MOVES, **keys}, {"boundary": [PULLED[1], RESISTED[0]], **SEEN}, precision=precision, threads=1, **ONE_SET
    )
    assert by_lattice(scene) == [True]
    same_bits(scene, scene.with_(run={**scene.data()["run"], "threads": 2}), 0.5, tmp_path / "out")


@pytest.mark.parametrize("keys", [{}, MISES, {"viscosity": {"alpha": 0.5}}], ids=["elastic", "mises", "viscous"])
@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_resumed_it_has_the_same_bits(keys: dict[str, Any], precision: str, tmp_path: Path) -> None:
    scene = made({**MOVES, **keys}, {"boundary": [PULLED[1], RESISTED[0]], **SEEN}, precision=precision)
    assert by_lattice(scene) == [True]
    straight = wsph.run(scene)
    wsph.run(scene.with_(end=0.5, checkpoint={"every": 5}), tmp_path / "out")
    resumed = wsph.run(scene, tmp_path / "out", resume=True)
    for name, values in straight.particles.items():
        assert np.array_equal(values, resumed.particles[name]), name
    for name in straight.history:
        assert straight.history[name][-1] == resumed.history[name][-1], name
