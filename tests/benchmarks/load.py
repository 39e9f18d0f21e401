"""What size costs: time of a step and memory per particle from 20 thousand particles to a million, and whether the last step
is as fast as the first.

    python tests/benchmarks/load.py [--rows 12 20 36 46]

A 3D block, total-Lagrangian, bare, f64, all cores. Bytes are those that the composition counts and that `wsph check`
prints, on the device (here memory too) and on the host, beside what the process has grown by. Each size is a process of
its own.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))


def resident() -> int:
    """Bytes that the process holds now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def one(rows: int) -> dict[str, float]:
    """Measure one size."""
    from peers import block

    block(3, 3, "bare", threads=0)  # compiled and loaded before memory is looked at
    before = resident()
    composition = block(3, rows, "bare", threads=0)
    n = composition.particles
    steps = max(int(2e6 / n), 3)
    seconds = []
    for _ in range(11):
        started = time.perf_counter()
        composition.program.run(steps)
        seconds.append((time.perf_counter() - started) / steps)
    return {
        "particles": n,
        "microseconds": 1e6 * statistics.median(seconds) / n,
        "last_over_first": statistics.median(seconds[-5:]) / statistics.median(seconds[:5]),
        "bytes_device": composition.bodies[0].system.nbytes / n,
        "bytes_host": composition.bodies[0].system.host_bytes / n,
        "bytes_grown": (resident() - before) / n,
    }


def main() -> None:
    """Print every size and the exponent of the growth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[12, 20, 36, 46])
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.one)))
        return
    found = []
    for rows in options.rows:
        done = subprocess.run(
            [sys.executable, __file__, "--one", str(rows)], check=True, capture_output=True, text=True
        )
        found.append(json.loads(done.stdout.splitlines()[-1]))
        print(json.dumps(found[-1]), flush=True)
    n, t = (np.log([f[key] for f in found]) for key in ("particles", "microseconds"))
    print(f"cost of a step ~ N^{1.0 + np.polyfit(n, t, 1)[0]:.3f}")


if __name__ == "__main__":
    main()
