"""Cost of a step in this checkout beside another one: what a change of code has gained or lost.

    python tests/benchmarks/trees.py OTHER_CHECKOUT [--slices 40] [--seconds 0.15] [--only TEXT]

Each checkout runs in a process of its own, from its own files, and both hold the same scenes: those of `peers.py` (2D and
3D, one core), of `methods.py` (every integrator) and the bar of `bar.py`. Slices of a fraction of a second alternate
between the two, which one goes first too, and the slices' CPU time per step is compared: a machine whose clock changes is
as fast for both sides of a pair. Printed are the median of the ratios this/other and its quartiles.
"""

import argparse
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = {
    f"{dim}D {form}": (dim, rows, form)
    for dim, rows in ((2, 48), (3, 10))
    for form in ("hourglass and viscosity", "pair damping", "viscosity", "residual", "bare", "stress points")
}
CUBES = ("tsph", "ul-tsph", "leapfrog", "lf4", "blanes-moan4", "rk4", "kg4-8", "rkc")
BAR = "bar, 100 particles"
CASES = (BAR, *BLOCKS, *(f"cube {name}" for name in CUBES))


def composed(case: str) -> Any:
    """The composition of a case, of the checkout that is imported."""
    if case in BLOCKS:
        import peers

        return peers.block(*BLOCKS[case])
    if case != BAR:
        import methods

        return methods.cube(14, case.removeprefix("cube "))
    import bar

    import wsph

    try:
        from wsph.simulation.compose import compose
    except ModuleNotFoundError:
        # before there were rooms
        from wsph.composition import compose  # pyright: ignore[reportMissingImports]
    scene = wsph.load(bar.SCENE).with_(**{"bodies.0.spacing": 1.0 / 99.0, "end": 1e6, "output": {"history": 10_000}})
    composition = compose(scene)
    composition.compile()
    return composition


def serve() -> None:
    """Compose the cases that are asked for and time steps of them, one answer a line."""
    program = None
    for line in sys.stdin:
        what, value = line.rstrip("\n").split("\t")
        if what == "case":
            program = composed(value).program
            program.run(3)
            started, steps = time.thread_time(), 0
            while time.thread_time() - started < 0.2:
                program.run(2)
                steps += 2
            print("took", (time.thread_time() - started) / steps, flush=True)
            continue
        assert program is not None
        started = time.thread_time()
        program.run(int(value))
        print("took", (time.thread_time() - started) / int(value), flush=True)


class Side:
    """A process of one checkout."""

    def __init__(self, tree: Path):
        path = ":".join(str(tree / part) for part in ("", "integrators", "materials", "tests/benchmarks"))
        # This file, in front of the other checkout's modules.
        command = [sys.executable, "-c", f"import sys; sys.path[:0] = {path.split(':')!r}; import runpy;"
                   f" runpy.run_path({str(Path(__file__).resolve())!r})['serve']()"]  # fmt: skip
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )

    def ask(self, what: str, value: object) -> float:
        """Seconds of CPU time per step."""
        into, out = self._process.stdin, self._process.stdout
        assert into is not None
        assert out is not None
        into.write(f"{what}\t{value}\n")
        into.flush()
        for line in out:
            if line.startswith("took "):
                return float(line.split()[1])
        raise RuntimeError(f"{value}: the other process ended")

    def close(self) -> None:
        """End the process."""
        self._process.terminate()


def main() -> None:
    """Print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path)
    parser.add_argument("--slices", type=int, default=40)
    parser.add_argument("--seconds", type=float, default=0.15)
    parser.add_argument("--only", default="", help="cases whose name has this text")
    options = parser.parse_args()
    for case in (case for case in CASES if options.only in case):
        sides = Side(ROOT), Side(options.other.resolve())
        steps = max(round(options.seconds / min(side.ask("case", case) for side in sides)), 1)
        ratios = []
        for slice_ in range(options.slices):
            order = sides if slice_ % 2 else sides[::-1]
            took = {side: side.ask("steps", steps) for side in order}
            ratios.append(took[sides[0]] / took[sides[1]])
        first, median, third = statistics.quantiles(ratios, n=4)
        print(f"{case:<28} {median:.3f}  ({first:.3f} to {third:.3f})", flush=True)
        for side in sides:
            side.close()


if __name__ == "__main__":
    main()
