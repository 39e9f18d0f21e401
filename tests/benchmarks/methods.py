"""What a step of every method costs, and how much of it is not its right-hand sides.

    python tests/benchmarks/methods.py [--cells 46] [--write]

An elastic cube that vibrates, f64, one core: Taylor-SPH, and the one-set integrators on the bare total-Lagrangian form with
a support of 2.6 spacings (`rkc` with the viscosity that it needs). Launches are timed one by one, the best of all steps;
those that a right-hand side makes are told from the others, which advance, hold, record work and tell the time. --write
leaves docs/methods.json for docs/make.py.
"""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import wsph
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

ROOT, STEPS = Path(__file__).resolve().parents[2], 12
TWO_SETS = ("tsph", "ul-tsph")
ONE_SET = ("leapfrog", "lf4", "blanes-moan4", "euler", "rk2", "pc2", "rk4", "kg4-8", "w20-2-8", "rkc")


def cube(cells: int, integrator: str) -> Composition:
    """The scene of a method, compiled."""
    body: dict[str, Any] = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [1.0] * 3}, "spacing": 1.0 / cells,
                            "velocity": ["1e-3*sin(3*y)", "1e-3*cos(2*x)", "0"],
                            "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}}  # fmt: skip
    run: dict[str, Any] = {"integrator": integrator, "end": 1e3, "cfl": 0.3, "guard": "off", "threads": 1}
    if integrator in ONE_SET:
        run |= {"formulation": "total-lagrangian", "support": 2.6}
        body["residual"] = False
    else:
        body["material"]["model"] = "jaumann" if integrator == "ul-tsph" else "elastic"
    if integrator == "rkc":
        run["integrator"] = {"name": "rkc", "stages": 5}
        body["viscosity"] = {"alpha": 2.5, "kind": "pair"}
    composition = compose(wsph.Scene(schema=1, dim=3, run=run, bodies=[body]))
    composition.compile()
    return composition


def measure(composition: Composition) -> dict[str, float]:
    """Microseconds per particle of a step, of a right-hand side, and what is not right-hand sides."""
    body, clock = composition.bodies[0], composition.clock
    inside, launches, rates = 0, [], []

    def counted(method: Any) -> Any:
        def call(*args: Any, **keys: Any) -> Any:
            nonlocal inside
            inside += 1
            try:
                return method(*args, **keys)
            finally:
                inside -= 1

        return call

    for name in ("rate", "half_step"):
        if hasattr(body.system, name):
            setattr(body.system, name, counted(getattr(body.system, name)))

    launch = clock.launch

    def timed(*asked: Any) -> None:
        started = time.perf_counter()
        launch(*asked)
        launches[-1].append(time.perf_counter() - started)
        rates.append(bool(inside))

    clock.launch = timed
    for _ in range(STEPS):
        launches.append([])
        rates.clear()
        composition.program.step()
    best = [min(each) for each in zip(*launches, strict=True)]
    per = 1e6 / composition.particles
    step, rhs = sum(best), sum(t for t, is_rate in zip(best, rates, strict=True) if is_rate)
    evaluations = body.integrator.evaluations
    return {
        "particles": composition.particles,
        "evaluations": evaluations,
        "step_us": step * per,
        "rhs_us": rhs * per / evaluations,
        "overhead": (step - rhs) / rhs,
    }


def main() -> None:
    """Measure, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=46)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    found = {}
    for name in (*TWO_SETS, *ONE_SET):
        found[name] = measure(cube(options.cells, name))
        print(f"{name:14}", {k: round(v, 4) for k, v in found[name].items()}, flush=True)
    if options.write:
        (ROOT / "docs" / "methods.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
