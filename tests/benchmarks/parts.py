"""What a frame takes in the first process, gathered and in parts: seconds and memory.

    mpiexec -n 4 python tests/benchmarks/parts.py [--cells 50] [--formats vtu vtkhdf]

A bar of 4 x 1 x 1 cubes of so many cells each way, stress points in double precision. Memory is what a process allocates at
most while it writes a frame (tracemalloc), in bytes a particle of all.
"""

import argparse
import shutil
import tempfile
import time
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
from mpi4py import MPI

import wsph
from tests.scenes import body, box, scene
from wsph.output.folder import OutputFolder, PartedFolder, UnwrittenFolder
from wsph.ranks.mpi import Ranks
from wsph.simulation.probing.records import Records


def main() -> None:
    """Print for both what each process takes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=50)
    parser.add_argument("--formats", nargs="+", default=["vtu"])
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    comm, domain = MPI.COMM_WORLD, Ranks(MPI.COMM_WORLD)
    folder = Path(comm.bcast(tempfile.mkdtemp() if comm.rank == 0 else None))
    run = {"formulation": "stress-points", "integrator": "leapfrog", "end": 1e-3}
    made = scene(body(box(4.0, 1.0, 1.0), 1.0 / options.cells, velocity=["x", 0.0, 0.0]), run=run)
    for parts in (False, True):
        asked = made.with_(**{"output.parts": parts, "output.formats": options.formats})
        composition = wsph.compose(asked, domain)
        kinds = OutputFolder if comm.rank == 0 else UnwrittenFolder
        place = folder / str(parts)
        out = PartedFolder(place, options.formats, None, ["b"], domain) if parts else kinds(place, options.formats)
        composition.bodies[0].system.refresh(composition.bodies[0].system.state)
        records = Records(composition, (), out)
        records.frame(0)  # what is found once stays
        comm.Barrier()
        began = time.perf_counter()
        records.frame(1)
        comm.Barrier()
        seconds = time.perf_counter() - began
        tracemalloc.start()
        records.frame(2)
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        peaks = comm.gather(taken / composition.particles)
        if comm.rank == 0:
            size = sum(path.stat().st_size for path in (place / "frames").glob("frame_000001*"))
            shutil.rmtree(place)
            print(
                f"{composition.particles} particles, {comm.size} processes, {'in parts' if parts else 'gathered'}:"
                f" {size / composition.particles:.0f} bytes a particle in {seconds:.2f} s; memory"
                f" {', '.join(f'{each:.0f}' for each in np.array(peaks))} bytes a particle of all"
            )


if __name__ == "__main__":
    main()
