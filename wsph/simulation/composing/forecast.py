"""What a scene would take of several processes: particles, copies, messages, memory, and how much of their time is work.

A process works on all rows that it holds, and sends the accelerations of those that others hold too, once a right-hand side.
With c the time that a right-hand side takes a particle, measured by some steps of the scene in this process, and b the rate
at which memory is copied, measured too, a step of n particles in N processes is efficient to

    E = c n / (N max (c held + 2 bytes/b + messages alpha)).

The latency alpha of a message is assumed: that of shared memory or of a fast network.
"""

# pyright: strict

import time

import numpy as np
import warp as wp

from wsph.geometry.grid import layers_of, plan
from wsph.ranks.slabs import slabs
from wsph.scene.geometries import reach_of
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.composing.setting import method_of
from wsph.simulation.composing.shared import refuse_shared

ALPHA = 4e-6
"""Time of a message [s]: 3 to 4 us were measured in shared memory (Open MPI 5), 2 us are told of InfiniBand."""

MEASURED_SECONDS = 0.5
"""Time that is spent on measuring a step [s]."""

COPIED = 2**22
"""Bytes that are copied to measure the rate of memory."""


def forecast(scene: Scene, composition: Composition, count: int) -> list[tuple[str, str]]:
    """The rows of a check of a scene with one body that `count` processes are to share. Raises SceneError for what they
    cannot share, Refused where there are too few particles."""
    method, body = method_of(scene), scene.bodies[0]
    refuse_shared(scene, method)
    assert body.shape is not None
    assert body.spacing is not None
    grid = plan(body.shape, body.spacing, body.lattice_rotate)
    layers = layers_of(body.shape, grid, 0, int(grid.count[0]) + 1)
    reach, joined = reach_of(scene, body, method.formulation)
    found = slabs(layers[:, 0], layers[:-1, 1], count, reach, joined=joined, who=f"body {body.name!r}")
    shares = [each.cells if joined and composition.particles == layers[:-1, 1].sum() else each.nodes for each in found]
    held = np.array([share.held for share in shares])
    copies = np.array([share.held - (share.high - share.low) for share in shares])
    sent = int(copies.max()) * scene.dim * np.dtype(composition.space.numpy).itemsize
    per_particle, rate = _measured(composition), _copied()
    evaluations = max(run.work for run in composition.bodies)
    messages = 2.0 * (2 if count > 2 else 1) * evaluations * ALPHA
    longest = per_particle * float(held.max()) + messages + 2.0 * evaluations * sent / rate
    efficiency = per_particle * composition.particles / (count * longest)
    memory = composition.nbytes / composition.particles * float(held.max())
    return [
        ("processes", f"{count}, slabs across the first axis of the grid"),
        (
            "  particles",
            f"{min(s.high - s.low for s in shares)} to {max(s.high - s.low for s in shares)} of its own each",
        ),
        (
            "  copies",
            f"up to {copies.max()} of others' particles, {100.0 * copies.max() / held.max():.2g} % of what it holds",
        ),
        ("  messages", f"{sent / 1024:.4g} kB a right-hand side, {evaluations} of these a step"),
        ("  memory", f"{memory / 2**20:.4g} MB of arrays each"),
        (
            "  efficiency",
            f"{100.0 * efficiency:.3g} %, by {1e9 * per_particle:.3g} ns a particle and step and {rate / 1e9:.3g} GB/s, measured"
            f" here, and {1e6 * ALPHA:g} us a message, assumed",
        ),
    ]


def _measured(composition: Composition) -> float:
    """The time of a step of one thread for a particle [s]."""
    composition.compile()
    program, best, end = composition.program, np.inf, time.perf_counter() + MEASURED_SECONDS
    program.run(2)
    while time.perf_counter() < end:
        began = time.thread_time()
        program.run(4)
        wp.synchronize_device(composition.device)
        best = min(best, (time.thread_time() - began) / 4.0)
    return best / composition.particles


def _copied() -> float:
    """The rate at which memory is copied [bytes/s]."""
    here, there, best = np.ones(COPIED // 8), np.zeros(COPIED // 8), np.inf
    for _ in range(5):
        began = time.perf_counter()
        np.copyto(there, here)
        best = min(best, time.perf_counter() - began)
    return COPIED / best
