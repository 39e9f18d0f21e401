"""Rows of a study on workers that are jobs of SLURM: by dask-jobqueue and by mpi4py.futures."""

import json
import threading
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.pages.blocks import ROOT, blocks
from tests.ranks.launch import needs_mpi
from tests.slurm.cluster import Cluster
from tests.study.test_cluster import TEXT, rows

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def alone(cluster: Cluster) -> Path:
    """The study by one process, in a folder that the nodes see."""
    (cluster.folder / "grids.toml").write_text(TEXT)
    done = cluster.run("wsph", "study", "grids.toml", "-o", "alone", "--workers", "1")
    assert done.returncode == 0, done.stdout
    return cluster.folder / "alone"


@pytest.mark.skipif(find_spec("dask_jobqueue") is None, reason="needs wsph[cluster]")
def test_a_study_is_complete_when_a_job_of_a_worker_is_cancelled(cluster: Cluster, alone: Path) -> None:
    page = ROOT / "docs" / "howto" / "cluster.md"
    program = next(each.text for each in blocks(page) if "SLURMCluster" in each.text)
    for said, here in {'"ib0"': '"eth0"', '"4GB"': '"1GB"', "jobs=32": "jobs=2"}.items():
        assert said in program
        program = program.replace(said, here)
    (cluster.folder / "workers.py").write_text(program)
    out, cancelled = cluster.folder / "grids-out", threading.Event()

    def cancel() -> None:
        end = time.monotonic() + 60.0
        while len(list(out.glob("series/*"))) < 4:
            if time.monotonic() > end:
                return
            time.sleep(0.05)
        job = cluster.run("squeue", "-h", "-o", "%i").stdout.split()[0]
        if cluster.run("scancel", job).returncode == 0:
            cancelled.set()

    canceller = threading.Thread(target=cancel, daemon=True)
    canceller.start()
    done = cluster.run("python", "workers.py", seconds=120.0)
    canceller.join(70.0)
    assert done.returncode == 0, done.stdout
    assert cancelled.is_set()
    assert rows(out) == rows(alone)
    assert len(json.loads((out / "study.json").read_text())["rows"]) == 32
    end = time.monotonic() + 10.0
    while cluster.run("squeue", "-h").stdout.strip():  # workers end with their cluster
        assert time.monotonic() < end
        time.sleep(0.2)


@needs_mpi
def test_rows_by_workers_that_srun_starts(cluster: Cluster, alone: Path) -> None:
    words = ["python", "-m", "mpi4py.futures", "-m", "wsph", "study", "grids.toml", "--scheduler", "mpi", "-o", "there"]
    done = cluster.run("srun", "--mpi=pmix", "-N2", "-n3", *words)
    assert done.returncode == 0, done.stdout
    assert rows(cluster.folder / "there") == rows(alone)
