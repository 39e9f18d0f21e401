"""Memory: what bodies will take is known before they are set up, and what does not fit is refused with what would."""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import wsph
from tests import scenes
from wsph.cli import main
from wsph.errors import SceneError
from wsph.formulations import memory
from wsph.formulations.memory import Need
from wsph.simulation.compose import compose, memory_need

METHODS = [("leapfrog", "stress-points"), ("leapfrog", "total-lagrangian"), ("leapfrog", "updated-lagrangian"), ("tsph", "small-strain"), ("ul-tsph", "updated-lagrangian")]  # fmt: skip
CELLS = {1: 5001, 2: 72, 3: 18}


@pytest.fixture
def unbounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """No limit is looked for, which takes most of the time and leaves no array behind."""
    monkeypatch.setattr("wsph.plugins.integrators.limit", lambda integrator: (1.0, "of the test"))


def block(dim: int, method: tuple[str, str], *, run: scenes.Data | None = None, **keys: Any) -> wsph.Scene:
    """A block of more than 5,000 particles."""
    given = {"integrator": method[0], "formulation": method[1], "cfl": 0.1, "guard": "off", **(run or {})}
    return scenes.block(dim, CELLS[dim], run=given, **keys)


def gap(scene: wsph.Scene) -> float:
    """How far the estimate is from what the arrays take, as a part of it."""
    composition = compose(scene)
    assert composition.particles >= 4_890
    return abs(memory_need(scene).arrays / sum(run.system.nbytes for run in composition.bodies) - 1.0)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_estimate_of_a_block_is_what_its_arrays_take(method: tuple[str, str], dim: int, unbounded: None) -> None:
    assert gap(block(dim, method)) < 1e-3


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_estimate_in_single_precision(method: tuple[str, str], dim: int, unbounded: None) -> None:
    assert gap(block(dim, method, run={"precision": "f32"})) < 1e-3


SHAPES = {
    "ring": ({"type": "ring", "center": [0.0, 0.0], "inner": 0.9, "outer": 1.0}, 0.01),
    "sphere": ({"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}, 0.095),
    "cylinder": ({"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 0.0, 10.8], "radius": 1.0}, 0.18),
}


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("name", list(SHAPES))
def test_the_estimate_of_a_staircase_is_within_5_percent(name: str, method: tuple[str, str], unbounded: None) -> None:
    shape, spacing = SHAPES[name]
    run = {"integrator": method[0], "formulation": method[1], "cfl": 0.1, "guard": "off"}
    # Small-strain bodies of two sets have lists at faces alone, and a staircase has more of these than a block.
    within = 0.07 if method[0] == "tsph" else 0.05
    assert gap(scenes.scene(scenes.body(shape, spacing, surface="stairs"), run=run)) < within


def test_the_estimate_of_a_thin_plate_of_two_sets_is_that_of_lists(unbounded: None) -> None:
    """Along the last axis its lines are too short for rows of the lattice to pay."""
    run = {"integrator": "tsph", "cfl": 0.1, "guard": "off"}
    scene = scenes.scene(scenes.body(scenes.box(1.6, 1.6, 0.2), 0.05), run=run)
    assert compose(scene).bodies[0].system.regular == 0.0
    assert gap(scene) < 0.02


LOADED = {"boundary": [scenes.held("-x", 2), {"body": "b", "where": "x >= 1", "traction": {"y": 1e-3}}]}
PARTS: dict[str, tuple[tuple[str, str], dict[str, Any]]] = {
    "loads": (METHODS[0], {"tables": LOADED}),
    "jitter": (METHODS[2], {"jitter": 0.2}),
    "a map": (METHODS[1], {"map": ["x + 0.1*x*y", "y"]}),
    "a turned lattice": (METHODS[0], {"lattice_rotate": 30.0}),
    "a crack": (METHODS[3], {"cracks": [{"from": [0.0, 0.5], "to": [0.25, 0.5]}]}),
    "two bodies": (METHODS[1], {}),
}


@pytest.mark.parametrize("cells", [[17, 18, 19], [16, 18, 20], [9, 9, 65]], ids=str)
def test_so_it_is_where_volumes_are_those_of_blocks(cells: list[int], unbounded: None) -> None:
    """Odd numbers of cells leave blocks that are not whole."""
    sides = [0.05 * n for n in cells]
    body = scenes.body(scenes.box(*sides), 0.05, material=scenes.material("mises", yield_stress=0.01))
    assert gap(scenes.scene(body, run={"formulation": "total-lagrangian", "guard": "off"})) < 0.01


@pytest.mark.parametrize("name", list(PARTS))
def test_the_estimate_knows_loads_lattices_cracks_and_all_bodies(name: str, unbounded: None) -> None:
    method, keys = PARTS[name]
    scene = block(2, method, **keys)
    if name == "two bodies":
        scene = scene.with_(bodies=[*scene.data()["bodies"], scenes.body(scenes.box((2.0, 3.0), 1.0), 0.02, "c")])
    assert gap(scene) < 0.02


def test_bodies_that_are_alike_are_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies = [scenes.body(scenes.box((float(k), k + 0.5), 1.0), 0.05, f"b{k}") for k in range(6)]
    bodies[5]["material"] = scenes.material("jaumann")
    scene, measured = scenes.scene(*bodies, run={"formulation": "stress-points"}), []
    original = memory._learned
    monkeypatch.setattr(memory, "_learned", lambda *given: (measured.append(given[1].body.name), original(*given))[1])
    need = memory_need(scene)
    assert measured == ["b0", "b5"]
    assert need.arrays == pytest.approx(sum(run.system.nbytes for run in compose(scene).bodies), rel=1e-3)


def free(monkeypatch: pytest.MonkeyPatch, much: float) -> None:
    """From now on so many bytes are free."""
    monkeypatch.setattr(memory, "free_memory", lambda device: (much, much))


@pytest.mark.parametrize("keys", [{}, {"lattice_rotate": 30.0}, {"spacing": [1 / 72, 1 / 48]}], ids=str)
def test_what_does_not_fit_is_refused_with_a_spacing_that_does(
    keys: Any, unbounded: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = block(2, METHODS[0], **keys)
    need = memory_need(scene)
    free(monkeypatch, 0.5 * (need.arrays + need.host))
    with pytest.raises(
        SceneError, match=r"bodies.0.spacing: .* m gives about .* particles, which take .*B free"
    ) as said:
        compose(scene)
    offered = str(said.value).split("a spacing of ")[1].split(" m would fit")[0]
    fitting = scene.with_(
        **{
            "bodies.0.spacing": [float(x) for x in offered.strip("[]").split(", ")]
            if "[" in offered
            else float(offered)
        }
    )
    assert 0.3 < memory_need(fitting).share < 1.0
    assert compose(fitting).particles < 0.5 * need.particles


def test_of_two_bodies_the_larger_is_refused_and_both_spacings_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = block(2, METHODS[1])
    both = scene.with_(bodies=[scenes.body(scenes.box((2.0, 3.0), 1.0), 0.1, "small"), *scene.data()["bodies"]])
    need = memory_need(both)
    free(monkeypatch, 0.5 * (need.arrays + need.host))
    with pytest.raises(
        SceneError, match=r"bodies.1.spacing: .*, and all bodies have about .* spacings of .* for 'small', .* for 'b'"
    ):
        compose(both)


def test_on_a_device_arrays_and_the_host_have_memories_of_their_own() -> None:
    assert Need("cpu", 1.0, 6e9, 5e9, 1e10, 1e10).share > 1.0
    assert Need("cuda:0", 1.0, 6e9, 5e9, 1e10, 1e10).share < 1.0
    assert Need("cuda:0", 1.0, 11e9, 5e9, 1e10, 1e10).share > 1.0
    assert Need("cuda:0", 1.0, 6e9, 11e9, 1e10, 1e10).share > 1.0
    assert Need("cpu", 1.0, 6e15, 5e15, None, None).share == 0.0
    assert "1 GB free on cuda:0 and 20 GB free on the host" in str(Need("cuda:0", 1.0, 6e9, 5e9, 1e9, 2e10))


def test_a_block_of_27_million_particles_is_refused_within_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    free(monkeypatch, 5e9)
    compose(scenes.block(3, 4, run={"formulation": "stress-points"}))  # its kernels are compiled now
    scene, start = scenes.block(3, 300, run={"formulation": "stress-points"}), time.process_time()
    with pytest.raises(SceneError, match="gives about 2.73e\\+07 particles"):
        compose(scene)
    assert time.process_time() - start < 5.0


def test_what_a_limit_of_the_process_does_not_leave_is_refused(tmp_path: Path) -> None:
    """1.1e6 particles in 940 MB of addresses, most of which Python and Warp take."""
    run = '[run]\nintegrator = "leapfrog"\nend = 0.001\ncfl = 0.5\nthreads = 1\n'
    shape = 'shape = { type = "box", min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }\nspacing = 0.01\n'
    material = 'material = { model = "elastic", density = 1000.0, youngs_modulus = 1e7, poisson_ratio = 0.3 }\n'
    (tmp_path / "s.toml").write_text(f'schema = 1\ndim = 3\n{run}[[bodies]]\nname = "b"\n{shape}{material}')
    done = subprocess.run(
        [sys.executable, "-m", "wsph.cli", "run", str(tmp_path / "s.toml"), "-o", str(tmp_path / "out"), "--quiet"],
        capture_output=True, text=True, check=False, timeout=120, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (940_000 * 1024, 940_000 * 1024)),
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "bodies.0.spacing" in done.stderr
    assert "would fit" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("error", [MemoryError(), MemoryError("Unable to allocate 7 GiB"), RuntimeError("Failed to allocate 12 bytes on device 'cpu'")], ids=str)  # fmt: skip
@pytest.mark.parametrize("place", ["the lattice", "an integrator's states"])
def test_memory_that_ends_all_the_same_is_a_sentence(
    place: str, error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def ends(*_: object, **__: object) -> None:
        raise error

    target = (
        "wsph.simulation.composing.setting.geometry_of"
        if place == "the lattice"
        else "wsph.formulations.one_set.OneSetSystem.new"
    )
    monkeypatch.setattr(target, ends)
    (tmp_path / "s.toml").write_text(
        'schema = 1\ndim = 1\n[run]\nintegrator = "leapfrog"\nend = 1.0\ncfl = 0.5\n[[bodies]]\nname = "b"\nstate = "stress"\n'
        'shape = { type = "box", min = [0.0], max = [1.0] }\nspacing = 0.1\n'
        'material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.3 }\n'
    )
    assert main(["run", str(tmp_path / "s.toml"), "-o", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: out of memory: ")
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()
