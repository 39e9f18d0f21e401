"""What setting a scene up takes of memory: the peak of every process above that of an empty run, beside its share.

    mpiexec -n N python tests/benchmarks/set_up.py [bodies | contact | jitter | map] [--particles 1000000]

`bodies`, two boxes of that many particles each that have nothing to do with each other, one on the other; `contact`, the
same two that touch; `jitter` and `map`, one box that breaks by a phase field, whose cells differ. Prints a line of JSON:
bytes of every process, after an empty run (a small scene of the same kind, composed and compiled), and when the scene is
ready to run what it holds of it. The share of a process is what one process takes over their number.
"""

import argparse
import gc
import json
import resource
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

import wsph
from wsph.ranks import world
from wsph.simulation.compose import compose

CONTACT = {"contact": [{"name": "touch", "between": ["b", "c"], "stiffness": 1.0}]}
CRACKS: dict[str, Any] = {"phase_field": {"fracture_energy": 1e-3, "length": 3.0}}
DIFFER = {"jitter": {"jitter": 0.1}, "map": {"map": ["x + 0.2*sin(0.3*y)", "y*(1 + 0.0002*x)", "z"]}}


def scene(kind: str, cells: int) -> wsph.Scene:
    """Boxes of so many cells along every axis."""
    material = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}
    size = float(cells)
    body = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [size] * 3}, "spacing": 1.0,
            "material": material, **(CRACKS | DIFFER[kind] if kind in DIFFER else {})}  # fmt: skip
    bodies = [body]
    if kind not in DIFFER:
        above = {"type": "box", "min": [0.0, size, 0.0], "max": [size, 2.0 * size, size]}
        bodies.append({**body, "name": "c", "shape": above, "velocity": [0.0, -1e-3, 0.0]})
    run = {
        "integrator": "leapfrog",
        "formulation": "stress-points",
        "end": 1e6,
        "dt": 0.2,
        "guard": "off",
        "threads": 1,
    }
    return wsph.Scene(schema=1, dim=3, run=run, bodies=bodies, **(CONTACT if kind == "contact" else {}))


def peak() -> int:
    """The most memory that the process has had so far [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def now() -> int:
    """What it has now [bytes]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", nargs="?", default="contact", choices=["bodies", "contact", *DIFFER])
    parser.add_argument("--particles", type=int, default=1_000_000)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.quiet = True
    domain = world.domain()
    compose(scene(options.kind, 15 + domain.size), domain).compile()  # kernels, and what every run has
    empty, started = peak(), time.perf_counter()
    made = compose(scene(options.kind, round(options.particles ** (1 / 3)) - 1), domain)
    made.compile()
    taken = domain.joined(np.array([[peak() - empty, now() - empty]]))
    if domain.rank == 0:
        row = {"scene": options.kind, "processes": domain.size, "particles": made.particles,
               "seconds": round(time.perf_counter() - started, 1), "peak_MB": (taken[:, 0] // 10**6).tolist(),
               "holds_MB": (taken[:, 1] // 10**6).tolist()}  # fmt: skip
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
