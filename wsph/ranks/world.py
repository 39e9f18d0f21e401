"""Whether processes were started together, as by mpiexec or srun, for one scene."""

# pyright: strict

import os
from collections.abc import Mapping

from wsph.errors import Refused

LAUNCHERS = {
    "OMPI_COMM_WORLD_SIZE": "Open MPI",
    "PMI_SIZE": "MPICH or Intel MPI",
    "SLURM_STEP_NUM_TASKS": "srun",
}
"""Variables in which launchers say how many processes they have started. A job script of SLURM is a step of one task, in
which SLURM_NTASKS says what could be started: it is not asked."""


def started(environment: Mapping[str, str] = os.environ) -> int:
    """Processes that were started together with this one, itself included."""
    counts = [environment.get(name, "") for name in LAUNCHERS]
    return max((int(count) for count in counts if count.isdigit()), default=1)


def refuse_copies(what: str) -> None:
    """Raise Refused where several processes would each do the same."""
    if (count := started()) > 1:
        raise Refused(f"{what} was started {count} times together: start it once, without mpiexec or srun")
