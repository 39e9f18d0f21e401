"""How fast frames of a million nodes are written: python tests/benchmarks/frames.py [--cells 100] [--formats vtu xdmf]

A cube of hexahedra in double precision with velocity, displacement, stress and a scalar at nodes, stress and a scalar in
cells. Seconds are of the wall and of the processor; the disk cache takes the files, as it does in a run.
"""

import argparse
import tempfile
import time
from itertools import product
from pathlib import Path

import numpy as np

from wsph.output.cells import Gathered
from wsph.output.folder import OutputFolder


def main() -> None:
    """Write three frames in each format, and print the best."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--formats", nargs="+", default=["vtu", "vtkhdf", "xdmf", "npz"])
    options = parser.parse_args()
    side = options.cells + 1
    grid = np.arange(side**3).reshape(side, side, side)
    ends = [grid[a : side - 1 + a, b : side - 1 + b, c : side - 1 + c].ravel() for a, b, c in product((0, 1), repeat=3)]
    corners, nodes = np.stack(ends, 1), np.stack(np.unravel_index(grid.ravel(), grid.shape), 1) / options.cells
    random = np.random.default_rng(0)

    def data(count: int, widths: dict[str, int]) -> dict[str, np.ndarray]:
        return {name: random.random((count, width)).squeeze() for name, width in widths.items()}

    cells = Gathered([[corners]], [side**3], 3).having(
        data(len(corners), {"stress": 6, "plastic_strain": 1}) | {"body": np.zeros(len(corners), np.int64)}
    )
    fields = data(side**3, {"velocity": 3, "displacement": 3, "stress": 6, "plastic_strain": 1})
    for name in options.formats:
        with tempfile.TemporaryDirectory() as folder:
            out = OutputFolder(Path(folder), [name])
            times: list[tuple[float, float]] = []
            for k in range(3):
                before = time.perf_counter(), time.process_time()
                out.frame(float(k), nodes, fields, {}, cells)
                times.append((time.perf_counter() - before[0], time.process_time() - before[1]))
            size = max(path.stat().st_size for path in (Path(folder) / "frames").iterdir()) / 1e6
            wall, busy = (min(each) for each in zip(*times, strict=True))
            print(
                f"{name}: {side**3} nodes, {size:.0f} MB in {wall:.2f} s ({busy:.2f} s of the processor): {size / wall:.0f} MB/s"
            )


if __name__ == "__main__":
    main()
