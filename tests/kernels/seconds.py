"""How long kernels take to compile: of bodies cut from a lattice, by dimension, precision and material.

    python tests/kernels/seconds.py [--longest 3] [--asked 2.0]

CPU seconds of the compiler for every module of a small block of stress points; the first composition is compiled before,
for the header that all share. Prints the longest of each composition, and ends with 1 where one takes longer than is asked.
"""

import argparse
import itertools
import sys
import tempfile
import time
import warnings
from pathlib import Path

import warp as wp

sys.path.insert(0, str(Path(__file__).parent))
from parts import YIELDING, block

from wsph.simulation.compose import compose

BODIES = {
    "elastic": {},
    "mises": {"material": {"model": "mises", **YIELDING}},
    "jaumann and viscosity": {"material": "jaumann", "body": {"viscosity": {"alpha": 0.5, "beta": 1.0}}},
    "phase field": {"body": {"phase_field": {"fracture_energy": 1e-3, "length": 0.25, "model": "AT2"}}},
}


def seconds(dim: int, precision: str, keys: dict) -> dict[str, float]:
    """CPU seconds that the kernels of a step and of the sums over the body take to compile, by their names."""
    made = compose(block(dim=dim, form="stress-points", run={"precision": precision}, **keys))
    kernels = made.launches() + [run.diagnostics.kernel(run.system.state) for run in made.bodies]
    found: dict[str, float] = {}
    for module in dict.fromkeys(kernel.module for kernel in kernels):
        with tempfile.TemporaryDirectory() as folder:
            before = time.process_time()
            wp.compile_aot_module(module, device="cpu", module_dir=folder)
            found[" and ".join(sorted(name.rsplit("__", 1)[-1] for name in module.kernels))] = (
                time.process_time() - before
            )
    return found


def main() -> int:
    """Print the longest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--longest", type=int, default=3)
    parser.add_argument("--asked", type=float, default=2.0, help="seconds")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.log_level = wp.LOG_WARNING
    worst = 0.0
    for precision in ("f64", "f32"):
        seconds(1, precision, {})
    for dim, precision, (name, keys) in itertools.product((1, 2, 3), ("f64", "f32"), BODIES.items()):
        found = sorted(seconds(dim, precision, keys).items(), key=lambda each: -each[1])
        worst = max(worst, found[0][1])
        words = ", ".join(f"{kernel} {value:.2f}" for kernel, value in found[: options.longest])
        print(
            f"{dim}D {precision} {name:<24} {len(found):2d} modules, {sum(v for _, v in found):5.1f} s: {words}",
            flush=True,
        )
    print(f"the longest takes {worst:.2f} s, of {options.asked:g} s")
    return int(worst > options.asked)


if __name__ == "__main__":
    sys.exit(main())
