"""Processes that were started together: they are counted, and what would be done by each is refused."""

import threading
from pathlib import Path

import pytest

from tests.ranks.threads import together
from wsph.cli import main
from wsph.errors import Refused
from wsph.ranks import mpi
from wsph.ranks.world import LAUNCHERS, refuse_strangers, speaks, started


@pytest.mark.parametrize(
    ("environment", "count"),
    [
        ({}, 1),
        ({"OMPI_COMM_WORLD_SIZE": "3"}, 3),
        ({"PMI_SIZE": "2"}, 2),
        ({"SLURM_STEP_NUM_TASKS": "8"}, 8),
        ({"SLURM_NTASKS": "8", "SLURM_STEP_NUM_TASKS": "1"}, 1),
        ({"PMI_SIZE": ""}, 1),
        ({"SLURM_STEP_NUM_TASKS": "4", "OMPI_COMM_WORLD_SIZE": "1"}, 1),
        ({"SLURM_STEP_NUM_TASKS": "4", "OMPI_COMM_WORLD_SIZE": "2"}, 2),
        ({"SLURM_STEP_NUM_TASKS": "4", "PMI_SIZE": "3"}, 3),
    ],
)
def test_launchers_say_how_many(environment: dict[str, str], count: int) -> None:
    assert started(environment) == count


def test_the_first_process_speaks_on_whatever_node_it_is() -> None:
    assert speaks({})
    by_mpiexec = {"OMPI_COMM_WORLD_SIZE": "2", "SLURM_STEP_NUM_TASKS": "2"}
    assert speaks({**by_mpiexec, "OMPI_COMM_WORLD_RANK": "0", "SLURM_PROCID": "1"})
    assert not speaks({**by_mpiexec, "OMPI_COMM_WORLD_RANK": "1", "SLURM_PROCID": "0"})
    assert not speaks({"SLURM_STEP_NUM_TASKS": "2", "SLURM_PROCID": "1"})


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        ({"SLURM_STEP_NUM_TASKS": "3"}, "give srun --mpi=pmix for Open MPI"),
        ({"SLURM_STEP_NUM_TASKS": "3", "PMI_SIZE": "3"}, "give srun --mpi=pmix for Open MPI"),
        ({"SLURM_STEP_NUM_TASKS": "2", "PMI_SIZE": "3"}, "mpiexec is of another MPI"),
        ({"OMPI_COMM_WORLD_SIZE": "3"}, "mpiexec is of another MPI"),
    ],
)
def test_processes_that_mpi_does_not_join_are_told_what_to_start_them_by(
    environment: dict[str, str], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in LAUNCHERS:
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    refuse_strangers(3)
    with pytest.raises(Refused, match=f"3 processes were started together and MPI joins 1 of them: .*{said}"):
        refuse_strangers(1)


@pytest.mark.parametrize(
    ("command", "said"), [("run", "2 processes were started together"), ("study", "was started 2 times together")]
)
def test_processes_that_do_not_know_each_other_are_refused(
    command: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    assert main([command, str(tmp_path / "bar.toml"), "-o", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_processes_of_a_machine_know_their_place_and_deal_out_its_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    machines = ["a", "b", "a", "a"]
    monkeypatch.setattr(mpi.platform, "node", lambda: machines[int(threading.current_thread().name)])
    monkeypatch.setattr(mpi, "cores", lambda: [0, 1, 2, 3, 6])
    assert together(4, lambda domain: domain.place()) == [0, 0, 1, 2]
    assert together(4, lambda domain: domain.cores()) == [[0], [0, 1, 2, 3, 6], [1, 2], [3, 6]]
