"""What small scenes cost, beside another checkout: CPU seconds of whole commands, in turns, and ratios.

    python tests/benchmarks/small.py BASE_PYTHON BASE_ROOT [HERE_PYTHON [HERE_ROOT]] [--rounds 5] [--cold 2]

Of `wsph run` from the shell to the answer, with the kernel cache as it is (warm) and empty (cold): the bar of 100 particles
of `examples/shock_bar.toml`, a small plate and, cold, a small block of stress points; of the import alone; and of a step of
the bar. CPU time of a process is what other processes on the machine disturb least; the smallest of each side is taken. A
ratio above one: the checkout here takes longer than the base.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

PLATE = """schema = 1
dim = 2
[run]
integrator = "leapfrog"
end = "1 ms"
cfl = 0.5
device = "cpu"
[[bodies]]
name = "plate"
shape = { type = "box", min = [0.0, 0.0], max = [1.0, 0.5] }
spacing = 0.05
state = "strain"
material = { model = "elastic", density = 1000.0, youngs_modulus = "10 MPa", poisson_ratio = 0.3 }
[[boundary]]
body = "plate"
face = "-x"
fixed = ["x", "y"]
[[boundary]]
body = "plate"
face = "+x"
traction = { x = "1 kPa" }
[[probes]]
name = "end"
at = [[1.0, 0.25]]
fields = ["velocity"]
"""

BLOCK = (
    PLATE.replace("dim = 2", "dim = 3")
    .replace("[0.0, 0.0], max = [1.0, 0.5]", "[0.0, 0.0, 0.0], max = [1.0, 0.5, 0.5]")
    .replace("spacing = 0.05", "spacing = 0.1")
    .replace('state = "strain"\n', "")
    .replace('"x", "y"', '"x", "y", "z"')
    .replace("[[1.0, 0.25]]", "[[1.0, 0.25, 0.25]]")
)

STEPS = """
import time, wsph
from pathlib import Path
bar = wsph.load(Path("examples/shock_bar.toml")).with_(**{"bodies.0.spacing": 1.0 / 99.0, "output": {"history": 10_000}})
bar = bar.with_(probes=[bar.data()["probes"][0]])
def cpu(steps):
    before = time.process_time()
    wsph.run(bar.with_(end=steps / 99.0 / 200.0))
    return time.process_time() - before
# Without the set-up: what more steps take more.
short, long = (min(cpu(steps) for _ in range(5)) for steps in (20_000, 220_000))
print((long - short) / 200_000)
"""


@dataclass(frozen=True)
class Side:
    """An interpreter, the root of a checkout, and where its byte code is kept, as of a package that is installed."""

    python: Path
    root: Path
    code: Path

    def cpu(self, arguments: list[str], cache: str | None = None) -> float:
        """CPU seconds of a command of the interpreter, of its children too."""
        process = subprocess.Popen(
            [str(self.python), *arguments], cwd=self.root, env=self._environment(cache), stdout=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise RuntimeError(f"{self.python} {' '.join(arguments)} failed in {self.root}")
        return usage.ru_utime + usage.ru_stime

    def said(self, code: str) -> float:
        """The number that a program prints."""
        done = subprocess.run(
            [self.python, "-c", code],
            cwd=self.root,
            env=self._environment(None),
            check=True,
            capture_output=True,
            text=True,
        )
        return float(done.stdout.split()[-1])

    def _environment(self, cache: str | None) -> dict[str, str]:
        path = os.pathsep.join(str(self.root / room) for room in ("", "integrators", "materials"))
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        own = {"PYTHONPATH": path, "PYTHONPYCACHEPREFIX": str(self.code)}
        return {**kept, **own, **({"WARP_CACHE_PATH": cache} if cache else {})}

    def run(self, scene: Path, cache: str | None = None) -> float:
        """CPU seconds of `wsph run`."""
        with tempfile.TemporaryDirectory() as folder:
            return self.cpu(["-m", "wsph.cli", "run", str(scene), "-o", f"{folder}/out", "--quiet"], cache)

    def cold(self, scene: Path) -> float:
        """The same with an empty kernel cache."""
        with tempfile.TemporaryDirectory() as cache:
            return self.run(scene, cache)


def main() -> None:
    """Print a line for each figure: both sides and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", nargs=2, type=Path, help="interpreter and root of the other checkout")
    parser.add_argument("here", nargs="*", type=Path, help="interpreter and root of this one")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cold", type=int, default=2, help="rounds with an empty cache")
    options = parser.parse_args()
    here = [*options.here, *[Path(sys.executable), Path(__file__).resolve().parents[2]][len(options.here) :]]
    with tempfile.TemporaryDirectory() as folder:
        pairs = enumerate((options.base, here))
        sides = [Side(python.absolute(), root.absolute(), Path(folder) / str(k)) for k, (python, root) in pairs]
        plate, block = Path(folder) / "plate.toml", Path(folder) / "block.toml"
        plate.write_text(PLATE)
        block.write_text(BLOCK)
        bar = Path("examples/shock_bar.toml")
        figures: dict[str, tuple[int, Callable[[Side], float]]] = {
            "import": (options.rounds, lambda side: side.cpu(["-c", "import wsph.cli; wsph.run, wsph.load"])),
            "step of the bar": (options.rounds, lambda side: side.said(STEPS)),
            "bar, warm": (options.rounds, lambda side: side.run(bar)),
            "plate, warm": (options.rounds, lambda side: side.run(plate)),
            "bar, cold": (options.cold, lambda side: side.cold(bar)),
            "plate, cold": (options.cold, lambda side: side.cold(plate)),
            "block, cold": (options.cold, lambda side: side.cold(block)),
        }
        for name, (rounds, figure) in figures.items():
            for side in sides if rounds and "cold" not in name else ():
                figure(side)  # makes whatever is not in the caches yet
            found = [[figure(side) for side in sides] for _ in range(rounds)]
            if found:
                base, ours = (min(each) for each in zip(*found, strict=True))
                print(f"{name:<16} base {base:10.4g} s   here {ours:10.4g} s   ratio {ours / base:.3f}", flush=True)


if __name__ == "__main__":
    main()
