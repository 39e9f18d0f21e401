"""Registers, spills and bytes of the kernels of bodies cut from a lattice on a GPU, compiled without one.

    python tests/kernels/lattice.py [--arch 90] [--json docs/lattice_cuda.json]

By dimension, precision and material, with a row a thread, as a GPU has them. What of the stack is spilled, and what arrays
that a kernel has, no listing tells apart: here both ought to be none. Needs what `registers.py` needs.
"""

import argparse
import itertools
import json
import sys
import tempfile
import warnings
from pathlib import Path

import warp as wp

sys.path.insert(0, str(Path(__file__).parent))
from cuda import compiled
from parts import block
from registers import uses
from seconds import BODIES

from wsph.formulations.lattice import block_rates
from wsph.simulation.compose import compose

PER_MULTIPROCESSOR, MOST_THREADS, STEP = 65536, 2048, 8
"""Registers of a multiprocessor of architectures 80 to 90, its threads, and in what steps a thread gets registers."""


def threads(registers: int, block_size: int = 256) -> int:
    """Threads that a multiprocessor holds of a kernel, in blocks."""
    each = -(-registers // STEP) * STEP * block_size
    return min(PER_MULTIPROCESSOR // each, MOST_THREADS // block_size) * block_size


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arch", type=int, default=90, help="compute capability, without its point")
    parser.add_argument("--json", type=Path, help="where the figures go")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.log_level = wp.LOG_WARNING
    block_rates.WIDTH.update(dict.fromkeys(block_rates.WIDTH, 1))  # rows a thread, of a body that is set up on a CPU
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as folder:
        for dim, precision, (name, keys) in itertools.product((2, 3), ("f64", "f32"), BODIES.items()):
            made = compose(block(dim=dim, form="stress-points", run={"precision": precision}, **keys))
            for module in dict.fromkeys(kernel.module for kernel in made.launches()):
                if error := compiled(module, options.arch, Path(folder)):
                    sys.exit(error)
                (binary,) = (Path(folder) / module.get_module_identifier()).glob(f"*.sm{options.arch}*.cubin")
                for use in uses(module.get_module_identifier(), binary, [name]):
                    rows.append({
                        "dim": dim, "precision": precision, "body": name, "kernel": use.kernel, "registers": use.registers,
                        "stack": use.stack, "loads": use.loads, "stores": use.stores, "threads": threads(use.registers),
                    })  # fmt: skip
                    print(" ".join(f"{value!s:>10}" for value in rows[-1].values()), flush=True)
    if options.json:
        options.json.write_text(json.dumps({"arch": options.arch, "rows": rows}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
