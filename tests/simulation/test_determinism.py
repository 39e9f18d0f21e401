"""One answer, to the bit: threads, a cold or a warm kernel cache, straight or resumed, whatever is written when."""

import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose

ROOT = Path(__file__).resolve().parents[2]


def scene(formulation: str, threads: int = 1, every: int = 50, dim: int = 2) -> wsph.Scene:
    """A body that yields while it is pulled, with a probe every step."""
    run = {"formulation": formulation, "end": 1.2, "dt": 0.03, "threads": threads}
    tables = {"boundary": [scenes.held("-x", dim), scenes.driven("+x", x="0.02*(1+t)")], "output": {"every": every, "history": 1},
              "probes": [{"name": "p", "at": [[0.5] * dim], "fields": ["velocity", "stress"], "every": 1}]}  # fmt: skip
    mises = scenes.material("mises", yield_stress=2e-3)
    return scenes.block(dim, run=run, tables=tables, velocity=["0.02*x", "0.01*x"][:dim], material=mises)


def digest(result: wsph.Result) -> str:
    """Of everything that a run gives."""
    found = hashlib.sha256()
    arrays = {**result.particles, **{f"p.{k}": v for k, v in result.probes["p"].items()}, **{f"h.{k}": v for k, v in result.history.items()}}  # fmt: skip
    for name in sorted(arrays):
        found.update(name.encode() + arrays[name].tobytes())
    return found.hexdigest()


@pytest.mark.parametrize("formulation", ["stress-points", "total-lagrangian", "updated-lagrangian"])
def test_one_hash(formulation: str, tmp_path: Path, share: Callable[[], None]) -> None:
    captured = digest(wsph.run(scene(formulation)))
    share()
    found = {captured}
    # Every pair of a number of threads, a cadence, and straight or resumed.
    pairs = [(threads, every, (threads == 2) == (every == 50)) for threads in (1, 2, 4) for every in (3, 50)]
    for threads, every, resumed in pairs:
        whole = scene(formulation, threads, every)
        folder = tmp_path / f"{threads}-{every}-{resumed}"
        if resumed:
            wsph.run(whole.with_(end=0.6, checkpoint={"every": 7}), folder)
        found.add(digest(wsph.run(whole, folder, resume=resumed)))
    assert len(found) == 1


def test_a_cold_cache_gives_the_same_hash(tmp_path: Path) -> None:
    code = "import wsph, tests.simulation.test_determinism as t; print(t.digest(wsph.run(t.scene('stress-points', dim=1))))"
    environment = {**os.environ, "WARP_CACHE_PATH": str(tmp_path)}
    cold, warm = (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
        )
        for _ in range(2)
    )
    assert list(tmp_path.rglob("*.o"))
    assert len(cold.stdout.splitlines()[-1]) == 64
    assert cold.stdout.splitlines()[-1] == warm.stdout.splitlines()[-1]


@pytest.mark.filterwarnings("ignore:.*energy was created")
@pytest.mark.parametrize("integrator", ["leapfrog", "lf4", "ul-tsph"])
def test_a_time_step_that_follows_is_the_same_whatever_is_recorded_when(integrator: str, tmp_path: Path) -> None:
    """Stretched or squeezed, at 97 % of its limit: in single steps or many, straight or resumed from any step."""
    taylor = integrator == "ul-tsph"
    run = {"integrator": integrator, "formulation": "updated-lagrangian" if taylor else "stress-points", "end": 2.0, "guard": "refuse"}  # fmt: skip
    # A processed method keeps no velocities that are prescribed in time.
    pull = [] if integrator == "lf4" else [{"body": "b", "face": "-x", "fixed": ["x"]}]
    moving = scenes.block(
        run=run | {"cfl": 0.01}, tables={"boundary": pull}, velocity=["-0.1*x" if taylor else "0.3*x", "0"]
    )
    whole = moving.with_(cfl=0.97 * compose(moving).bodies[0].limit)
    straight = wsph.run(whole)
    assert straight.history["dt"][-1] < 0.99 * straight.history["dt"][0]
    for every in (1, 7, 1000):
        scene = whole.with_(output={"history": every, "every": "0.3 s"}, checkpoint={"every": 3})
        folder = tmp_path / str(every)
        wsph.run(scene.with_(end=1.1), folder)
        for again in (wsph.run(scene), wsph.run(scene, folder, resume=True)):
            assert again.time == straight.time
            for name, values in straight.particles.items():
                assert np.array_equal(values, again.particles[name], equal_nan=True), name
