"""Taylor-SPH by rows of the lattice beside lists, and by lists alone: the same whatever is cut out."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lattice.bodies import CELL, apart, random_body, same_bits
from wsph.formulations.lattice.runs import FIRST, HEAD, OWN
from wsph.formulations.taylor import operators, system
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

PERZYNA = {"yield_stress": 5e-3, "hardening_modulus": 0.1, "fluidity": 0.05, "exponent": 1.0}
LAWS: dict[str, dict[str, Any]] = {
    "elastic": {},
    "jaumann": {"material": scenes.material("jaumann")},
    "mises": {"material": scenes.material("mises", yield_stress=1e-3, hardening_modulus=0.1)},
    "perzyna": {"material": scenes.material("perzyna", **PERZYNA)},
}
FREE = {"elastic": {"state": "stress"}, "perzyna": {"state": "stress", **LAWS["perzyna"]}}


@pytest.fixture(autouse=True)
def rows_always_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    """In bodies that are small, or mostly faces, too."""
    monkeypatch.setattr(operators, "FEWEST", {1: 1, 2: 1, 3: 1})
    monkeypatch.setattr(operators, "SHORTEST", 0.0)


def by_lists(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(operators, "FEWEST", dict.fromkeys((1, 2, 3), 10**9))


def composed(shape: dict[str, Any], keys: dict[str, Any], precision: str = "f64", **tables: Any) -> Composition:
    run = {"integrator": "tsph", "precision": precision, "guard": "off", "cfl": 0.4, "end": 1.0}
    return compose(scenes.scene(scenes.body(shape, **{"spacing": CELL, **keys}), run=run, **tables))


def answers(composition: Composition, seed: int) -> dict[str, np.ndarray]:
    """What both half steps give of a state that moves and is stressed, the particles of a plane held."""
    body, random = composition.bodies[0].system, np.random.default_rng(seed)
    state, half, imposed = body.state, body.new("virtual"), body.new("real")
    # A large velocity: what is the same everywhere strains nothing.
    state.write("velocity", 5.0 + 0.1 * random.standard_normal((body.count, body.space.dim)))
    state.write("stress", 1e-2 * (1.0 + random.standard_normal((body.count, state.widths["stress"]))))
    if "internals" in state.layout:
        state.write("internals", 1e-2 * random.random((body.count, state.widths["internals"])))
    body.half_step(state, half, 0.5)
    found = {f"half {name}": half.read(name).copy() for name in ("velocity", "stress", *_memory(half))}
    body.impose(imposed, (0.0, 1.0))
    body.rate(half, state, imposed=imposed, weight=1.0)
    return found | {name: state.read(name) for name in state.layout.keys()}  # noqa: SIM118


def _memory(state: Any) -> tuple[str, ...]:
    return ("internals",) if "internals" in state.layout else ()


def compared(
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
    shape: dict[str, Any],
    keys: dict[str, Any],
    precision: str = "f64",
    **tables: Any,
) -> float:
    """The largest difference between rows beside lists and lists alone, as a part of the largest number of its field."""
    ours = composed(shape, keys, precision, **tables)
    body = ours.bodies[0].system
    assert 0.0 < body.regular < 1.0
    assert not body.listed
    with monkeypatch.context() as patched:
        by_lists(patched)
        theirs = composed(shape, keys, precision, **tables)
    assert theirs.bodies[0].system.regular == 0.0
    assert ours.pairs == theirs.pairs
    assert body.second_moment == pytest.approx(theirs.bodies[0].system.second_moment, rel=1e-6)
    return apart(answers(ours, seed), answers(theirs, seed))


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_rows_of_the_lattice_are_those_of_lists(seed: int, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shape, keys = random_body(seed, dim)
    assert compared(monkeypatch, seed, shape, keys) < 1e-12


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("law", list(LAWS)[1:])
def test_so_they_are_of_every_law(law: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shape, keys = random_body(1, dim)
    assert compared(monkeypatch, 1, shape, keys | LAWS[law]) < 1e-12


@pytest.mark.parametrize("dim", [1, 2])
@pytest.mark.parametrize("law", list(FREE))
def test_so_they_are_where_normals_are_free(law: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shape, keys = random_body(2, dim)
    assert compared(monkeypatch, 2, shape, keys | FREE[law]) < 1e-12


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("law", ["elastic", "perzyna"])
def test_so_they_are_in_single_precision(law: str, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shape, keys = random_body(3, dim)
    assert compared(monkeypatch, 3, shape, keys | LAWS[law], "f32") < 1e-5


@pytest.mark.parametrize(("dim", "precision"), [(1, "f64"), (2, "f64"), (3, "f64"), (3, "f32")])
def test_so_they_are_where_a_thread_has_a_row(dim: int, precision: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of a GPU, on the CPU."""
    for each in (operators, system):
        monkeypatch.setattr(each, "width_of", lambda device, precision: 1)
    shape, keys = random_body(3, dim)
    within = 1e-12 if precision == "f64" else 1e-5
    assert compared(monkeypatch, 3, shape, keys | LAWS["perzyna"], precision) < within


TURNED = {2: 30.0, 3: [[1.0, 2.0, 3.0], 40.0]}


@pytest.mark.parametrize("dim", [2, 3])
def test_so_they_are_of_turned_bodies_of_unequal_steps(dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shape = scenes.box(0.5, 1.5, 0.4)
    shape = {key: value[:dim] for key, value in shape.items() if key != "type"} | {"type": "box", "rotate": TURNED[dim]}
    assert compared(monkeypatch, 1, shape, {"spacing": [0.1, 0.05, 0.04][:dim], **LAWS["mises"]}) < 1e-12


def test_so_they_are_under_body_forces_that_vary(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = {"body_force": {"x": "1e-3*y"}, "damping": {"rate": 0.1}}
    held, gravity = [scenes.held("-x", 2)], {"y": "-1e-3*(1 + x)"}
    assert compared(monkeypatch, 1, scenes.box(0.7, 1.0), keys, boundary=held, gravity=gravity) < 1e-12


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_every_particle_has_one_row(seed: int, dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a block or in a list; and the weights of all together are those of lists alone, to rounding."""
    shape, keys = random_body(seed, dim)
    body = composed(shape, keys).bodies[0].system
    by_lists(monkeypatch)
    alone = composed(shape, keys).bodies[0].system
    for ours, theirs in ((body.to_virtual, alone.to_virtual), (body.to_real, alone.to_real)):
        pairs, others = (each[0].pairs for each in (ours, theirs))
        assert np.array_equal(pairs.offsets.numpy(), others.offsets.numpy())
        order = np.argsort(pairs.keys())
        assert np.array_equal(pairs.keys()[order], others.keys())
        for one, other in zip(ours, theirs, strict=True):
            assert np.abs(one.values.numpy()[order] - other.values.numpy()).max() < 1e-12
    for operator in (body._virtual, body._real):
        assert operator.table is not None
        blocks = operator.table.numpy().reshape(-1, HEAD + 2**dim)
        taken = [np.arange(block[FIRST], block[FIRST] + block[OWN]) for block in blocks]
        assert sorted(np.concatenate([*taken, operator.listed]).tolist()) == list(range(operator.targets))


def test_rows_need_no_lists(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a body of which most is inside memory falls by what its pairs took."""
    shape = scenes.box(2.0, 2.0)
    ours = composed(shape, {}).bodies[0].system
    by_lists(monkeypatch)
    theirs = composed(shape, {}).bodies[0].system
    pairs = 4 * (4 + 8 * 3) + 8 + 4
    assert theirs.nbytes - ours.nbytes > ours.regular * pairs * (len(ours.lattice.cells) + ours.count) * 0.9


CUT = {"cracks": [{"from": [0.0, 0.5], "to": [0.25, 0.5]}]}
PULLED = [
    scenes.held("-x", 2),
    {"body": "b", "face": "+x", "stress": {"xx": "1e-3*sin(5*t)", "xy": 0.0}},
]
PROBE = {"name": "p", "at": [[0.53, 0.52]], "fields": ["stress_xx", "velocity", "displacement"], "every": 1}


def made(law: str, precision: str = "f64", **run: Any) -> wsph.Scene:
    """A square with a crack, gravity and faces that are held, loaded and planes of symmetry."""
    keys = {"velocity": ["0.01*sin(3*y)", "0.01*x*y"], **CUT, **LAWS[law]}
    run = {"integrator": "tsph", "cfl": 0.4, "end": 0.6, "precision": precision, **run}
    tables = {"boundary": PULLED, "gravity": {"y": -1e-3}, "probes": [PROBE], "output": {"history": 3}}
    return scenes.block(2, 24, run=run, tables=tables, **keys)


@pytest.mark.parametrize("law", list(LAWS))
def test_scenes_are_those_of_lists(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = made(law)
    assert compose(scene).bodies[0].system.regular > 0.8
    ours = wsph.run(scene)
    by_lists(monkeypatch)
    theirs = wsph.run(scene)
    assert ours.summary["steps"] == theirs.summary["steps"]
    for found, expected in ((ours.particles, theirs.particles), (ours.probes["p"], theirs.probes["p"])):
        for name, values in expected.items():
            assert np.abs(found[name] - values).max() <= 1e-9 * max(np.abs(values).max(), 1e-6), name
    for name, values in theirs.history.items():
        assert np.abs(ours.history[name] - values).max() <= 1e-8 * max(np.abs(values).max(), 1e-8), name


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("law", ["elastic", "perzyna"])
def test_its_bits_are_those_of_two_threads_and_of_a_resumed_run(
    law: str, precision: str, tmp_path: Path, share: Callable[[], None]
) -> None:
    share()
    scene = made(law, precision, threads=1)
    same_bits(scene, made(law, precision, threads=2), 0.3, tmp_path / "out")
