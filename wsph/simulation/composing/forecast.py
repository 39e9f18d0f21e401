"""What a scene would take of several processes: particles, copies, messages, memory, and how much of their time is work.

A process works on all rows that it holds, and sends the accelerations of those that others hold too, once a right-hand side;
its work is in particles of as many pairs as the mean, by the counts that bodies are cut by. Of two sets it works on its own
and on what these see, and sends states, once a step.
Where pairs follow the motion it holds more, for what comes near, and has the pairs of what it works on: what it sees at the
start.
With c the time that a right-hand side takes a particle, measured by some steps of the scene in this process, and b the rate
at which memory is copied, measured too, a step of n particles in N processes is efficient to

    E = c n / (N max (c worked + 2 bytes/b + messages alpha)).

The latency alpha of a message is assumed: that of shared memory or of a fast network.
"""

# pyright: strict

import numpy as np

from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.composing.pace import copied, measured
from wsph.simulation.composing.parts import part_of, slabs_of
from wsph.simulation.composing.setting import method_of
from wsph.simulation.composing.shared import refuse_shared, refuse_whole

ALPHA = 4e-6
"""Time of a message [s]: 3 to 4 us were measured in shared memory (Open MPI 5), 2 us are told of InfiniBand."""


def forecast(scene: Scene, composition: Composition, count: int) -> list[tuple[str, str]]:
    """The rows of a check of a scene that `count` processes are to share. Raises SceneError for what they cannot share,
    Refused where there are too few particles."""
    method, joint = method_of(scene), composition.joint
    refuse_shared(scene, method)
    geometries = [run.system.geometry for run in composition.bodies]
    found = slabs_of(scene, geometries, method.formulation, count)
    refuse_whole(scene, [each is not None for each in found], count)
    cut = [(run, slabs) for run, slabs in zip(composition.bodies, found, strict=True) if slabs is not None]
    whole = [run for run, slabs in zip(composition.bodies, found, strict=True) if slabs is None]
    parts = [[part_of(run.system, slab) for slab in slabs] for run, slabs in cut]
    own, copies, numbers, worked, nbytes = (
        np.array([[getattr(each, name) for each in row] for row in parts]).sum(0)
        for name in ("own", "copies", "sent", "worked", "nbytes")
    )
    more = sum(run.system.count for run in whole)
    held, worked = own + copies + more, worked + more
    memory = float(nbytes.max()) + sum(run.system.nbytes for run in whole)
    sent = int(numbers.max()) * np.dtype(composition.space.numpy).itemsize
    per_particle, rate = measured(composition), copied()
    evaluations = max(run.work for run in composition.bodies)
    touching = {name for coupling in (joint.couplings if joint is not None else ()) for name in coupling.bodies()}
    placed = [run for run, slabs in zip(composition.bodies, found, strict=True) if slabs and run.body.name in touching]
    halo, joined = 2.0 * (2 if count > 2 else 1), float(np.ceil(np.log2(count)))
    balls = sum(run.body.name in scene.balls for run, slabs in zip(composition.bodies, found, strict=True) if slabs)
    # Of surfaces in contact: what they hang on, and what acts on them.
    messages = ALPHA * (evaluations * halo * (len(cut) + 2 * len(placed)) + (halo + joined) * balls)
    longest = per_particle * float(worked.max()) + messages + 2.0 * evaluations * sent / rate
    efficiency = per_particle * composition.particles / (count * longest)
    parts = scene.output.in_parts(composition.particles, count)
    return [
        ("processes", f"{count}, slabs across one axis of each body"),
        ("  particles", f"{own.min()} to {own.max()} of its own each"),
        ("  work", f"the largest share is {100.0 * (worked.max() / worked.mean() - 1.0):.2g} % above the mean"),
        *(("  whole", f"body {run.body.name!r}: every process has its {run.system.count} particles") for run in whole),
        *(
            ("  contact", "dealt out, as many vertices each; the surfaces every process has whole")
            for _ in touching and "1"
        ),
        (
            "  copies",
            f"up to {copies.max()} of others' particles, {100.0 * copies.max() / held.max():.2g} % of these and its own",
        ),
        ("  messages", f"{sent / 1024:.4g} kB a right-hand side, {evaluations} of these a step"),
        ("  memory", f"{memory / 2**20:.4g} MB of arrays each"),
        *(
            (
                "  frames",
                f"in {count} parts each, and a file that joins them" if parts else "whole, by the first process",
            )
            for _ in scene.output.formats[:1]
        ),
        (
            "  efficiency",
            f"{100.0 * efficiency:.3g} %, by {1e9 * per_particle:.3g} ns a particle and step and {rate / 1e9:.3g} GB/s, measured"
            f" here, and {1e6 * ALPHA:g} us a message, assumed",
        ),
    ]
