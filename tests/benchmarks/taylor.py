"""Particle-steps per second of Taylor-SPH in 2D, and what the moving form costs over the one of small strain.

    python tests/benchmarks/taylor.py [--particles 40000 100000]

One core. The two forms alternate in one process; medians over the rounds. Run it on a quiet machine.
"""

import argparse
import json
import time

import numpy as np
import warp as wp

import wsph
from wsph.composition import Composition, compose

ROUNDS, SECONDS = 5, 1.0


def block(particles: int, integrator: str, material: str, precision: str) -> Composition:
    """A square of about `particles` nodes, compiled."""
    cells = round(particles**0.5) - 1
    body = {
        "name": "b", "shape": {"type": "box", "min": [0.0, 0.0], "max": [1.0, 1.0]}, "spacing": 1.0 / cells, "state": "strain",
        "velocity": ["1e-3*sin(pi*x)", "0"],
        "material": {"model": material, "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3},
    }  # fmt: skip
    scene = wsph.Scene(
        schema=1, dim=2, run={"integrator": integrator, "end": 1.0, "cfl": 0.8, "precision": precision}, bodies=[body]
    )
    composition = compose(scene)
    composition.compile()
    composition.program.run(2)
    return composition


def rate(composition: Composition) -> float:
    """Particle-steps per second of CPU time."""
    steps, started = 0, time.process_time()
    while time.process_time() - started < SECONDS:
        composition.program.run(5)
        wp.synchronize_device(composition.device)
        steps += 5
    return composition.particles * steps / (time.process_time() - started)


def main() -> None:
    """Measure and print one JSON line a size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, nargs="+", default=[40_000, 100_000])
    parser.add_argument("--precision", choices=["f64", "f32"], default="f64")
    options = parser.parse_args()
    for particles in options.particles:
        small = block(particles, "tsph", "elastic", options.precision)
        moving = block(particles, "ul-tsph", "jaumann", options.precision)
        rates = np.array([[rate(small), rate(moving)] for _ in range(ROUNDS)])
        print(json.dumps({
            "particles": small.particles, "precision": options.precision,
            "tsph": float(np.median(rates[:, 0])), "ul_tsph": float(np.median(rates[:, 1])),
            "cost_of_moving": float(np.median(rates[:, 0] / rates[:, 1])),
        }))  # fmt: skip


if __name__ == "__main__":
    main()
