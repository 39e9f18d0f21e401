"""Small scenes beside the paved road, each with a value that is right: what comes now, and what came before.

    python tests/extremes/practice.py [--only TEXT] [--before CHECKOUT] [--write]

Faces of one-set forms, thin bodies of rate laws, laws that turn, modes that no gradient sees, locking, orders, ledgers:
what other programs' users reported, and what a run completed with in silence. --before runs another checkout of this program
in a process of its own for the column of that name; --write makes docs/benchmarks/practice.md of what both gave.
"""

import argparse
import json
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import wsph
from wsph.errors import SceneError

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Case:
    """A value that a scene gives, what is `right`, or "refused", and the relative `tolerance`."""

    name: str
    right: float | str
    tolerance: float
    measure: Callable[[], float]


CASES: list[Case] = []


def case(
    name: str, right: float | str, tolerance: float = 0.01
) -> Callable[[Callable[[], float]], Callable[[], float]]:
    """Decorator: a case."""

    def add(measure: Callable[[], float]) -> Callable[[], float]:
        CASES.append(Case(name, right, tolerance, measure))
        return measure

    return add


def steel(model: str, **more: Any) -> dict[str, Any]:
    """Steel's density and moduli."""
    return {"model": model, "density": 7850.0, "youngs_modulus": 200e9, "poisson_ratio": 0.3, **more}


def solid(low: list[float], high: list[float], spacing: float, material: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """A body that is a box."""
    return {
        "name": "b",
        "shape": {"type": "box", "min": low, "max": high},
        "spacing": spacing,
        "material": material,
        **keys,
    }


def result(dim: int, run: dict[str, Any], body: dict[str, Any], **tables: Any) -> wsph.Result:
    """The result of a scene of one body."""
    run = {"integrator": "leapfrog", "threads": 1, **run}
    return wsph.run(wsph.Scene(schema=1, dim=dim, run=run, bodies=[body], **tables))


def pulled(formulation: str) -> float:
    """Both ends of a bar are drawn apart slowly: the stress of its last particle over that of its middle."""
    pull = {"t": [0.0, 1e-3, 19e-3, 20e-3], "value": [0.0, 0.00526, 0.00526, 0.0]}
    bar = solid([0.0], [0.1], 0.005, steel("elastic"), state="stress", damping={"rate": 2e4})
    ends = [{"body": "b", "face": "-x", "fixed": ["x"]}, {"body": "b", "face": "+x", "velocity": {"x": "pull"}}]
    run = {"formulation": formulation, "end": 20e-3, "cfl": 0.5}
    found = result(1, run, bar, functions={"pull": pull}, boundary=ends).particles
    stress = found["stress"][np.argsort(found["position"][:, 0]), 0]
    return float(stress[-1] / stress[len(stress) // 2])


@case("total-Lagrangian bar, ends drawn apart: stress at the end over that in the middle", 1.0, 1e-3)
def _() -> float:
    return pulled("total-lagrangian")


@case("updated-Lagrangian bar, the same", 1.0, 1e-3)
def _() -> float:
    return pulled("updated-lagrangian")


@case("stretched, then turned by a quarter, `perzyna` on stress points: sxx over s (0.577 MPa)", 0.577e6, 5e-3)
def _() -> float:
    angle = "(1-cos(pi*(t-0.001)/0.014))"
    spin = "(t >= 0.001)*(2*pi*pi/0.014*sin(pi*(t-0.001)/0.014))"
    going = f"(t < 0.001)*0.5*pi*sin(pi*1000*t)*x + {spin}*(-sin(2*pi*{angle})*1.001*x - cos(2*pi*{angle})*y)"
    across = f"{spin}*(cos(2*pi*{angle})*1.001*x - sin(2*pi*{angle})*y)"
    law = {"model": "perzyna", "density": 1e3, "youngs_modulus": 1e9, "poisson_ratio": 0.3, "yield_stress": 1e9,
           "hardening_modulus": 0.0, "fluidity": 1.0, "exponent": 1.0}  # fmt: skip
    drive = [{"body": "b", "where": "x > -1", "velocity": {"x": going, "y": across}}]
    probe = {"name": "m", "at": [[0.01, 0.01]], "fields": ["stress"]}
    box = solid([-0.05, -0.05], [0.05, 0.05], 0.0125, law, state="strain")
    found = result(2, {"end": 6e-3, "cfl": 0.2}, box, boundary=drive, probes=[probe]).probes["m"]
    at = np.argmin(np.abs(found["time"] - (1e-3 + 14e-3 * np.arccos(0.75) / np.pi)))
    return float(found["stress_xx"][at])


@case("spinning updated-Lagrangian bar: largest stretch less 1", 1.18e-3, 0.05)
def _() -> float:
    law = {"model": "jaumann", "density": 1e3, "youngs_modulus": 1e9, "poisson_ratio": 0.0}
    bar = solid([-0.5, -0.05], [0.5, 0.05], 0.0125, law, state="stress", velocity=["-100*y", "100*x"])
    run = {"formulation": "updated-lagrangian", "end": 31.4e-3, "cfl": 0.9}
    found = result(2, run, bar, output={"fields": ["displacement"]}).particles
    x = found["position"] - found["position"].mean(0)
    y = found["position"] + found["displacement"]
    linear = np.linalg.lstsq(x, y - y.mean(0), rcond=None)[0]
    return float(np.linalg.svd(linear)[1].max() - 1.0)


@case("sheared box of `tsph`, all faces driven: least shear stress over the exact one", 1.0, 1e-6)
def _() -> float:
    edges = [{"body": "b", "where": "x <= 0 or x >= 0.1 or y <= 0 or y >= 0.1", "velocity": {"x": "10*y", "y": 0.0}}]
    box = solid([0.0, 0.0], [0.1, 0.1], 0.0125, steel("elastic"), state="strain", velocity=["10*y", "0"])
    found = result(2, {"integrator": "tsph", "end": 1e-4, "cfl": 0.5}, box, boundary=edges)
    return float(found.particles["stress"][:, 3].min() / (2e11 / 2.6 * 10.0 * found.time))


def loaded(material: dict[str, Any], side: float, spacing: float, stress: float, time: float, rate: float) -> float:
    """The stretch of a bar in uniaxial stress under a load that grows to a nominal stress."""
    bar = solid([0.0], [side], spacing, material, state="stress", damping={"rate": rate})
    ends = [{"body": "b", "face": "-x", "fixed": ["x"]}, {"body": "b", "face": "+x", "traction": {"x": "load"}}]
    load = {"load": {"t": [0.0, time], "value": [0.0, stress]}}
    found = result(1, {"end": 2.0 * time if rate > 100.0 else 4.0 * time, "cfl": 0.5}, bar, boundary=ends, functions=load,
                   output={"fields": ["displacement"]}, stop={"energy": 10.0})  # fmt: skip
    return 1.0 + float(found.particles["displacement"].max()) / side


@case("bar of `mises` under 300 MPa, uniaxial stress: stretch", 1.0775, 1e-3)
def _() -> float:
    law = steel("mises", yield_stress=250e6, hardening_modulus=1e9)
    return loaded(law, 0.1, 0.0125, 300e6, 10e-3, 2e4)


@case("bar of `jaumann` under a load of 0.2 E, uniaxial stress: stretch", 1.2580, 1e-3)
def _() -> float:
    law = {"model": "jaumann", "density": 1e3, "youngs_modulus": 1e6, "poisson_ratio": 0.3}
    return loaded(law, 1.0, 0.05, 2e5, 0.5, 60.0)


@case("total-Lagrangian cantilever, nu = 0.4999, six rows: frequency over the slender beam's", 1.0, 0.02)
def _() -> float:
    law = {"model": "elastic", "density": 1e3, "youngs_modulus": 2e6, "poisson_ratio": 0.4999}
    k = 1.8751040687 / 0.2
    a, b = float(np.cos(k * 0.2) + np.cosh(k * 0.2)), float(np.sin(k * 0.2) + np.sinh(k * 0.2))
    shape = f"1e-5*({a!r}*(sin({k!r}*x)-sinh({k!r}*x))-{b!r}*(cos({k!r}*x)-cosh({k!r}*x)))*(x>0)"
    beam = solid([0.0, -0.01], [0.2, 0.01], 0.02 / 6, law, state="strain", velocity=["0", shape])
    root = [{"body": "b", "face": "-x", "fixed": ["x", "y"]}]
    omega = k * k * np.sqrt(2e6 / (1.0 - 0.4999**2) * 0.02**2 / 12.0 / 1e3)
    probe = {"name": "tip", "at": [[0.2, 0.0]], "fields": ["displacement_y"], "every": 1}
    # It begins with a velocity alone: after half a period its displacement is back at zero.
    run = {"formulation": "total-lagrangian", "end": 1.1 * np.pi / omega, "cfl": 0.5}
    found = result(2, run, beam, boundary=root, probes=[probe]).probes["tip"]
    t, u = found["time"], found["displacement_y"]
    at = np.flatnonzero(np.diff(np.sign(u[1:])))[0] + 1
    return float(np.pi / (t[at] - u[at] * (t[at + 1] - t[at]) / (u[at + 1] - u[at])) / omega)


@case("free block under a traction that grows with time, `lf4`: momentum over the impulse", 1.0, 1e-9)
def _() -> float:
    law = {"model": "elastic", "density": 1e3, "youngs_modulus": 1e7, "poisson_ratio": 0.3}
    block = solid([0.0, 0.0], [1.0, 0.4], 0.1, law, state="strain")
    push = [{"body": "b", "face": "+x", "traction": {"x": "1000*t"}}]
    found = result(2, {"integrator": "lf4", "end": 0.01, "cfl": 0.3}, block, boundary=push)
    return float(found.summary["momentum"][0] / (200.0 * found.summary["time"] ** 2))


@case("`elastic` in `ul-tsph`, small rough motion: stored energy over what it began with, at most", 1.0, 0.0)
def _() -> float:
    law = {"model": "elastic", "density": 1e3, "youngs_modulus": 1e9, "poisson_ratio": 0.3}
    rough = ["1e-4*sin(997.1*x+1313.7*y)", "1e-4*sin(997.1*x+1+1313.7*y)"]
    box = solid([0.0, 0.0], [0.6, 0.7], 0.1, law, state="strain", velocity=rough)
    energy = result(2, {"integrator": "ul-tsph", "end": 0.2, "cfl": 0.3}, box).history
    return float(energy["strain"][-1] / (energy["kinetic"][0] + energy["strain"][0]))


@case("stress points with a support of 2.4", "refused")
def _() -> float:
    bar = solid([0.0], [1.0], 0.05, steel("elastic"), state="stress", velocity=["x"])
    run = {"formulation": "stress-points", "support": 2.4, "end": 1e-5, "cfl": 0.2}
    found = result(1, run, bar, boundary=[{"body": "b", "where": "x <= 0 or x >= 1", "velocity": {"x": "x"}}])
    return float(np.ptp(found.particles["stress"][:, 0]) / found.particles["stress"][:, 0].mean())


@case("plastic front of a total-Lagrangian bar, 400 cells: speed over sqrt(E_t/rho)", 1.0, 0.03)
def _() -> float:
    law = steel("mises", yield_stress=200e6, hardening_modulus=2e11 / 99.0)
    tangent = np.sqrt(2e9 / 7850.0)
    bar = solid([0.0], [1.0], 0.0025, law, state="stress")
    # Before the elastic wave is back from the far end.
    push = [{"body": "b", "face": "-x", "velocity": {"x": "min(t/2e-6, 1)*20"}}]
    run = {"formulation": "total-lagrangian", "end": 0.16 / tangent, "cfl": 0.5}
    found = result(1, run, bar, boundary=push, output={"fields": ["plastic_strain"]}).particles
    order = np.argsort(found["position"][:, 0])
    x, strain = found["position"][order, 0], np.ravel(found["plastic_strain"])[order]
    half = 0.5 * np.median(strain[(x > 0.02) & (x < 0.1)])
    return float(x[np.flatnonzero(strain > half)[-1]] / 0.16)


@case("`tsph` in a uniform stretch: density over rho_0/(1 + tr eps)", 1.0, 1e-9)
def _() -> float:
    box = solid(
        [0.0, 0.0],
        [1.0, 1.0],
        0.1,
        {**steel("elastic"), "youngs_modulus": 1e4},
        state="strain",
        velocity=["x", "0.5*y"],
    )
    edges = [{"body": "b", "where": "x <= 0 or x >= 1 or y <= 0 or y >= 1", "velocity": {"x": "x", "y": "0.5*y"}}]
    found = result(
        2, {"integrator": "tsph", "end": 0.01, "cfl": 0.5}, box, boundary=edges, output={"fields": ["density"]}
    )
    return float(np.ravel(found.particles["density"]).mean() * (1.0 + 1.5 * found.time) / 7850.0)


def outcome(each: Case) -> float | str:
    """The value of a case, or in a word how it ended otherwise."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return each.measure()
        except SceneError:
            raise
        except wsph.WsphError as error:
            return "stopped" if "unstable" in str(error) else "refused"


def meets(each: Case, found: float | str) -> bool:
    """Whether what came is right."""
    if isinstance(found, str) or isinstance(each.right, str):
        return found == each.right
    if each.tolerance == 0.0:
        return found <= each.right
    return abs(found - each.right) <= each.tolerance * abs(each.right)


def shown(value: float | str) -> str:
    """As the table has it."""
    return value if isinstance(value, str) else f"{value:.5g}"


def before(checkout: Path, only: str) -> dict[str, float | str]:
    """The outcomes of another checkout, which runs this file."""
    path = [str(checkout / part) for part in (".", "integrators", "materials")]
    script = (
        f"import sys; sys.path[:0] = {path!r}; sys.argv = ['practice', '--json', '--only', {only!r}]; import runpy;"
    )
    script += f" runpy.run_path({str(Path(__file__).resolve())!r}, run_name='__main__')"
    text = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=checkout
    ).stdout
    return json.loads(text.splitlines()[-1])


def main() -> None:
    """Print the values, and with --write keep them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="cases whose name has this text")
    parser.add_argument("--before", type=Path, help="another checkout of this program")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    chosen = [each for each in CASES if options.only in each.name]
    found = {each.name: outcome(each) for each in chosen}
    if options.json:
        print(json.dumps(found))
        return
    earlier = before(options.before.resolve(), options.only) if options.before else {}
    rows = []
    for each in chosen:
        bound = f"{shown(each.right)} at most" if each.tolerance == 0.0 else shown(each.right)
        rows.append(f"| {each.name} | {bound} | {shown(earlier.get(each.name, '-'))} | {shown(found[each.name])} |")
        print(("right  " if meets(each, found[each.name]) else "WRONG  ") + rows[-1])
    if options.write:
        head = "# Beside the paved road\n\nMade by `python tests/extremes/practice.py --before CHECKOUT --write`; the column before is of an\nearlier state of this program.\n\n"
        table = "| what | right | before | now |\n| --- | --- | --- | --- |\n" + "\n".join(rows) + "\n"
        (ROOT / "docs" / "benchmarks" / "practice.md").write_text(head + table)


if __name__ == "__main__":
    main()
