"""What the finite check, the energy stop and the ledger cost: the time of a check over that of the steps between two.

python tests/benchmarks/guards.py
"""

import statistics
import time
from pathlib import Path

import wsph
from wsph.simulation.compose import compose
from wsph.simulation.probing.recorder import RING
from wsph.simulation.run import CHECK_STEPS, Running

ROOT = Path(__file__).resolve().parents[2]


def block(cells: int, formulation: str) -> wsph.Scene:
    """A cube that vibrates."""
    body = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [1.0] * 3}, "spacing": 1.0 / cells,
            "velocity": ["1e-3*sin(3*y)", "1e-3*cos(2*x)", "0"], "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}}  # fmt: skip
    run = {"integrator": "leapfrog", "formulation": formulation, "end": 1e3, "cfl": 0.3}
    return wsph.Scene(schema=1, dim=3, run=run, bodies=[body])


def main() -> None:
    """Print what a check takes of the steps between two of them."""
    cases = [("100-particle bar", wsph.load(ROOT / "examples" / "shock_bar.toml"), RING)]
    cases += [(f"cube, {form}", block(45, form), CHECK_STEPS) for form in ("total-lagrangian", "stress-points")]
    for name, scene, between in cases:
        composition = compose(scene)
        composition.compile()
        simulation = Running(composition, None, time.perf_counter())
        composition.program.prepare(between)
        composition.program.run(between)
        simulation.check(0)
        shares = []
        for _ in range(5):
            started = time.perf_counter()
            composition.program.run(between)
            middle = time.perf_counter()
            simulation.check(between)
            shares.append((time.perf_counter() - middle) / (middle - started))
        print(
            f"{name}, {composition.particles} particles: a check every {between} steps takes {100 * statistics.median(shares):.2f} % of them"
        )


if __name__ == "__main__":
    main()
