"""Scenes that processes share in jobs of SLURM, on two nodes: the scripts of the page, and how jobs end."""

import os
import re
import signal
import time
from pathlib import Path

import pytest
import tomli_w

from tests.pages.blocks import ROOT, blocks
from tests.ranks.launch import needs_mpi
from tests.ranks.shared_cases import scene
from tests.ranks.test_endings import SOON, wait_for
from tests.slurm.cluster import Cluster

pytestmark = [pytest.mark.slow, needs_mpi]

CHECKPOINT = "checkpoint_????????????.npz"
EVERY = 100
"""Steps from one checkpoint, and record, to the next."""

MODULE = {"BASH_FUNC_module%%": "() { :; }"}
"""`module load` of a cluster that has modules."""


def script(folder: Path, word: str) -> Path:
    """The job script of the page that has a word."""
    found = [
        each.text
        for each in blocks(ROOT / "docs" / "howto" / "cluster.md")
        if "#SBATCH" in each.text and word in each.text
    ]
    assert len(found) == 1
    path = folder / "job.sh"
    path.write_text(found[0])
    return path


def bar(folder: Path, steps: float) -> Path:
    """A folder with the page's bar.toml: a scene of so many steps, which leaves a checkpoint every few."""
    folder.mkdir(exist_ok=True)
    changes = {"checkpoint": {"every": EVERY, "final": True}, "output": {"every": 10 * EVERY, "history": EVERY}}
    data = scene(1, run={"end": 0.2 * steps}, probes=[], **changes).data()
    (folder / "bar.toml").write_text(tomli_w.dumps(data))
    return folder


def submitted(cluster: Cluster, folder: Path, word: str, *options: str) -> str:
    """Submit the script with a word; returns the number of the job. Options go before those that stand in it."""
    job = script(folder, word)
    words = ["sbatch", "--parsable", f"--chdir={folder}", "--output=job.log", "--cpus-per-task=1", *options, str(job)]
    done = cluster.run("env", *(f"{name}={text}" for name, text in MODULE.items()), *words)
    assert done.returncode == 0, done.stdout
    return done.stdout.split()[-1]


def code(cluster: Cluster, job: str, seconds: float) -> int:
    """The exit code of a job, which has to end in time."""
    end = time.monotonic() + seconds
    while True:
        said = cluster.run("scontrol", "show", "job", job).stdout
        if re.search(r"JobState=(COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL)", said):
            return int(re.findall(r"ExitCode=(\d+):\d+", said)[0])
        assert time.monotonic() < end, said
        time.sleep(0.2)


def last(out: Path) -> int:
    return max(int(path.stem.partition("_")[2]) for path in (out / "checkpoints").glob(CHECKPOINT))


def files(out: Path) -> dict[str, bytes]:
    """What a run leaves, but for its seconds and its checkpoints."""
    every = (path for path in out.rglob("*") if path.is_file() and path.parent.name != "checkpoints")
    return {
        str(path.relative_to(out)): path.read_bytes() for path in every if path.name not in ("summary.json", ".lock")
    }


# Whom the signal of the script goes to: SLURM sends it at the time limit as scancel does now.
SCRIPTS = {"srun": ("srun --mpi=pmix", ["--signal=TERM"]), "mpiexec": ("exec mpiexec", ["--batch", "--signal=USR1"])}


@pytest.mark.parametrize("by", SCRIPTS)
def test_the_script_of_the_page_goes_on_where_its_signal_has_ended_it(cluster: Cluster, by: str) -> None:
    word, sent = SCRIPTS[by]
    folder = bar(cluster.folder / f"{by}-job", 1e6)
    out = folder / "bar-out"
    job = submitted(cluster, folder, word, "--nodes=2")
    wait_for(f"checkpoints/{CHECKPOINT}", out)
    assert cluster.run("scancel", *sent, job).returncode == 0
    assert code(cluster, job, SOON) == 130, (folder / "job.log").read_text(errors="replace")
    steps = last(out) + 2 * EVERY
    bar(folder, steps)
    job = submitted(cluster, folder, word, "--nodes=1", "--ntasks-per-node=3")
    assert code(cluster, job, 100.0) == 0, (folder / "job.log").read_text(errors="replace")
    alone = cluster.run("wsph", "run", str(folder / "bar.toml"), "-o", str(folder / "alone"))
    assert alone.returncode == 0, alone.stdout
    assert files(out) == files(folder / "alone")


def test_a_process_that_is_killed_takes_the_job_with_it(cluster: Cluster) -> None:
    folder = bar(cluster.folder / "killed", 1e6)
    job = submitted(cluster, folder, "srun --mpi=pmix", "--nodes=2")
    wait_for(f"checkpoints/{CHECKPOINT}", folder / "bar-out")
    there = cluster.processes("SLURM_PROCID=1", "wsph")
    assert len(there) == 1
    os.kill(there[0], signal.SIGKILL)
    assert code(cluster, job, SOON) != 0
    assert not cluster.processes("SLURM_PROCID=0", "bar-out")


def test_a_node_that_is_lost_takes_the_others_with_it(broken: Cluster) -> None:
    folder = bar(broken.folder / "lost", 1e6)
    started = broken.start(
        "srun", "--mpi=pmix", "-N2", "-n2", f"--chdir={folder}", "wsph", "run", "bar.toml", "-o", "bar-out"
    )
    wait_for(f"checkpoints/{CHECKPOINT}", folder / "bar-out")
    broken.end_node("n2")
    end = time.monotonic() + SOON
    while broken.processes("SLURM_PROCID=0", "bar-out"):
        assert time.monotonic() < end
        time.sleep(0.1)
    try:  # srun waits for a node that does not answer, as long as SLURM is set to
        said = started.communicate(timeout=60.0)[0]
    finally:
        started.kill()
    assert started.returncode != 0, said
    steps = last(folder / "bar-out") + EVERY
    bar(folder, steps)
    done = broken.run("wsph", "run", str(folder / "bar.toml"), "-o", str(folder / "bar-out"), "--resume")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("options", [(), ("--mpi=pmi2",)])
def test_an_srun_that_mpi_does_not_know_is_refused_before_anything_is_written(
    cluster: Cluster, options: tuple[str, ...]
) -> None:
    folder = bar(cluster.folder / "strangers", 10)
    step = ["srun", *options, "-N2", "-n2", f"--chdir={folder}"]
    done = cluster.run(*step, "wsph", "run", "bar.toml", "-o", "out")
    assert done.stdout.count("error: 2 processes were started together and MPI joins 1 of them: srun and MPI") == 1
    assert done.returncode == 2
    (folder / "study.toml").write_text('schema = 1\nscene = "bar.toml"\n[grid]\n"run.end" = [0.4, 0.6]\n')
    rows = ["python", "-m", "mpi4py.futures", "-m", "wsph", "study", "study.toml", "--scheduler", "mpi", "-o", "out"]
    done = cluster.run(*step, *rows)
    assert done.stdout.count("error: 2 processes were started together and MPI joins 1 of them: srun and MPI") == 1
    assert done.returncode == 2
    assert not (folder / "out").exists()


def test_mpiexec_may_start_fewer_processes_than_there_are_nodes(cluster: Cluster) -> None:
    folder = bar(cluster.folder / "fewer", 10)
    run = ["mpiexec", "-n", "1", "wsph", "run", str(folder / "bar.toml"), "-o", str(folder / "out")]
    done = cluster.run("salloc", "-N2", "-n2", *run)
    assert "completed: " in done.stdout, done.stdout
