"""Speed of the 100-particle Taylor-SPH bar, its probe every step, and of the whole command from the shell.

    python tests/benchmarks/bar.py [--json]

Steps per second are wall time inside steps (no set-up, compilation or output), the median of seven runs of 40 000 steps.
The command is timed with the kernel cache as it is (warm) and with an empty one (cold); import and set-up are what the
rest of the warm time is made of. Run it on a quiet machine: every other process takes its share.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path

import wsph

SCENE = Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml"


def steps_per_second(runs: int = 7, **overrides: object) -> list[float]:
    """Steps per second of the bar with 100 particles."""
    scene = wsph.load(SCENE).with_(
        **{"bodies.0.spacing": 1.0 / 99.0, "end": 40_000 / 99.0 / 200.0, "output": {"history": 10_000}}, **overrides
    )
    scene = scene.with_(probes=[scene.data()["probes"][0]])
    rates = []
    for _ in range(runs):
        result = wsph.run(scene)
        rates.append(result.cost["particle_steps_per_second"] / result.summary["particles"])
    return rates


def shell(cache: str | None = None) -> float:
    """Seconds of `wsph run examples/shock_bar.toml` from the shell."""
    environment = {**os.environ, **({"WARP_CACHE_PATH": cache} if cache else {})}
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "wsph.cli", "run", str(SCENE), "-o", f"{folder}/out", "--quiet"],
            check=True,
            env=environment,
            stderr=subprocess.DEVNULL,
        )
        return time.perf_counter() - start


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    shell()
    with tempfile.TemporaryDirectory() as cache:
        cold = shell(cache)
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import wsph.simulation.run"], check=True)
    imported = time.perf_counter() - start
    rates = steps_per_second()
    figures = {
        "steps_per_second": statistics.median(rates),
        "steps_per_second_range": [min(rates), max(rates)],
        "steps_per_second_uniaxial_strain": statistics.median(steps_per_second(**{"bodies.0.state": "strain"})),
        "shell_warm_seconds": statistics.median(shell() for _ in range(5)),
        "shell_cold_seconds": cold,
        "import_seconds": imported,
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, Warp {metadata.version('warp-lang')}",
    }
    if options.json:
        print(json.dumps(figures, indent=2))
    else:
        for name, value in figures.items():
            print(f"{name:<34} {value if not isinstance(value, float) else f'{value:.4g}'}")


if __name__ == "__main__":
    main()
