"""Time to accuracy: CPU seconds of one period of a cantilever until it is within 1 % and 2 % of the finite-element period,
beside LAMMPS `smd/tlsph`.

    python tests/benchmarks/accuracy.py [--lammps PYTHON] [--write]

L = .2, W = .02, E = 2 MPa, nu = .3975, in plane strain and as a square bar, started in its first mode with so little that it
is linear. Ours is the default form at .9 of its limit on a face that is fixed; LAMMPS has its parts, four layers that are
held and a time step of .4 spacings over the wave speed, as in its examples. A period is twice the time between the second
and the third passage of the tip. Every row is one run on one core; the CPU seconds are of the steps alone, per period. What
a side takes to a given error follows from its finest rows: error ~ rows^-p as measured, cost ~ rows^(dim + 1). LAMMPS is
found as a module of the Python given. --write leaves docs/accuracy.json for docs/make.py.
"""

import argparse
import json
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import warp as wp

import wsph
from wsph.composition import compose

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import HEAD, LAW, loop_time

ROOT = Path(__file__).resolve().parents[2]
YOUNGS, NU, DENSITY, LENGTH, WIDTH, ROOT_OF_MODE = 2e6, 0.3975, 1000.0, 0.2, 0.02, 1.875104
SPEED = 0.01
"""Of the tip at the start [m/s]: it moves by a thousandth of the length."""
OURS = {2: (3, 4, 6, 8, 12), 3: (3, 4, 6)}
THEIRS = {2: (6, 8, 12), 3: (4, 6)}
NAMES = {2: "rubber in plane strain, L = .2, W = .02", 3: "rubber block, L = .2, W = .02"}
COURANT_OF_LAMMPS = 0.4


def mode(x: str, cosh: str = "cosh({})", sinh: str = "sinh({})") -> str:
    """The first mode of a thin cantilever with SPEED at its tip, as an expression of `x`."""
    k = ROOT_OF_MODE
    m, n = math.sin(k) + math.sinh(k), math.cos(k) + math.cosh(k)
    q = 2.0 * (math.cos(k) * math.sinh(k) - math.sin(k) * math.cosh(k))
    kx = f"({k / LENGTH!r}*{x})"
    return f"{SPEED / q!r}*({m!r}*(cos{kx}-{cosh.format(kx)})-{n!r}*(sin{kx}-{sinh.format(kx)}))"


def period(times: np.ndarray, tip: np.ndarray) -> float:
    """From the passages of the tip after the start."""
    passed = np.flatnonzero(np.sign(tip[1:]) * np.sign(tip[:-1]) < 0)
    at = times[passed] - tip[passed] * (times[passed + 1] - times[passed]) / (tip[passed + 1] - tip[passed])
    at = at[at > 0.2 * times[-1]]
    return float(2.0 * (at[1] - at[0]))


def ours(dim: int, rows: int, expected: float) -> dict[str, float]:
    """One run of ours."""
    edge = WIDTH / rows
    half = [WIDTH / 2] * (dim - 1)
    body = {"name": "b", "shape": {"type": "box", "min": [0.0, *(-h for h in half)], "max": [LENGTH, *half]}, "spacing": edge,
            "velocity": ["0", mode("x"), "0"][:dim],
            "material": {"model": "elastic", "density": DENSITY, "youngs_modulus": YOUNGS, "poisson_ratio": NU}}  # fmt: skip
    if dim == 2:
        body["state"] = "strain"
    hold = [{"body": "b", "face": "-x", "fixed": ["x", "y", "z"][:dim]}]
    tip = {"name": "tip", "at": [[LENGTH, *[0.0] * (dim - 1)]], "fields": ["displacement_y"], "every": 1}
    run = {"integrator": "leapfrog", "end": 1.3 * expected, "cfl": 0.1, "threads": 1}
    scene = wsph.Scene(schema=1, dim=dim, run=run, bodies=[body], boundary=hold, probes=[tip])
    limit = compose(scene).bodies[0].limit or 1.0
    composition = compose(scene.with_(cfl=0.9 * limit))
    composition.compile()
    composition.program.prepare(composition.steps)
    recorder = composition.probes[0]
    recorder.record()
    deflections, cpu, done = [], 0.0, 0
    while done < composition.steps:
        block = min(500, composition.steps - done)
        started = time.process_time()
        composition.program.run(block)
        wp.synchronize_device(composition.device)
        cpu += time.process_time() - started
        done += block
        recorder.flush(list(range(done - block + 1, done + 1)))
    deflections = np.asarray(recorder.columns({"displacement": composition.scales.length}, 1.0)["displacement_y"])
    found = period(np.arange(1, done + 1) * composition.dt, deflections[-done:])
    return {
        "rows": rows,
        "particles": composition.particles,
        "steps": done,
        "error": found / expected - 1.0,
        "cpu_seconds": cpu / 1.3,
    }


DECK = (
    HEAD
    + """lattice sc {edge!r} origin 0.5 {offset!r} {deep!r}
region all block {left!r} {right!r} {low!r} {high!r} {under!r} {over!r} units box
create_box 1 all
region body block {clamp!r} {length!r} {half_low!r} {half!r} {near!r} {far!r} units box
create_atoms 1 region body
group tlsph type 1
region root block INF 0.0 INF INF INF INF units box
group root region root
region end block {last!r} INF {middle_low!r} {middle!r} INF INF units box
group end region end
neighbor {edge!r} bin
set group all volume {volume!r}
set group all smd/mass/density {density!r}
set group all diameter {support!r}
set group all smd/contact/radius {radius!r}
variable bend atom (x>0)*{mode}
velocity all set 0.0 v_bend 0.0 sum no units box
fix hold root smd/setvel 0.0 0.0 0.0
"""
    + LAW
    + """thermo 100000000
variable tip equal xcm(end,y)
fix record all ave/time {every} 1 {every} v_tip file {tip} format ' %.14g'
run {steps}
"""
)


def lammps(python: str, dim: int, rows: int, expected: float) -> dict[str, float]:
    """One run of LAMMPS; its own loop time on one core is the CPU time. In plane strain the strip is one particle thick."""
    edge = WIDTH / rows
    speed = math.sqrt(YOUNGS * (1 - NU) / ((1 + NU) * (1 - 2 * NU)) / DENSITY)
    dt = COURANT_OF_LAMMPS * edge / speed
    steps = int(1.3 * expected / dt)
    every = max(steps // 2000, 1)
    pad, half = 4 * edge, WIDTH / 2
    shift = (0.5 - rows / 2) % 1.0
    middle = edge if rows % 2 == 0 else 0.5 * edge
    with tempfile.TemporaryDirectory() as folder:
        tip = Path(folder) / "tip"
        values = {"edge": edge, "offset": shift, "deep": 0.0 if dim == 2 else shift, "left": -4 * edge - pad, "right": LENGTH + pad,
                  "low": -half - pad - 0.1 * LENGTH, "high": half + pad + 0.1 * LENGTH, "under": -pad if dim == 2 else -half - pad,
                  "over": pad if dim == 2 else half + pad, "clamp": -4 * edge, "length": LENGTH, "half_low": -half, "half": half,
                  "near": -0.4 * edge if dim == 2 else -half, "far": 0.4 * edge if dim == 2 else half, "last": LENGTH - edge,
                  "middle_low": -middle, "middle": middle, "volume": edge**3, "density": DENSITY, "support": 2.6 * edge, "radius": 0.5 * edge,
                  "mode": mode("x", "(0.5*(exp({0})+exp(-{0})))", "(0.5*(exp({0})-exp(-{0})))"), "youngs": YOUNGS, "nu": NU, "dt": dt,
                  "every": every, "tip": str(tip), "steps": steps}  # fmt: skip
        seconds, count = loop_time(python, DECK.format(**values), Path(folder))
        record = np.loadtxt(tip)
    found = period(record[:, 0] * dt, record[:, 1] - record[0, 1])
    return {
        "rows": rows,
        "particles": count,
        "steps": steps,
        "error": found / expected - 1.0,
        "cpu_seconds": seconds / 1.3,
    }


def cost(rows: list[dict[str, float]], dim: int, wanted: float) -> dict[str, float]:
    """CPU seconds to an error: along the line through the two finest rows, or measured where a row is there already."""
    good = [r for r in rows if abs(r["error"]) <= wanted]
    a, b = rows[-2:]
    order = math.log(abs(a["error"] / b["error"])) / math.log(b["rows"] / a["rows"])
    if good:
        return {
            "cpu_seconds": min(r["cpu_seconds"] for r in good),
            "rows": min(r["rows"] for r in good),
            "order": order,
            "measured": True,
        }
    needed = b["rows"] * (abs(b["error"]) / wanted) ** (1.0 / order)
    return {
        "cpu_seconds": b["cpu_seconds"] * (needed / b["rows"]) ** (dim + 1),
        "rows": needed,
        "order": order,
        "measured": False,
    }


def main() -> None:
    """Measure, print, and with --write keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lammps", metavar="PYTHON", help="a Python that has the module lammps")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    modes = json.loads((ROOT / "tests" / "references" / "beam_modes.json").read_text())
    kept: dict = {}
    for dim, name in NAMES.items():
        expected = 2.0 * math.pi / modes[name]["omega"]
        sides = {"ours": [ours(dim, rows, expected) for rows in OURS[dim]]}
        if options.lammps:
            sides["LAMMPS"] = [lammps(options.lammps, dim, rows, expected) for rows in THEIRS[dim]]
        for side, rows in sides.items():
            for row in rows:
                print(f"{dim}D {side}: {json.dumps(row)}", flush=True)
        kept[f"{dim}D"] = {side: {"rows": rows, **{f"to {w:g}": cost(rows, dim, w) for w in (0.01, 0.02)}} for side, rows in sides.items()}  # fmt: skip
        if options.lammps:
            for wanted in ("to 0.01", "to 0.02"):
                ratio = (
                    kept[f"{dim}D"]["LAMMPS"][wanted]["cpu_seconds"] / kept[f"{dim}D"]["ours"][wanted]["cpu_seconds"]
                )
                kept[f"{dim}D"][f"ratio {wanted}"] = ratio
                print(f"{dim}D {wanted}: LAMMPS takes {ratio:.3g} times the CPU seconds", flush=True)
    if options.write:
        (ROOT / "docs" / "accuracy.json").write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
