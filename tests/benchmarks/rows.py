"""Time of a step of one form of a body: CPU nanoseconds a particle-step of one thread, and bytes a particle.

    python tests/benchmarks/rows.py [--dim 3] [--cells 48] [--form elastic] [--precision f64] [--threads 1] [--lists]
    python tests/benchmarks/rows.py --turns 3 [--form NAME ...]

With --lists a body whose rows follow from its lattice has lists of pairs all the same. With --turns forms are timed in
processes of their own, rows of the lattice and lists in turns, and the smallest time of each side is printed.

A block of `cells` along every edge, held at one face and set moving. It uses what the package gives publicly, so that a
checkout of another commit can be timed by the same file: put its root first on PYTHONPATH, alternate the two in short runs
and compare the smallest times. CPU time of a thread is what other processes on the machine disturb least.
"""

import argparse
import json
import subprocess
import sys
import time
import warnings
from typing import Any

import numpy as np
import warp as wp

import wsph

try:
    from wsph.simulation.compose import compose
except ModuleNotFoundError:  # before the package had rooms
    from wsph.composition import compose  # pyright: ignore[reportMissingImports]

ELASTIC = {"model": "elastic", "density": 1000.0, "youngs_modulus": 1e6, "poisson_ratio": 0.3}
PARTS = {"residual": 0.15, "hourglass": {"coefficient": 0.1}, "viscosity": {"alpha": 0.06, "kind": "approach"}}
ONE_SET = {"formulation": "total-lagrangian"}
TWO_SETS = {"integrator": "tsph", "formulation": "small-strain"}
MISES = {"model": "mises", "yield_stress": 1e3, "hardening_modulus": 1e4}
PERZYNA = {"model": "perzyna", "yield_stress": 1e3, "hardening_modulus": 1e4, "fluidity": 1.0, "exponent": 1.0}
FORMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "elastic": ({}, {}),
    "initial stress": ({"initial": {"stress": {"xx": "1e2*x"}}}, {}),
    "neo-hookean": ({"material": ELASTIC | {"model": "neo-hookean"}}, {}),
    "mises": ({"material": ELASTIC | MISES}, {}),
    "viscosity": ({"viscosity": {"alpha": 0.06}}, {}),
    "phase field": ({"phase_field": {"fracture_energy": 1e3, "length": 0.05}}, {}),
    "tsph": ({}, TWO_SETS),
    "tsph, perzyna": ({"material": ELASTIC | PERZYNA}, TWO_SETS),
    "one set": ({}, ONE_SET),
    "one set, jaumann": ({"material": ELASTIC | {"model": "jaumann"}}, ONE_SET),
    "one set, mises": ({"material": ELASTIC | MISES}, ONE_SET),
    "one set, perzyna": ({"material": ELASTIC | PERZYNA}, ONE_SET),
    "one set, volumes of blocks": ({"material": ELASTIC | {"poisson_ratio": 0.47}}, ONE_SET),
    "one set, neo-hookean with volumes of blocks": (
        {"material": ELASTIC | {"model": "neo-hookean", "poisson_ratio": 0.47}},
        ONE_SET,
    ),
    "one set, jaumann with volumes of blocks": (
        {"material": ELASTIC | {"model": "jaumann", "poisson_ratio": 0.47}},
        ONE_SET,
    ),
    "one set, initial stress": ({"initial": {"stress": {"xx": "1e2*x"}}}, ONE_SET),
    "one set, hourglass and viscosity": (
        {"hourglass": {"coefficient": 0.1}, "viscosity": {"alpha": 0.06}, "residual": False},
        ONE_SET,
    ),
}
"""Keys of the body and of the run, by the names of forms."""


def composed(dim: int, cells: int, form: str, precision: str, threads: int) -> Any:
    """The composition of a block."""
    body_keys, run_keys = FORMS[form]
    body = {
        "name": "b",
        "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim},
        "spacing": 1.0 / cells,
        "velocity": ["0", "1e-2*sin(3*x)", "1e-2*x*y"][:dim],
        "material": ELASTIC,
    } | body_keys
    if dim < 3:
        body["state"] = "strain"
    run = {
        "integrator": "leapfrog",
        "end": 10.0,
        "cfl": 0.4,
        "guard": "off",
        "device": "cpu",
        "threads": threads,
        "precision": precision,
    } | run_keys
    held = {"body": "b", "where": f"x < {0.6 / cells!r}", "fixed": list("xyz"[:dim])}
    made = compose(wsph.Scene(schema=1, dim=dim, run=run, bodies=[body], boundary=[held]))
    made.compile()
    made.program.run(3)
    return made


def lists_alone() -> None:
    """Have bodies go by lists of pairs, whatever their cells are."""
    from wsph.formulations.lattice import rates
    from wsph.formulations.lattice.edges import rates as edge_rates
    from wsph.formulations.taylor import operators

    for each in (rates, edge_rates):
        each.boxes_of = lambda host: None
    operators.FEWEST = dict.fromkeys(operators.FEWEST, 10**9)


def in_turns(options: argparse.Namespace) -> None:
    """Print a line for every form: the smallest times of rows of the lattice and of lists."""
    for form in options.form:
        given = ["--dim", options.dim, "--cells", options.cells, "--precision", options.precision]
        command = [sys.executable, __file__, *map(str, given), "--seconds", str(options.seconds), "--form", form]
        found: list[list[dict[str, Any]]] = [[], []]
        for turn in range(2 * options.turns):
            more = ["--lists"] * (turn % 2)
            told = subprocess.run([*command, *more], check=True, capture_output=True, text=True).stdout
            found[turn % 2].append(json.loads(told.splitlines()[0]))
        rows, lists = (min(side, key=lambda each: each["ns"]) for side in found)
        print(
            f"{form}, {options.dim}D {options.precision}, {rows['particles']} particles: {rows['ns']:g} ns a particle-step"
            f" and {rows['bytes']} bytes a particle, by lists {lists['ns']:g} and {lists['bytes']}:"
            f" {lists['ns'] / rows['ns']:.2f} times",
            flush=True,
        )


def main() -> None:
    """Print one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dim", type=int, default=3)
    parser.add_argument("--cells", type=int, default=48)
    parser.add_argument("--form", choices=FORMS, nargs="+", default=["elastic"], metavar="NAME")
    parser.add_argument("--precision", default="f64")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--launches", action="store_true", help="the time of every launch of a step too")
    parser.add_argument("--lists", action="store_true", help="by lists of pairs")
    parser.add_argument("--turns", type=int, default=0, help="both ways in so many turns")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.turns:
        in_turns(options)
        return
    if options.lists:
        lists_alone()
    (options.form,) = options.form
    began = time.perf_counter()
    made = composed(options.dim, options.cells, options.form, options.precision, options.threads)
    ready = time.perf_counter() - began
    count, times = made.particles, []
    steps = max(round(0.05 / (count * 1e-7)), 1)
    wall, started = [], time.perf_counter()
    while time.perf_counter() - started < options.seconds:
        before, ticked = time.process_time(), time.perf_counter()
        made.program.run(steps)
        times.append((time.process_time() - before) / steps / count)
        wall.append((time.perf_counter() - ticked) / steps / count)
    system = made.bodies[0].system
    found: dict[str, Any] = {
        "form": options.form, "dim": options.dim, "precision": options.precision, "particles": count,
        "ns": round(1e9 * min(times), 1), "wall_ns": round(1e9 * min(wall), 1), "bytes": round(system.nbytes / count),
        "ready_s": round(ready, 1), "check": float(np.abs(system.state.read("velocity")).max()),
    }  # fmt: skip
    print(json.dumps(found), flush=True)
    if options.launches:
        program = made.program
        step = program.step if hasattr(program, "step") else program._step
        for launch in program._clock.launches(step):
            best = np.inf
            for _ in range(20):
                ticked = time.process_time()
                launch.run()
                best = min(best, time.process_time() - ticked)
            print(f"{1e9 * best / count:8.2f} ns  {launch.kernel.func.__name__} x {launch.n}")
    wp.synchronize()


if __name__ == "__main__":
    main()
