"""What large bodies cost: seconds from the start of `wsph run` to the end of the first step, memory above an empty run's.

    python tests/benchmarks/large.py [--cells 99] [--precision f32] [--guard refuse off] [--steps 2] [--frames]

A 3D block of stress points, leapfrog, elastic, held at a face, `cells` along every edge: 99 are a million particles, 215 are
ten million. Every size is a process of its own, and so is the empty run: 4 cells along an edge, which has loaded and
compiled the same. No frames are written, unless with `--frames`: then the one of the start is counted. Memory is the
largest that was resident at once (`ru_maxrss`), from the file to the end of the last step. The limit of the time step is
found from some tens of evaluations, with the guard and without.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SCENE = """schema = 1
dim = 3
[run]
integrator = "leapfrog"
end = "1000 s"
cfl = 0.4
device = "cpu"
precision = "{precision}"
guard = "{guard}"
{output}[[bodies]]
name = "block"
shape = {{ type = "box", min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }}
spacing = {{ cells = {cells} }}
material = {{ model = "elastic", density = 1000.0, youngs_modulus = "1 MPa", poisson_ratio = 0.3 }}
[[boundary]]
body = "block"
face = "-x"
fixed = ["x", "y", "z"]
[[boundary]]
body = "block"
face = "+x"
traction = {{ x = "1 kPa" }}
"""


class Enough(Exception):
    """The steps that are asked for have been."""


def one(scene: Path, steps: int, began: float) -> dict[str, float]:
    """Run the command up to so many steps, in this process, which began at a time of the system's clock."""
    from wsph import cli
    from wsph.backend.graph import Program

    found: dict[str, float] = {}
    replay = Program.run

    def run(program: Program, *_: object) -> int:
        for step in range(steps):
            before = time.perf_counter()
            replay(program, 1)
            if step == 0:
                found["seconds"] = time.time() - began
                found["cpu_seconds"] = time.process_time()
            found["step_seconds"] = time.perf_counter() - before
        raise Enough

    Program.run = run
    try:
        cli.main(["run", str(scene), "-o", str(scene.parent / "out"), "--quiet"])
    except Enough:
        found["peak"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return found


def measured(cells: int, precision: str, guard: str, steps: int, output: str) -> dict[str, float]:
    """A run of a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "block.toml"
        scene.write_text(SCENE.format(cells=cells, precision=precision, guard=guard, output=output))
        command = [sys.executable, __file__, "--one", str(scene), "--steps", str(steps), "--began", repr(time.time())]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print one line of JSON a size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs="+", default=[99])
    parser.add_argument("--precision", default="f32")
    parser.add_argument("--guard", nargs="+", default=["refuse", "off"], choices=["refuse", "warn", "off"])
    parser.add_argument("--steps", type=int, default=2)
    parser.add_argument("--frames", action="store_true", help="write the frame of the start too")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--began", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.one, options.steps, options.began)))
        return
    output = "" if options.frames else "[output]\nformats = []\n"
    for guard in options.guard:
        measured(4, options.precision, guard, 1, output)  # compiles
        empty = measured(4, options.precision, guard, 1, output)
        for cells in options.cells:
            found, particles = measured(cells, options.precision, guard, options.steps, output), (cells + 1) ** 3
            above = found["peak"] - empty["peak"]
            print(json.dumps({
                "particles": particles, "precision": options.precision, "guard": guard,
                "seconds_to_first_step": round(found["seconds"], 2), "cpu_seconds": round(found["cpu_seconds"], 2),
                "empty_cpu_seconds": round(empty["cpu_seconds"], 2), "step_seconds": round(found["step_seconds"], 3),
                "megabytes_above_empty": round(above / 1e6, 1), "bytes_a_particle": round(above / particles, 1),
            }), flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
