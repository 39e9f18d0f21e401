"""Killed at any instant, a run leaves a readable folder, and goes on from its last checkpoint to the same end."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import pyvista

import wsph
from wsph.simulation import checkpoint

SCENE = """
schema = 1
dim = 2
[run]
integrator = "leapfrog"
end = 8.0
dt = 0.02
[[bodies]]
name = "b"
shape = { type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }
spacing = 0.05
state = "strain"
velocity = ["0.01*x", "0"]
[bodies.material]
model = "neo-hookean"
density = 1.0
youngs_modulus = 1.0
poisson_ratio = 0.3
[[probes]]
name = "middle"
at = [[0.5, 0.5]]
fields = ["velocity_x"]
[output]
every = 1
formats = ["vtu", "npz"]
[checkpoint]
every = 3
keep = 3
"""


def readable(folder: Path) -> int:
    """Every frame that an index lists and every checkpoint can be read; how many frames there are."""
    index = folder / "frames.pvd"
    listed = re.findall(r'file="([^"]+)"', index.read_text()) if index.exists() else []
    for name in listed:
        mesh = pyvista.read(folder / name)
        assert np.isfinite(mesh.points).all()
        with np.load((folder / name).with_suffix(".npz")) as frame:
            assert len(frame["position"]) == len(mesh.points)
    for path in checkpoint.listed(folder / "checkpoints"):
        checkpoint.read(path)
    return len(listed)


def killed(tmp_path: Path, times: int, seed: int) -> None:
    """Kill a run and what resumes it, `times` over at random moments, then let it end."""
    path, folder = tmp_path / "scene.toml", tmp_path / "out"
    path.write_text(SCENE)
    straight = wsph.run(path, tmp_path / "straight")
    random = np.random.default_rng(seed)
    cut = 0
    for _ in range(times):
        resume = ["--resume"] if checkpoint.listed(folder / "checkpoints") else ["--overwrite"]
        process = subprocess.Popen([sys.executable, "-m", "wsph.cli", "run", str(path), "-o", str(folder), "--quiet", *resume],
                                   stderr=subprocess.DEVNULL)  # fmt: skip
        seen = time.monotonic()
        while process.poll() is None and time.monotonic() - seen < 60.0 and not (folder / "frames.pvd").exists():
            time.sleep(0.01)
        try:
            process.wait(1.2 + float(random.uniform(0.0, 0.5)))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            cut += process.returncode == -signal.SIGKILL
        readable(folder)
        if process.returncode == 0:
            break
    assert cut > 0
    resume = bool(checkpoint.listed(folder / "checkpoints"))
    if process.returncode != 0:
        wsph.run(path, folder, resume=resume, overwrite=not resume)
    assert readable(folder) == 401
    for name in ("history.csv", "probes/middle.csv", "frames/frame_000400.npz"):
        assert (folder / name).read_bytes() == (tmp_path / "straight" / name).read_bytes(), name
    assert straight.status == "completed"


def test_killed_three_times(tmp_path: Path) -> None:
    killed(tmp_path, 3, 1)


@pytest.mark.slow
def test_killed_twenty_times(tmp_path: Path) -> None:
    killed(tmp_path, 20, 2)


def test_a_full_disk_is_named_and_what_was_written_stays(tmp_path: Path) -> None:
    """A limit on the size of files stands for it: frames fit, the history grows over it."""
    path, folder = tmp_path / "scene.toml", tmp_path / "out"
    path.write_text(SCENE.replace("every = 1\n", "every = 40\nhistory = 1\n").replace("end = 8.0", "end = 80.0"))
    wsph.run(wsph.load(path).with_(end=0.2))  # kernels are compiled: theirs are larger files
    code = f"import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (120_000, 120_000)); from wsph.cli import main; sys.exit(main(['run', {str(path)!r}, '-o', {str(folder)!r}, '--quiet']))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 2, done.stderr
    assert re.search(r"^error: .*out.*: cannot be written: File too large", done.stderr), done.stderr
    assert readable(folder) > 1
    assert not [p for p in folder.rglob("*") if "partial" in p.name or "tmp" in p.name]
