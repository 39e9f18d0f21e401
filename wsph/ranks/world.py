"""Whether processes were started together, as by mpiexec or srun, for one scene."""

# pyright: strict

import os
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from wsph.errors import Refused

if TYPE_CHECKING:
    from wsph.backend.domain import Domain

LAUNCHERS = {
    "OMPI_COMM_WORLD_SIZE": "OMPI_COMM_WORLD_RANK",
    "PMI_SIZE": "PMI_RANK",
    "SLURM_STEP_NUM_TASKS": "SLURM_PROCID",
}
"""Variables in which launchers say how many processes they have started, and those in which they say which of them a process
is: mpiexec of Open MPI; of MPICH or Intel MPI, and srun that speaks their language; srun. The first that is there counts: by
srun an mpiexec starts one of its own on each node of a job, and the processes that this starts have the variables of both.
A job script of SLURM is a step of one task, in which SLURM_NTASKS says what could be started: it is not asked."""


def _launcher(environment: Mapping[str, str]) -> tuple[int, int]:
    """How many processes the launcher has started, and which of them this is."""
    for size, rank in LAUNCHERS.items():
        if (count := environment.get(size, "")).isdigit():
            place = environment.get(rank, "")
            return max(int(count), 1), int(place) if place.isdigit() else 0
    return 1, 0


def speaks(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether this process is the one, of those that were started together, that prints what all have to say."""
    return _launcher(environment)[1] == 0


def started(environment: Mapping[str, str] = os.environ) -> int:
    """Processes that were started together with this one, itself included."""
    return _launcher(environment)[0]


def refuse_copies(what: str) -> None:
    """Raise Refused where several processes would each do the same."""
    if (count := started()) > 1:
        raise Refused(f"{what} was started {count} times together: start it once, without mpiexec or srun")


def refuse_strangers(joined: int) -> None:
    """Raise Refused where the processes that were started together are not those that MPI has `joined`."""
    if (count := started()) == joined:
        return
    why = "mpiexec is of another MPI than the one that mpi4py has found"
    if os.environ.get("SLURM_STEP_NUM_TASKS") == str(count) and "OMPI_COMM_WORLD_SIZE" not in os.environ:
        why = (
            "srun and MPI do not speak the same language: give srun --mpi=pmix for Open MPI, --mpi=pmi2 for MPICH and Intel"
            " MPI, of those that srun --mpi=list names, or start mpiexec in the job instead"
        )
    raise Refused(f"{count} processes were started together and MPI joins {joined} of them: {why}")


def domain() -> "Domain":
    """The part of a scene that this process is to have: one among those that were started together. Raises Refused where
    MPI is missing, or joins fewer, or has the others make rows."""
    from wsph.backend.domain import WHOLE

    if (count := started()) == 1:
        return WHOLE
    if "mpi4py.futures" in sys.modules:
        raise Refused(
            "the processes of mpi4py.futures make rows and share no scene: give --scheduler mpi, or leave out -m mpi4py.futures"
        )
    try:
        from mpi4py import MPI  # pyright: ignore[reportMissingImports, reportUnknownVariableType]
    except (ImportError, RuntimeError) as error:
        raise Refused(
            f"{count} processes were started together, and they cannot talk to each other ({error}): install wsph[mpi], and on a"
            " machine without an MPI of its own wsph[mpi-local]"
        ) from error
    from wsph.ranks.mpi import Ranks

    comm = MPI.COMM_WORLD  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    found = Ranks(comm)  # pyright: ignore[reportUnknownArgumentType]
    refuse_strangers(found.size)
    return found
