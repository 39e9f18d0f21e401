"""What guards cost: the finite check, the energy stop and the ledger, as the time of a check over that of the steps between
two; and following the limit of the time step, as right-hand sides measured again over those of the steps, and as the time of
the process in measurements, and in these and estimates.

python tests/benchmarks/guards.py [checks | limits]
"""

import statistics
import sys
import time
import warnings
from pathlib import Path

import wsph
from tests.stability.shares import share
from wsph.simulation.compose import compose
from wsph.simulation.probing.recorder import RING
from wsph.simulation.run import CHECK_STEPS, Running

ROOT = Path(__file__).resolve().parents[2]


def block(cells: int, formulation: str) -> wsph.Scene:
    """A cube that vibrates."""
    body = {"name": "b", "shape": {"type": "box", "min": [0.0] * 3, "max": [1.0] * 3}, "spacing": 1.0 / cells,
            "velocity": ["1e-3*sin(3*y)", "1e-3*cos(2*x)", "0"], "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}}  # fmt: skip
    run = {"integrator": "leapfrog", "formulation": formulation, "end": 1e3, "cfl": 0.3}
    return wsph.Scene(schema=1, dim=3, run=run, bodies=[body])


def column(speed: float, **run: object) -> wsph.Scene:
    """The twisting column with eight cells across, at `speed` times its speed."""
    w = 105.0 * speed
    velocity = [f"-{w}*sin(pi*z/12)*y", f"{w}*sin(pi*z/12)*x", "0"]
    column = wsph.load(ROOT / "examples" / "twisting_column.toml")
    return column.with_(**{"bodies.0.spacing": 0.125, "bodies.0.velocity": velocity, "probes": [], "output": {}, **run})


def limits() -> None:
    """Print what following the limits takes of runs."""
    cases = {f"twisting column, {speed:g} times its speed": column(speed) for speed in (1, 2, 3, 4)}
    cases["twisting column, cfl auto"] = column(1, cfl="auto")
    for name in ("taylor_bar", "two_rods", "oscillating_beam", "notched_beam", "ball_on_plate", "plastic_hinge"):
        scene = wsph.load(ROOT / "examples" / f"{name}.toml")
        # Of what is long the first few thousand steps.
        most = 3000.0 * compose(scene).dt
        cases[name] = scene.with_(output={}, end=min(scene.end, most))
    for name, scene in cases.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            share(scene.with_(end=0.02 * scene.end))  # compiles, but for estimates
            for run in compose(scene).bodies:
                run.stability.estimate()
            found = share(scene)
        assert found.result is not None
        print(
            f"{name}: {found.result.status}, {found.steps} right-hand sides, {found.measured} measured again,"
            f" {100 * found.evaluations:.2f} %; of the time {100 * found.time('measuring'):.1f} % measures,"
            f" {100 * found.time('following'):.1f} % follows; {found.seconds['all']:.1f} s",
            flush=True,
        )


def checks() -> None:
    """Print what a check takes of the steps between two of them."""
    cases = [("100-particle bar", wsph.load(ROOT / "examples" / "shock_bar.toml"), RING)]
    cases += [(f"cube, {form}", block(45, form), CHECK_STEPS) for form in ("total-lagrangian", "stress-points")]
    for name, scene, between in cases:
        composition = compose(scene)
        composition.compile()
        simulation = Running(composition, None, time.perf_counter())
        composition.program.prepare(between)
        composition.program.run(between)
        simulation.check(0)
        shares = []
        for _ in range(5):
            started = time.perf_counter()
            composition.program.run(between)
            middle = time.perf_counter()
            simulation.check(between)
            shares.append((time.perf_counter() - middle) / (middle - started))
        print(
            f"{name}, {composition.particles} particles: a check every {between} steps takes {100 * statistics.median(shares):.2f} % of them"
        )


if __name__ == "__main__":
    for part in [each for each in (checks, limits) if each.__name__ in sys.argv[1:] or len(sys.argv) == 1]:
        part()
