"""Total-Lagrangian leapfrog on the cantilever of beam.py beside LAMMPS, PySPH and C, one core each.

    python tests/benchmarks/peers.py [--sizes 3:12 3:21 3:37 2:97] [--lammps PYTHON] [--pysph PYTHON] [--million] [--write]

A size is dimensions:rows. Ours is timed with LAMMPS's own parts (hourglass control and viscosity), with LAMMPS's pairs and
with those of the edges of cells, which the form has by default; with LAMMPS's pairs also with viscosity alone, on
approaching or on all pairs (pair damping), with the residual, bare, bare with its root moved by an expression; and in the
default form (stress points). Both with LAMMPS's parts, the bare and the default also on all cores, beside as many
independent copies, a core each, which say what the machine's cores are worth together just then: cores that are shared
with others are not always worth their number. The C loops (`reference.c`, -O3 -march=native -ffast-math) have our data: the
same pairs, stored W'/r and order; they do the two loops over pairs and no more, beside our kernels of the two, in both
precisions.

Sides alternate, rounds over; medians of ratios. A particle-step is one particle through one step: leapfrog evaluates its
forces once in it, PySPH's integrator twice. --write leaves docs/peers.json, where what was not asked for stays, and
makes the README's table and docs/peers.png of it.
"""

import argparse
import ctypes
import json
import platform
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import warp as wp

import wsph
from wsph.backend.threads import cores, keep_to
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

sys.path.insert(0, str(Path(__file__).resolve().parent))
import beam

HERE, ROOT = Path(__file__).resolve().parent, Path(__file__).resolve().parents[2]
ROUNDS, SECONDS, COURANT = 3, 2.0, 0.3
SLICES, SLICE_SECONDS = 15, 0.7
VISCOSITY = {"alpha": 0.06, "kind": "approach"}
HELD = {"residual": False, "hourglass": {"coefficient": 0.1}, "viscosity": VISCOSITY}
EDGES = "edges, hourglass and viscosity"
PARTS = {
    "hourglass and viscosity": HELD,
    EDGES: HELD,
    "pair damping": {"residual": False, "viscosity": {**VISCOSITY, "kind": "pair"}},
    "viscosity": {"residual": False, "viscosity": VISCOSITY},
    "residual": {},
    "bare": {"residual": False},
    "bare, root moved": {"residual": False},
    "stress points": {},
}
ON_ALL_CORES = ("hourglass and viscosity", EDGES, "bare", "stress points")
C_FLAGS = ["-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512", "-shared", "-fPIC"]


def block(dim: int, rows: int, form: str, threads: int = 1, precision: str = "f64") -> Composition:
    """Ours, compiled and with its launches recorded."""
    edge = beam.WIDTH / rows
    far = [(10 * rows + beam.HELD) * edge, *[beam.WIDTH] * (dim - 1)]
    body = {"name": "b", "shape": {"type": "box", "min": [0.0] * dim, "max": far}, "spacing": edge,
            "velocity": ["0", "x", "0"][:dim], "material": beam.material(), **PARTS[form]}  # fmt: skip
    if dim == 2:
        body["state"] = "strain"
    run = {"integrator": "leapfrog", "end": 1.0, "cfl": COURANT, "guard": "off", "threads": threads, "precision": precision,
           "support": beam.SUPPORT, "formulation": "total-lagrangian"}  # fmt: skip
    if form in ("stress points", EDGES):
        del run["support"]
    if form == "stress points":
        del run["formulation"]
    root: dict[str, object] = {"body": "b", "where": f"x < {(beam.HELD + 0.01) * edge!r}"}
    root |= {"velocity": {"y": "1e-3*sin(50*t)"}} if "moved" in form else {"fixed": list("xyz"[:dim])}
    composition = compose(wsph.Scene(schema=1, dim=dim, run=run, bodies=[body], boundary=[root]))
    composition.compile()
    composition.program.run(3)
    return composition


def rate(composition: Composition, seconds: float = SECONDS) -> float:
    """Particle-steps per second of wall time. A run whose thread had less than 0.9 of its core is repeated, up to five
    times; the one that had most of it counts."""
    best, at_once = (0.0, 0.0), max(round(4e5 / composition.particles), 2)
    for _ in range(5):
        steps, started, cpu = 0, time.perf_counter(), time.thread_time()
        while time.perf_counter() - started < seconds:
            composition.program.run(at_once)
            wp.synchronize_device(composition.device)
            steps += at_once
        wall = time.perf_counter() - started
        share = (time.thread_time() - cpu) / wall
        best = max(best, (share, composition.particles * steps / wall))
        if share > 0.9:
            break
    return best[1]


def together(copies: list[Composition], seconds: float) -> float:
    """Particle-steps per second of independent runs at the same time, each on a core of its own."""

    available = cores()

    def one(number: int) -> float:
        keep_to({available[number]})
        return rate(copies[number], seconds)

    with ThreadPoolExecutor(len(copies)) as pool:
        return sum(pool.map(one, range(len(copies))))


def worth_of_cores(dim: int, rows: int, form: str, single: Composition) -> dict[str, float]:
    """What all cores do together over what one does, and what independent copies do: medians of alternating slices; `best`
    is the best slice of all cores over the best of one."""
    every, count = block(dim, rows, form, threads=0), len(cores())
    copies = [single, *(block(dim, rows, form) for _ in range(count - 1))]
    found = np.array([
        (rate(single, SLICE_SECONDS), rate(every, SLICE_SECONDS), together(copies, SLICE_SECONDS)) for _ in range(SLICES)
    ])  # fmt: skip
    alone, shared, apart = found.T
    return {"ratio": float(np.median(shared / alone)), "best": float(shared.max() / alone.max()),
            "of_copies": float(np.median(apart / alone))}  # fmt: skip


def reference(composition: Composition) -> dict[str, float]:
    """Microseconds per particle of the two loops over pairs in C and of our two kernels, on the same arrays."""
    system = composition.bodies[0].system
    real, number = ("double", np.float64) if system.space.scalar is wp.float64 else ("float", np.float32)
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "reference.so"
        subprocess.run(["gcc", f"-DREAL={real}", *C_FLAGS, str(HERE / "reference.c"), "-o", str(library)], check=True)
        loops = ctypes.CDLL(str(library))
    names = {"offsets": "pairs.offsets", "indices": "pairs.indices"}
    names |= {name: name for name in ("weight", "node", "moment", "corrected")}
    arrays = {key: system.arrays[f"rates.{name}"] for key, name in names.items()}
    arrays["u"] = system.state.struct.displacement
    n = system.count
    out = {"gradient": np.zeros((n, 9), number), "force": np.zeros((n, 3), number)}
    pointers = {k: ctypes.c_void_p(a.ptr) for k, a in arrays.items()} | {
        k: a.ctypes.data_as(ctypes.c_void_p) for k, a in out.items()
    }
    state, scratch = system.state, system.new()

    def in_c() -> None:
        loops.gradients(n, *(pointers[k] for k in ("offsets", "indices", "weight", "node", "u", "moment", "gradient")))
        loops.forces(n, *(pointers[k] for k in ("offsets", "indices", "weight", "node", "corrected", "force")))

    def ours() -> None:
        system.rate(state, scratch, "velocity")

    best = {}
    for _ in range(8 * ROUNDS + 1):
        for name, call in (("c", in_c), ("ours", ours)):
            started = time.perf_counter()
            call()
            best[name] = min(best.get(name, np.inf), time.perf_counter() - started)
    H = system.state.read("deformation").reshape(n, 9)
    if np.abs(out["gradient"] - H).max() > (1e-9 if number is np.float64 else 1e-4) * np.abs(H).max() + 1e-12:
        raise SystemExit("the loops in C found another gradient")
    return {"c_us": 1e6 * best["c"] / n, "ours_us": 1e6 * best["ours"] / n, "share_of_c": best["c"] / best["ours"]}


def compare(dim: int, rows: int, options: argparse.Namespace) -> dict:
    """One size, all sides."""
    made = {name: block(dim, rows, name) for name in PARTS}
    bare = made["bare"]
    sides = {"LAMMPS": (beam.lammps, options.lammps), "PySPH": (beam.pysph, options.pysph)}
    steps = max(int(2e6 / bare.particles), 10)
    rates: dict[str, list[float]] = {}
    for _ in range(ROUNDS):
        for name, composition in made.items():
            rates.setdefault(name, []).append(rate(composition))
        for name, (measured, python) in sides.items():
            if python:
                peer = measured(python, dim, rows, steps, COURANT, warm=5)
                rates.setdefault(name, []).append(peer.particles * steps / peer.seconds)
    row = {
        "dim": dim,
        "rows": rows,
        "particles": bare.particles,
        "pairs_per_particle": {k: c.pairs / c.particles for k, c in made.items()},
        "rates": {k: float(np.median(v)) for k, v in rates.items()},
        "bytes_per_particle": {k: c.bodies[0].system.nbytes / c.particles for k, c in made.items()},
        "cores": {name: worth_of_cores(dim, rows, name, made[name]) for name in ON_ALL_CORES},
        "cost_of_moving": float(np.median(np.array(rates["bare"]) / rates["bare, root moved"])) - 1.0,
    }
    for name, (_, python) in sides.items():
        if python:
            row[f"over {name}"] = {k: float(np.median(np.array(rates[k]) / rates[name])) for k in made}
    return row


def main() -> None:
    """Measure, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", default=["3:12", "3:21", "3:37", "2:97"])
    parser.add_argument("--lammps", metavar="PYTHON", help="a Python that has the module lammps")
    parser.add_argument("--pysph", metavar="PYTHON", help="a Python that has the module pysph")
    parser.add_argument("--million", action="store_true", help="a block of a million particles too")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    kept = ROOT / "docs" / "peers.json"
    before = json.loads(kept.read_text()) if kept.exists() else {"sizes": []}
    found: dict = before | {"machine": f"{platform.machine()}, {len(cores())} cores", "warp": wp.config.version}
    sizes = {(s["dim"], s["rows"]): s for s in before["sizes"]}
    for size in options.sizes:
        dim, rows = (int(word) for word in size.split(":"))
        sizes[dim, rows] = compare(dim, rows, options)
        print(json.dumps(sizes[dim, rows], indent=1), flush=True)
    found["sizes"] = [sizes[key] for key in sorted(sizes, key=lambda key: (-key[0], key[1]))]
    found["reference"] = {}
    for precision in ("f64", "f32"):
        found["reference"][precision] = reference(block(3, 21, "bare", precision=precision))
        print(precision, json.dumps(found["reference"][precision]), flush=True)
    if options.million:
        for precision in ("f64", "f32"):
            composition = block(3, 47, "stress points", threads=0, precision=precision)
            system = composition.bodies[0].system
            found[f"million_{precision}"] = {"particles": composition.particles, "rate_all_cores": rate(composition, 10.0),
                                             "bytes_per_particle": system.nbytes / system.count}  # fmt: skip
            print(json.dumps(found[f"million_{precision}"]), flush=True)
            del composition, system
    if options.write:
        kept.write_text(json.dumps(found, indent=1) + "\n")
        subprocess.run([sys.executable, str(ROOT / "docs" / "make.py"), "--only", "peers"], check=True)


if __name__ == "__main__":
    sys.exit(main())
