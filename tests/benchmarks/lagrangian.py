"""Particle-steps per second of leapfrog on a 3D cantilever block, total-Lagrangian and stress points, on one core.

python tests/benchmarks/lagrangian.py [--rows 16 26] [--precision f64]
"""

import argparse
import json
import time

import numpy as np
import warp as wp

import wsph
from wsph.composition import compose

ROUNDS, SECONDS = 3, 1.5


def main() -> None:
    """Measure and print one JSON line a case; the two forms alternate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[12, 20])
    parser.add_argument("--precision", choices=["f64", "f32"], default="f64")
    options = parser.parse_args()
    for rows in options.rows:
        made = {}
        for name, keys in {
            "total-lagrangian, bare": {"formulation": "total-lagrangian", "residual": False},
            "total-lagrangian, residual": {"formulation": "total-lagrangian"},
            "total-lagrangian, viscosity": {
                "formulation": "total-lagrangian",
                "residual": False,
                "viscosity": {"alpha": 0.5, "beta": 0.5},
            },
            "stress-points": {"formulation": "stress-points"},
        }.items():
            formulation = keys.pop("formulation")
            body = {
                "name": "b", "shape": {"type": "box", "min": [0.0, 0.0, 0.0], "max": [4.0, 1.0, 1.0]}, "spacing": 1.0 / rows,
                "velocity": ["0", "1e-3*x", "0"], "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3},
                **keys,
            }  # fmt: skip
            run = {
                "integrator": "leapfrog",
                "formulation": formulation,
                "end": 1.0,
                "cfl": 0.2,
                "precision": options.precision,
                "guard": "off",
            }
            hold = {"body": "b", "face": "-x", "fixed": ["x", "y", "z"]}
            composition = compose(wsph.Scene(schema=1, dim=3, run=run, bodies=[body], boundary=[hold]))
            composition.compile()
            composition.program.run(2)
            made[name] = composition
        rates: dict[str, list[float]] = {name: [] for name in made}
        for _ in range(ROUNDS):
            for name, composition in made.items():
                steps, started = 0, time.process_time()
                while time.process_time() - started < SECONDS:
                    composition.program.run(2)
                    wp.synchronize_device(composition.device)
                    steps += 2
                rates[name].append(composition.particles * steps / (time.process_time() - started))
        for name, composition in made.items():
            system = composition.bodies[0].system
            print(json.dumps({
                "form": name, "particles": composition.particles, "precision": options.precision,
                "pairs_per_particle": round(system.pairs / system.count, 1), "bytes_per_particle": round(system.nbytes / system.count),
                "particle_steps_per_second": float(np.median(rates[name])),
            }))  # fmt: skip


if __name__ == "__main__":
    main()
