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
    "OMPI_COMM_WORLD_SIZE": "Open MPI",
    "PMI_SIZE": "MPICH or Intel MPI",
    "SLURM_STEP_NUM_TASKS": "srun",
}
"""Variables in which launchers say how many processes they have started. A job script of SLURM is a step of one task, in
which SLURM_NTASKS says what could be started: it is not asked."""


RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID")
"""Variables in which they say which of them a process is."""


def speaks(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether this process is the one, of those that were started together, that prints what all have to say."""
    return started(environment) == 1 or all(environment.get(name, "0") == "0" for name in RANKS)


def started(environment: Mapping[str, str] = os.environ) -> int:
    """Processes that were started together with this one, itself included."""
    counts = [environment.get(name, "") for name in LAUNCHERS]
    return max((int(count) for count in counts if count.isdigit()), default=1)


def refuse_copies(what: str) -> None:
    """Raise Refused where several processes would each do the same."""
    if (count := started()) > 1:
        raise Refused(f"{what} was started {count} times together: start it once, without mpiexec or srun")


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
    if found.size != count:
        raise Refused(
            f"{count} processes were started together and MPI joins {found.size} of them: mpiexec is of another MPI than the one that"
            " mpi4py has found"
        )
    return found
