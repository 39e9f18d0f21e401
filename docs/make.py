"""Everything in the README that was measured: the tables between its markers, and the picture.

    python docs/make.py            accuracy and the picture; the speed table from the last docs/speed.json
    python docs/make.py --speed    measure the speed first (some minutes; on a quiet machine)

The accuracy figures are checked by the tests against the same scenes; this only prints them.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

import wsph

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "examples"))

import oracles  # noqa: E402


def _fixed_end(result: wsph.Result) -> tuple[np.ndarray, np.ndarray]:
    probe = result.probes["fixed-end"]
    return probe["time"], -probe["stress_xx"] / oracles.AMPLITUDE


def accuracy() -> list[str]:
    """Rows of the accuracy table."""
    bar = wsph.load(ROOT / "examples" / "shock_bar.toml")
    rows = ["| scene | particles | time step | figure | reached |", "| --- | --- | --- | --- | --- |"]
    for precision in ("f64", "f32"):
        time, stress = _fixed_end(wsph.run(bar, precision=precision))
        on = oracles.plateau(time, 5.1e-5)
        rows.append(
            f"| elastic bar | 101, {precision} | C = 1 | largest error | {100 * np.abs(stress[on] - 1).max():.0e} % |"
        )
    for n, dt in ((100, 5e-5), (50, 9.9e-5)):
        time, stress = _fixed_end(wsph.run(bar, dt=dt, **{"bodies.0.spacing": 1 / (n - 1)}))
        three_cells = 3.0 / (n - 1) / 200.0
        both = [
            100 * np.sqrt(np.mean((stress[oracles.plateau(time, m)] - 1) ** 2)) for m in (oracles.MARGIN, three_cells)
        ]
        rows.append(
            f"| elastic bar | {n} | {dt:g} s | plateau L2 (margin .4 ms; three cells) | {both[0]:.2g} %; {both[1]:.2g} % |"
        )
        rows.append(f"| elastic bar | {n} | {dt:g} s | overshoot | {100 * (stress.max() - 1):.2g} % |")
    history = wsph.run(bar, end="30 ms").history
    energy = (history["kinetic"] + history["strain"])[history["time"] >= 10e-3]
    rows.append(f"| elastic bar | 101 | C = 1 | energy at 30 ms over 10 ms | {energy[-1] / energy[0]:.10f} |")
    visco = wsph.load(ROOT / "examples" / "viscoplastic_bar.toml")
    errors = []
    for n in (50, 100, 200, 400):
        time, stress = _fixed_end(wsph.run(visco, **{"bodies.0.spacing": 1 / (n - 1)}))
        on = oracles.plateau(time, 3.0 / (n - 1) / 200.0)
        errors.append(100 * np.abs(stress - oracles.viscoplastic(time) / oracles.AMPLITUDE)[on].max())
    rows.append(
        f"| viscoplastic bar, N = 0 | 50 / 100 / 200 / 400 | C = 1 | largest plateau error | {' / '.join(f'{e:.3f}' for e in errors)} % |"
    )
    change = {"bodies.0.spacing": 1 / 49, "bodies.0.material.exponent": 2.0, "bodies.0.material.fluidity": 2.0}
    time, stress = _fixed_end(wsph.run(visco, **change))
    gaps = [100 * abs(np.interp(t, time, stress) * oracles.AMPLITUDE / v - 1) for t, v in oracles.CONVERGED.items()]
    rows.append(
        f"| viscoplastic bar, N = 2 | 50 | C = 1 | error at 5.5 / 6 / 7 ms | {' / '.join(f'{g:.2f}' for g in gaps)} % |"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the energy that is created on purpose
        largest = []
        for courant in (1.0, 1.001, 1.005, 1.01):
            scene = bar.with_(
                cfl=courant, guard="off", end=400 * courant / 2e4, stop={"energy": 1e30}, output={"history": 400}
            )
            largest.append(np.abs(_fixed_end(wsph.run(scene))[1]).max())
    growth = " / ".join(f"{v / largest[0]:.2g}" for v in largest[1:])
    rows.append(f"| elastic bar, guard off | 101 | C = 1.001 / 1.005 / 1.01 | growth in 400 steps | {growth} |")
    return rows


def trade() -> list[str]:
    """Rows of the table of what accuracy costs: the pulse at the fixed end, all of it, against the work."""
    bar = wsph.load(ROOT / "examples" / "shock_bar.toml")
    rows = [
        "| Courant number | support | steps | error (L1 of the whole pulse) | overshoot | energy lost |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for courant, support in ((1.0, 1.2), (0.9, 1.2), (0.5, 1.2), (0.1, 1.2), (1.0, 1.8), (1.0, 2.4)):
        result = wsph.run(bar, cfl=courant, support=support)
        time, stress = _fixed_end(result)
        exact = oracles.elastic(time) / oracles.AMPLITUDE
        e = result.summary["energy"]
        lost = 100 * e["residual"] / e["external_work"]
        rows.append(
            f"| {courant:g} | {support:g} | {result.summary['steps']} | {100 * np.abs(stress - exact).sum() / exact.sum():.1f} % | {100 * (stress.max() - 1):.1f} % | {lost:.1f} % |"
        )
    return rows


def speed() -> list[str]:
    """Rows of the speed table, from docs/speed.json."""
    path = ROOT / "docs" / "speed.json"
    if not path.exists():
        return ["Not measured yet: `python docs/make.py --speed`."]
    s = json.loads(path.read_text())
    low, high = s["steps_per_second_range"]
    rows = [
        "| what | measured |",
        "| --- | --- |",
        f"| 100-particle bar, uniaxial stress, probe every step | {s['steps_per_second'] / 1e3:.0f}k steps/s (runs from {low / 1e3:.0f}k to {high / 1e3:.0f}k) |",
        f"| the same in uniaxial strain | {s['steps_per_second_uniaxial_strain'] / 1e3:.0f}k steps/s |",
        f"| `wsph run examples/shock_bar.toml` from the shell, kernels cached | {s['shell_warm_seconds']:.2f} s, of which import {s['import_seconds']:.2f} s |",
        f"| the same with an empty kernel cache | {s['shell_cold_seconds']:.1f} s |",
        "",
        f"({s['machine']}; `python tests/benchmarks/bar.py`.)",
    ]
    return rows


def pictures() -> None:
    """docs/*.png by the commands that the README shows."""
    for name, field, changes in (("shock_bar", "stress_xx", {"end": "6.5 ms"}), ("shear_band", "plastic_strain", {})):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out"
            wsph.run(wsph.load(ROOT / "examples" / f"{name}.toml").with_(**changes), out)
            target = str(ROOT / "docs" / f"{name}.png")
            command = [sys.executable, "-m", "wsph.cli", "view", str(out), "--field", field, "--save", target]
            subprocess.run(command, check=True)


def main() -> None:
    """Fill the README."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speed", action="store_true")
    if parser.parse_args().speed:
        done = subprocess.run(
            [sys.executable, str(ROOT / "tests" / "benchmarks" / "bar.py"), "--json"],
            check=True,
            capture_output=True,
            text=True,
        )
        (ROOT / "docs" / "speed.json").write_text(done.stdout)
    readme = (ROOT / "README.md").read_text()
    for name, rows in (("accuracy", accuracy()), ("trade", trade()), ("speed", speed())):
        before, rest = readme.split(f"<!-- {name} -->\n", 1)
        _, after = rest.split(f"<!-- /{name} -->", 1)
        readme = f"{before}<!-- {name} -->\n" + "\n".join(rows) + f"\n<!-- /{name} -->{after}"
    (ROOT / "README.md").write_text(readme)
    pictures()


if __name__ == "__main__":
    main()
