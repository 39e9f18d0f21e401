"""Processes that share a scene beside one: CPU time and wall time of a step, at the same scene (strong) and at so much of it
a process (weak).

    mpiexec -n N python tests/benchmarks/ranks.py [--form updated-lagrangian | tsph | ul-tsph] [--cells 46] [--weak]
        [--seconds 10] [--threads 1] [--set-up]

Prints a line of JSON. CPU is a process's own time in its launches, without messages, the larger of all: the best of slices
of some steps, and the mean, which has what pairs that follow the motion take; walls mean something on quiet cores alone.
`--set-up` makes the scene and runs no step: peak memory of the set-up above that of an empty run.
"""

import argparse
import json
import resource
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

import wsph
from wsph.ranks import world
from wsph.ranks.exchange import ChosenExchange, Exchange
from wsph.ranks.mpi import Ranks
from wsph.simulation.compose import compose


def scene(cells: int, along: int, threads: int, form: str = "stress-points", **body: Any) -> wsph.Scene:
    """A block of cells, or another `body`, that is held and pulled."""
    block = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [float(along), float(cells), float(cells)]},
             "spacing": 1.0, "velocity": ["0", "1e-3*x", "0"],
             "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}}  # fmt: skip
    two_sets = form.endswith("tsph")
    boundary = [
        {"body": "b", "face": "-x", "fixed": ["x", "y", "z"]},
        {"body": "b", "face": "+x", **({"stress": {"xx": 1e-5}} if two_sets else {"traction": {"y": 1e-5}})},
    ]
    run = {"integrator": form} if two_sets else {"integrator": "leapfrog", "formulation": form}
    run |= {"end": 1e6, "dt": 0.2, "guard": "off"}
    return wsph.Scene(schema=1, dim=3, run=run | {"threads": threads}, bodies=[block | body], boundary=boundary)


class Waiting:
    """CPU time that a process has spent in messages, most of it waiting."""

    def __init__(self) -> None:
        self.seconds = 0.0
        for of, name in ((Exchange, "fill"), (ChosenExchange, "fill"), (Ranks, "_hear")):
            setattr(of, name, self._timed(getattr(of, name)))

    def _timed(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            began = time.thread_time()
            found = call(*arguments)
            self.seconds += time.thread_time() - began
            return found

        return timed


def peak() -> float:
    """The most memory that the process has had so far [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--form", default="stress-points")
    parser.add_argument("--cells", type=int, default=46)
    parser.add_argument("--weak", action="store_true")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--set-up", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.quiet = True
    domain, waiting = world.domain(), Waiting()
    small = 15 + 2 * domain.size
    compose(scene(small, small, 1, options.form), domain).compile()  # kernels, and what every run has
    empty, started = peak(), time.perf_counter()
    along = options.cells * (domain.size if options.weak else 1)
    made = compose(scene(options.cells, along, options.threads, options.form), domain)
    made.compile()
    system = made.bodies[0].system
    row = {"processes": domain.size, "threads": options.threads, "particles": made.particles, "weak": options.weak,
           "held": int(domain.max(np.array(system.share.held))), "set_up_seconds": time.perf_counter() - started,
           "set_up_bytes": float(domain.max(np.array(peak() - empty)))}  # fmt: skip
    if not options.set_up:
        made.program.run(3)
        cpus, walls, end = [], [], time.perf_counter() + options.seconds
        while domain.told(lambda: time.perf_counter() < end):
            clock = time.process_time if options.threads > 1 else time.thread_time
            cpu, wall, waited = clock(), time.perf_counter(), waiting.seconds
            made.program.run(5)
            spent = clock() - cpu - (waiting.seconds - waited)
            cpus.append(float(domain.max(np.array(spent))) / 5)
            walls.append(float(domain.max(np.array(time.perf_counter() - wall))) / 5)
        row |= {"cpu_us": 1e6 * min(cpus), "wall_us": 1e6 * min(walls), "slices": len(cpus)}
        row |= {"cpu_mean_us": 1e6 * float(np.mean(cpus)), "cpu_median_us": 1e6 * float(np.median(cpus))}
    if domain.rank == 0:
        print(json.dumps({k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()}), flush=True)


if __name__ == "__main__":
    main()
