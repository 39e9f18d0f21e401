"""Starts processes together by Open MPI, always with a time after which they are ended."""

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

MPIEXEC = shutil.which("mpiexec", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}")

needs_mpi = pytest.mark.skipif(
    MPIEXEC is None or find_spec("mpi4py") is None, reason="needs an MPI: pip install wsph[mpi-local]"
)


def command(count: int, *arguments: str) -> list[str]:
    """The command that starts Python so often."""
    return [str(MPIEXEC), "--oversubscribe", "-n", str(count), sys.executable, *arguments]


def environment() -> dict[str, str]:
    """As Open MPI wants it in a container, whose user is root."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "integrators"), str(ROOT / "materials")])
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return {**os.environ, **allowed, "PYTHONPATH": path}


def launched(count: int, *arguments: str, seconds: float = 240.0) -> subprocess.CompletedProcess[str]:
    """What Python says, started so often. Raises TimeoutExpired."""
    return subprocess.run(
        command(count, *arguments), capture_output=True, text=True, timeout=seconds, env=environment(), cwd=ROOT
    )
