"""Bytes and time of a particle-step of bodies cut from a lattice, beside what the memory of the same machine gives.

    python tests/benchmarks/roofline.py [--cells 48 340] [--seconds 2] [--json docs/roofline.json]

A block of stress points, elastic, mises, viscous and with a phase field, in 2D and 3D, both precisions, with one core and
two. `counted`: the numbers that the kernels of a step read and write, each once, those that cells hand to nodes twice;
where rows of pairs take part nothing is counted. `touched`: the pages of the body's arrays that each kernel has touched,
which Linux notes, over all kernels of a step. The memory's rate is that of a + b = c over arrays beyond the caches, of as
many cores, measured beside every row; what it would move in the time of a step is a row's `moved`. Times of one core are
CPU times, which other processes disturb least; those of several are of the clock, and want a quiet machine.
"""

import argparse
import itertools
import json
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from rows import composed

FORMS = ("elastic", "mises", "viscosity", "phase field")
HUGE = 2**23
"""Numbers of an array of the memory's test."""


def triad(threads: int, seconds: float = 0.3) -> float:
    """Bytes a second of sums of arrays, by so many threads."""
    arrays = [[np.ones(HUGE) for _ in range(3)] for _ in range(threads)]
    # By the clock: the time that a thread has had is told by ticks, which such sums end between.
    best, now = 0.0, time.perf_counter
    ends = time.perf_counter() + seconds
    while time.perf_counter() < ends:
        team = [threading.Thread(target=np.add, args=(a, b, c)) for a, b, c in arrays]
        started = now()
        for each in team:
            each.start()
        for each in team:
            each.join()
        best = max(best, threads * 24.0 * HUGE / (now() - started))
    return best


def _pages(places: set[int]) -> int:
    """Bytes of the pages that have been touched since they were last forgotten, of mappings with some places in them."""
    found, within = 0, False
    for line in Path("/proc/self/smaps").read_text().splitlines():
        word = line.split()[0]
        if "-" in word and not word.endswith(":"):
            low, high = (int(each, 16) for each in word.split("-"))
            within = any(low <= place < high for place in places)
        elif within and word == "Referenced:":
            found += 1024 * int(line.split()[1])
    return found


def touched(made: Any) -> float:
    """Bytes of the pages that the kernels of a step touch, kernel by kernel."""
    known = made.bodies[0].system.arrays._known.values()
    places = {each.array.ptr for each in known if each.array.capacity > 2**16}
    launches: dict[str, list[Any]] = {}
    for launch in made.program._clock.launches(made.program.step):
        launches.setdefault(launch.kernel.func.__name__, []).append(launch)
    found = 0.0
    for own in launches.values():
        Path("/proc/self/clear_refs").write_text("1")
        nothing = _pages(places)
        for launch in own:
            launch.run()
        found += max(_pages(places) - nothing, 0)
    return found


def counted(made: Any) -> float | None:
    """Bytes that the kernels of a step read and write; None where there are others than those of the lattice."""
    body = made.bodies[0]
    system, space = body.system, made.space
    n, d, size = system.count, space.dim, np.dtype(space.numpy).itemsize
    w = body.constitutive.width
    k = len(body.constitutive.internals)
    drags, q = system.form.rate_term is not None, d**2 + (d + 1) * system.form.stabilised
    numbers = {
        "answer": d + q,
        "strain": d + w + k + q + d**2,
        "flow": d + d**2 + 2 * (w + k),
        "drag": 2 * d + d**2,
        "force": q + 2 * d + 1 + drags * (d**2 + d) + d * (system.loads.count > 1),
        "drift": 2 * d,
        "bring_back": 2 * (w + k),
        "fade": k + 2,
    }
    total, seen = 0.0, set[str]()
    for launch in made.program._clock.launches(made.program.step):
        name = launch.kernel.func.__name__
        if name == "combine":
            coefficients, span = launch.inputs[:2]
            total += (np.count_nonzero(list(coefficients)) + 1) * (span.end - span.start) * size
        elif name in numbers:
            total += numbers[name] * n * size * (name not in seen)  # the pieces of a body are many launches
            seen.add(name)
        elif launch.n > n // 2:
            return None
    return total if system.regular == 1.0 and {"answer", "flow"} & seen else None


def measured(dim: int, cells: int, form: str, precision: str, threads: int, seconds: float) -> dict[str, Any]:
    """A row."""
    made = composed(dim, cells, form, precision, threads)
    n = made.particles
    steps = max(round(0.05 / (n * 1e-7)), 1)
    best, rate, now = np.inf, 0.0, time.process_time if threads == 1 else time.perf_counter
    ends = time.perf_counter() + seconds
    while time.perf_counter() < ends:
        rate = max(rate, triad(threads, 0.2))
        before = now()
        made.program.run(steps)
        best = min(best, (now() - before) / steps / n)
    bytes_counted = counted(made)
    return {
        "form": form, "dim": dim, "precision": precision, "threads": threads, "particles": n,
        "ns": round(1e9 * best, 2), "kept": round(made.bodies[0].system.nbytes / n, 1),
        "counted": None if bytes_counted is None else round(bytes_counted / n, 1), "touched": round(touched(made) / n, 1),
        "triad": round(rate / 1e9, 2), "moved": round(best * rate, 1),
    }  # fmt: skip


def main() -> None:
    """Print one line of JSON a row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs=2, default=[48, 340], help="along an edge, in 3D and in 2D")
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--forms", nargs="+", default=list(FORMS))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = []
    for dim, form, precision, threads in itertools.product((2, 3), options.forms, ("f64", "f32"), options.threads):
        cells = options.cells[0] if dim == 3 else options.cells[1]
        rows.append(measured(dim, cells, form, precision, threads, options.seconds))
        print(json.dumps(rows[-1]), flush=True)
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
