"""The cluster of this folder's tests: one for all of them, but for those that break it."""

from collections.abc import Iterator

import pytest

from tests.slurm.cluster import Cluster, lacking


def up() -> Cluster:
    """A cluster whose srun knows MPI. Skips where this machine cannot have one, and says why."""
    if why := lacking():
        pytest.skip(why)
    return Cluster()


def with_mpi(cluster: Cluster) -> None:
    """Skip where srun has no PMIx, which Open MPI asks for."""
    done = cluster.run("srun", "--mpi=pmix", "-n1", "true", seconds=30.0)
    if done.returncode:
        pytest.skip(f"needs srun --mpi=pmix (Debian's libpmix-dev): {done.stdout.splitlines()[:1]}")


@pytest.fixture(scope="session")
def cluster() -> Iterator[Cluster]:
    """Two nodes and a head."""
    with up() as made:
        with_mpi(made)
        yield made


@pytest.fixture
def broken() -> Iterator[Cluster]:
    """A cluster that a test may break."""
    with up() as made:
        with_mpi(made)
        yield made
