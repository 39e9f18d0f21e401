"""Bodies of a lattice, and what they answer."""

from pathlib import Path
from typing import Any

import numpy as np

import wsph
from tests import scenes
from wsph.simulation.composing.composition import Composition

CELL = 0.05


def random_body(seed: int, dim: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """A box with some boxes cut out of it, so long that its lines are cut into segments, and in 2D a crack."""
    random = np.random.default_rng(seed)
    # Segments are of 16 or 32 nodes: ends just before, at and behind one.
    counts = [*random.integers(3, 7, dim - 1).tolist(), int(random.choice([15, 16, 17, 33, 47, 48, 49, 70]))]
    cut = []
    for _ in range(int(random.integers(0, 4)) if dim > 1 else 0):
        low = [int(random.integers(0, n)) for n in counts]
        high = [min(a + int(random.integers(1, 4)), n) for a, n in zip(low, counts, strict=True)]
        if low != [0] * dim:
            cut.append(scenes.box(*((a * CELL, b * CELL) for a, b in zip(low, high, strict=True))))
    shape: dict[str, Any] = scenes.box(*(n * CELL for n in counts))
    if cut:
        shape = {"type": "difference", "shapes": [shape, *cut]}
    keys: dict[str, Any] = {}
    if dim == 2 and not cut:
        y, x = CELL * (counts[1] // 2), CELL * (counts[0] // 2)
        keys["cracks"] = [{"from": [0.0, y], "to": [2 * CELL, y]}] if seed % 2 else [
            {"from": [x, 0.0], "to": [x, 18 * CELL if counts[1] > 20 else 3 * CELL]}
        ]  # fmt: skip
    if dim > 1 and seed % 3 == 0 and not cut and not keys:
        keys["lattice_rotate"] = 30.0 if dim == 2 else [[1.0, 2.0, 3.0], 40.0]
    return shape, keys


def answers(composition: Composition, seed: int) -> dict[str, np.ndarray]:
    """What a state that deforms and moves gives."""
    system, random = composition.bodies[0].system, np.random.default_rng(seed)
    state, out, change = system.state, system.new(), system.new()
    shape = (system.count, system.space.dim)
    # A large translation: what is the same everywhere strains nothing.
    state.write("displacement", 5.0 + 0.1 * CELL * random.standard_normal(shape))
    state.write("velocity", 0.1 * random.standard_normal(shape))
    if "stress" in state.start:
        state.write("stress", 1e-3 * random.standard_normal((state.counts["stress"], state.widths["stress"])))
    if "internals" in state.start and system.form.fades >= 0:
        state.write("internals", 1e-2 * random.random((state.counts["internals"], state.widths["internals"])))
    system.rate(state, out, "velocity")
    found = {"forces": out.read("velocity"), "held": np.array([system.held_energy()])}
    if "drag" in out.layout:
        found["drag"] = out.read("drag")
    if system.form.holds:
        found["holding"] = system.rates.holding.numpy()
    if not system.form.total:
        system.rate(state, change, "rest", 0.5)
        found |= {"stress rate": change.read("stress"), "internals": change.read("internals")}
    found |= {"deformation": state.read("deformation"), "stress": state.read("stress")}
    # What is read stands where steps have what cells hand to nodes.
    system.rate(state, out, "velocity")
    assert np.array_equal(out.read("velocity"), found["forces"])
    return found


def apart(found: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> float:
    """The largest difference of any of the answers, as a part of the largest number of its kind."""
    assert found.keys() == expected.keys()
    # In one dimension two corners have no misfit, and its energy is a rounding.
    return max(
        float(np.abs(found[name] - values).max() / max(np.abs(values).max(), 1e-9)) for name, values in expected.items()
    )


def same_bits(scene: wsph.Scene, two_threads: wsph.Scene, until: float, folder: Path) -> None:
    """Hold a scene to the bits of two threads, and of a run that goes on from `until` [s]."""
    straight, two = wsph.run(scene), wsph.run(two_threads)
    wsph.run(scene.with_(end=until, checkpoint={"every": 5}), folder)
    resumed = wsph.run(scene, folder, resume=True)
    for name, values in straight.particles.items():
        assert np.array_equal(values, two.particles[name]), name
        assert np.array_equal(values, resumed.particles[name]), name
    for name in straight.history:
        assert straight.history[name][-1] == resumed.history[name][-1], name
