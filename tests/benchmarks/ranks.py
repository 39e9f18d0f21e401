"""Processes that share a scene beside one: CPU time and wall time of a step, at the same scene (strong) and at so much of it
a process (weak).

    mpiexec -n N python tests/benchmarks/ranks.py [--form updated-lagrangian] [--cells 46] [--weak] [--seconds 10]
        [--threads 1] [--set-up] [--shape cylinder]

Prints a line of JSON. CPU is a process's own time in its launches, without messages, the larger of all: the best of slices
of some steps, and the mean, which has what pairs that follow the motion take; walls mean something on quiet cores alone.
`visits` are the pairs of the process that has most, over the mean of all, and `cpu` its time, the median of slices, over the
mean of all. `--set-up` makes the scene and runs no step: peak memory of the set-up above that of an empty run. `--shape` takes
another body than the cube, with about a quarter of `cells` along its shorter sides.
"""

import argparse
import atexit
import json
import os
import resource
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

import wsph
from wsph.backend.domain import Domain
from wsph.geometry.cells import LISTED
from wsph.ranks import world
from wsph.ranks.exchange import ChosenExchange, Exchange
from wsph.ranks.mpi import Ranks
from wsph.simulation.compose import compose
from wsph.validation import meshes


Table = dict[str, Any]


def box(*high: float, low: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Table:
    return {"type": "box", "min": list(low), "max": list(high)}


def round_bar(length: float, radius: float) -> Table:
    return {"type": "cylinder", "from": [0.0] * 3, "to": [length, 0.0, 0.0], "radius": radius}


def tetrahedra(side: float) -> Table:
    """A mesh that is coarse at one end and fine at the other."""
    count, length = int(side), 4.0 * side
    nodes, corners = meshes.moved_grid((length, side, side), (4 * count, count, count), 0.0)
    nodes[:, 0] *= 1.5 - 0.5 * nodes[:, 0] / length
    file = Path(tempfile.gettempdir()) / f"wsph-ranks-{os.getppid()}-{count}.vtu"
    if world.domain().rank == 0:
        meshes.write(file, nodes, tetra=meshes.tetrahedra(corners))
    world.domain().told(lambda: None)
    atexit.register(file.unlink, missing_ok=True)
    return {"shape": None, "spacing": None, "mesh": {"file": str(file)}}


def holes(side: float) -> list[Table]:
    """Round holes across one end of a bar."""
    middle, z = 0.5 * side, {"from": [0.0, 0.0, -1.0], "to": [0.0, 0.0, side + 1.0]}
    across = [{k: [x, middle, v[2]] for k, v in z.items()} for x in (0.5 * side, 1.25 * side)]
    return [{"type": "cylinder", "name": f"h{k}", "radius": 0.25 * side, **each} for k, each in enumerate(across)]


SHAPES: dict[str, Callable[[float], Table]] = {
    "cylinder": lambda a: {"shape": round_bar(4.0 * a, 0.5 * a)},
    "sphere": lambda a: {"shape": {"type": "sphere", "center": [0.0] * 3, "radius": a}},
    "stepped": lambda a: {
        "shape": {
            "type": "union",
            "shapes": [box(2.0 * a, a, a), box(6.0 * a, a / 2, a / 2, low=(2.0 * a, a / 4, a / 4))],
        }
    },
    "tapered": lambda a: {"shape": box(4.0 * a, a, a), "map": ["x", f"y*(1 - 0.15*x/{a})", f"z*(1 - 0.15*x/{a})"]},
    "drilled": lambda a: {"shape": {"type": "difference", "shapes": [box(4.0 * a, a, a), *holes(a)]}},
    "tetrahedra": tetrahedra,
    "box": lambda a: {"shape": box(4.0 * a, a, a)},
}
"""Bodies along x, by the length of their shorter sides in cells, a multiple of 4."""


def scene(cells: int, along: int, threads: int, form: str = "stress-points", **body: Any) -> wsph.Scene:
    """A block of cells, or another `body`, that is held and pulled."""
    block = {"name": "b", "shape": box(float(along), float(cells), float(cells)),
            "spacing": 1.0, "velocity": ["0", "1e-3*x", "0"],
            "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}}  # fmt: skip
    boundary = [
        {"body": "b", "face": "-x", "fixed": ["x", "y", "z"]},
        {"body": "b", "face": "+x", "traction": {"y": 1e-5}},
    ]
    run = {"integrator": "leapfrog", "formulation": form, "end": 1e6, "dt": 0.2, "guard": "off"}
    return wsph.Scene(schema=1, dim=3, run=run | {"threads": threads}, bodies=[block | body], boundary=boundary)


def visits(system: Any) -> float:
    """The pairs that a process visits in a right-hand side, in those of rows of a grid; of particles that are their own
    points how many it works on."""
    rates = system.rates
    if system.formulation == "updated-lagrangian":
        near = rates.near
        return ((near.own.stop - near.own.start) + 2.0 * (near.stress.stop - near.stress.start)) / 3.0
    if system.formulation == "total-lagrangian":
        return float(system.count)
    many, boxes = np.diff(system.geometry.rows.offsets).astype(float), system.geometry.boxes
    if boxes is not None:
        many[boxes.others(len(many))] *= LISTED
    return 2.0 * float(many.sum())


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


def uneven(domain: Domain, mine: float) -> float:
    """The largest of the numbers of all processes over their mean."""
    every = domain.joined(np.array([mine]))
    return float(every.max() / every.mean())


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--form", default="stress-points")
    parser.add_argument("--cells", type=int, default=46)
    parser.add_argument("--weak", action="store_true")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--set-up", action="store_true")
    parser.add_argument("--shape", choices=SHAPES)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.quiet = True
    domain, waiting = world.domain(), Waiting()
    small = 15 + 2 * domain.size
    compose(scene(small, small, 1, options.form), domain).compile()  # kernels, and what every run has
    empty, started = peak(), time.perf_counter()
    along = options.cells * (domain.size if options.weak else 1)
    shape = SHAPES[options.shape](float(options.cells)) if options.shape else {}
    made = compose(scene(options.cells, along, options.threads, options.form, **shape), domain)
    made.compile()
    system = made.bodies[0].system
    row = {"processes": domain.size, "threads": options.threads, "particles": made.particles, "weak": options.weak,
           "held": int(domain.max(np.array(system.share.held))), "set_up_seconds": time.perf_counter() - started,
           "set_up_bytes": float(domain.max(np.array(peak() - empty)))}  # fmt: skip
    row["visits"] = uneven(domain, visits(system))
    if not options.set_up:
        made.program.run(3)
        own, cpus, walls, end = [], [], [], time.perf_counter() + options.seconds
        while domain.told(lambda: time.perf_counter() < end):
            clock = time.process_time if options.threads > 1 else time.thread_time
            cpu, wall, waited = clock(), time.perf_counter(), waiting.seconds
            made.program.run(5)
            spent = clock() - cpu - (waiting.seconds - waited)
            own.append(spent)
            cpus.append(float(domain.max(np.array(spent))) / 5)
            walls.append(float(domain.max(np.array(time.perf_counter() - wall))) / 5)
        row["cpu"] = uneven(domain, float(np.median(own)))
        row |= {"cpu_us": 1e6 * min(cpus), "wall_us": 1e6 * min(walls), "slices": len(cpus)}
        row |= {"cpu_mean_us": 1e6 * float(np.mean(cpus)), "cpu_median_us": 1e6 * float(np.median(cpus))}
    if domain.rank == 0:
        print(json.dumps({k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()}), flush=True)


if __name__ == "__main__":
    main()
