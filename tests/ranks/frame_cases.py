"""Frames in parts: scenes that processes share, each of them written by one process and by more. Run by mpiexec:

    mpiexec -n 4 python -m tests.ranks.frame_cases FOLDER CASE...

writes the run of the first COUNT processes into FOLDER/CASE/COUNT. "CASE, resumed" stops two processes half way, and three
and one go on: FOLDER/CASE, resumed/3 and FOLDER/CASE, resumed/1.
"""

import sys
import traceback
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import wsph
from tests.ranks.shared_cases import CASES
from wsph.backend.domain import WHOLE

FORMATS = ["vtu", "vtkhdf", "xdmf"]


def parted(name: str) -> wsph.Scene:
    """A case whose frames are in parts."""
    return CASES[name]().with_(**{"output.formats": FORMATS, "output.parts": True, "output.every": 4})


def run(comm: Any, made: wsph.Scene, count: int, out: Path, **options: Any) -> None:
    """Run a scene by the first `count` processes. Their results have each particle and each cell once, but for copies."""
    from wsph.ranks.mpi import Ranks

    part = comm.Split(0 if comm.rank < count else 1, comm.rank)
    if comm.rank < count:
        result = wsph.run(made, out, domain=Ranks(part) if count > 1 else WHOLE, **options)
        fields, cells = result.particles, result.cells
        own = np.flatnonzero(fields["vtkGhostType"] == 0) if "vtkGhostType" in fields else slice(None)
        numbers = np.concatenate(part.allgather(fields["id"][own]))
        assert sorted(numbers.tolist()) == list(range(result.summary["particles"]))
        if cells is not None:
            assert all(corners.max() < len(fields["id"]) for corners in cells.blocks.values())
            assert all(len(values) == cells.count for values in cells.data.values())
    part.Free()
    comm.Barrier()


def main(folder: Path, names: list[str]) -> None:
    from mpi4py import MPI

    warnings.simplefilter("ignore")
    comm = MPI.COMM_WORLD
    for name in names:
        case, _, how = name.partition(", ")
        made = parted(case)
        if not how:
            for count in sorted({1, 2, comm.size}):
                run(comm, made, count, folder / name / str(count))
            continue
        made = made.with_(probes=[])
        half = made.with_(end=made.end / 2, checkpoint={"every": 4})
        for count in (3, 1):
            # Frames behind the last checkpoint are written anew.
            run(comm, half, 2, folder / name / str(count))
            run(comm, made, count, folder / name / str(count), resume=True)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), sys.argv[2:])
    except BaseException:
        from mpi4py import MPI

        traceback.print_exc()
        MPI.COMM_WORLD.Abort(1)
