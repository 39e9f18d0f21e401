"""Resumed runs are straight runs, byte for byte; what is no checkpoint of the scene is refused by name."""

import json
import signal
from pathlib import Path

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.distributions import install
from wsph.cli import main
from wsph.errors import CheckpointError
from wsph.simulation import checkpoint
from wsph.validation.meshes import around, moved_grid, write


def block(**run: object) -> wsph.Scene:
    """A square that is pulled, with gravity and damping, probes and frames."""
    probes = [{"name": "every", "at": [[0.5, 0.5]], "fields": ["stress_xx", "velocity"], "every": 1},
              {"name": "seldom", "at": [[0.7, 0.5]], "fields": ["velocity_x"], "every": 7}]  # fmt: skip
    tables = {"boundary": [scenes.driven("+x", x="0.01*(1+t)"), scenes.held("-x", 2)], "probes": probes, "gravity": {"y": -0.01},
              "output": {"every": 9, "history": 5, "formats": ["npz", "vtu"]}}  # fmt: skip
    return scenes.block(
        cells=8, run={"end": 1.2, **run}, tables=tables, velocity=["0.01*x", "0"], damping={"rate": 0.1}
    )


def files(folder: Path) -> dict[str, bytes]:
    """Everything that a run wrote, but its summary and its checkpoints."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "summary.json" and "checkpoints" not in path.parts
    }


RUNS = [
    {"integrator": "leapfrog", "formulation": "stress-points"},
    {"integrator": "leapfrog", "formulation": "total-lagrangian"},
    {"integrator": "leapfrog", "formulation": "updated-lagrangian"},
    {"integrator": "leapfrog", "formulation": "total-lagrangian", "precision": "f32"},
    {"integrator": "rk4", "formulation": "stress-points"},
    {"integrator": "rk4", "formulation": "updated-lagrangian"},
    {"integrator": "kg4-8", "formulation": "total-lagrangian"},
    {"integrator": "w20-2-8", "formulation": "stress-points"},
    {"integrator": "blanes-moan4", "formulation": "stress-points"},
    {"integrator": "lf4", "formulation": "total-lagrangian"},
    {"integrator": {"name": "rkc", "stages": 4}, "formulation": "total-lagrangian"},
    {"integrator": "tsph"},
    {"integrator": "ul-tsph"},
]
SOME = [
    (r["integrator"]["name"] if isinstance(r["integrator"], dict) else r["integrator"], r.get("formulation"))
    for r in RUNS
]
OTHERS = [
    {
        "integrator": {"name": "rkc", "stages": 4} if name == "rkc" else name,
        "formulation": formulation,
        "guard": "off",
        **({"dt": 0.01} if name == "euler" else {}),
    }
    for name in ("euler", "rk2", "pc2", "rk4", "leapfrog", "rkc", "kg4-8", "w20-2-8", "lf4", "blanes-moan4")
    for formulation in ("stress-points", "total-lagrangian", "updated-lagrangian")
    if (name, formulation) not in SOME
    # What gradients of points do not see stays undamped, which rkc amplifies; processed methods take no forces that follow
    # the motion.
    and (name, formulation)
    not in (("rkc", "stress-points"), ("lf4", "updated-lagrangian"), ("blanes-moan4", "updated-lagrangian"))
]


@pytest.mark.filterwarnings("ignore:.*energy was created")
@pytest.mark.parametrize("run", [*RUNS, *(pytest.param(run, marks=pytest.mark.slow) for run in OTHERS)], ids=str)
def test_resumed_is_straight_byte_for_byte(run: dict, tmp_path: Path) -> None:
    scene = block(**run)
    data = scene.data()
    if run["integrator"] in ("lf4", "blanes-moan4"):
        del data["bodies"][0]["damping"]
    if run["integrator"] == "lf4":
        data["boundary"] = [scenes.held("-x", 2)]
    if isinstance(run["integrator"], dict):
        data["bodies"][0]["viscosity"] = {"alpha": 1.0, "kind": "pair"}
    scene = wsph.Scene(**data)
    straight = wsph.run(scene, tmp_path / "straight")
    steps = straight.summary["steps"]
    half = scene.with_(checkpoint={"every": 4}, **{"run.dt": straight.summary["dt"]})
    scene = scene.with_(**{"run.dt": straight.summary["dt"]})
    straight = wsph.run(scene, tmp_path / "straight", overwrite=True)
    cut = half.with_(end=straight.summary["dt"] * (steps // 2))
    wsph.run(cut, tmp_path / "resumed")
    kept = checkpoint.listed(tmp_path / "resumed" / "checkpoints")
    assert len(kept) == 2
    resumed = wsph.run(scene, tmp_path / "resumed", resume=True)
    assert resumed.summary["steps"] == steps
    for name, values in straight.particles.items():
        assert np.array_equal(values, resumed.particles[name], equal_nan=True), name
    a, b = files(tmp_path / "straight"), files(tmp_path / "resumed")
    assert a.keys() == b.keys()
    for name in a:
        assert a[name] == b[name], name
    assert straight.summary["energy"] == resumed.summary["energy"]


@pytest.mark.parametrize(("model", "keys"), [
    ("perzyna", {"yield_stress": 2e-3, "hardening_modulus": 0.1, "fluidity": 0.05, "exponent": 1.0}),
    ("mises", {"yield_stress": 2e-3}),
], ids=["perzyna", "mises"])  # fmt: skip
def test_internals_are_kept(model: str, keys: dict, tmp_path: Path) -> None:
    scene = block(dt=0.02).with_(**{"bodies.0.material": scenes.material(model, **keys)})
    straight = wsph.run(scene)
    wsph.run(scene.with_(end=0.5, checkpoint={"every": 10}), tmp_path / "out")
    resumed = wsph.run(scene, tmp_path / "out", resume=True)
    assert np.array_equal(straight.particles["stress"], resumed.particles["stress"])
    assert straight.summary["energy"] == resumed.summary["energy"]


BREAKING = {
    "phase field": {"phase_field": {"fracture_energy": 1e-4, "length": 0.2}},
    "phase field, evolved stress": {
        "phase_field": {"fracture_energy": 1e-4, "length": 0.2},
        "material.model": "jaumann",
    },
    "links": {"links": {"criterion": "stretch", "threshold": 0.02}, "material.model": "jaumann"},
}


DISC = {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}


def test_what_acts_on_a_fitted_surface_is_kept(tmp_path: Path) -> None:
    """Works of a pressure that changes in time, springs and sliding go on where they were."""
    boundary = [{"body": "b", "where": "x > 0.3", "pressure": "1e-2*(1 + t)"}, {"body": "b", "where": "x < -0.3", "spring": {"stiffness": 1.0}},
                {"body": "b", "where": "y < -0.3", "normal": "1e-2*t"}]  # fmt: skip
    scene = scenes.scene(scenes.body(DISC, 0.1), boundary=boundary, output={"every": 9, "history": 3})
    wsph.run(scene, tmp_path / "whole")
    wsph.run(scene.with_(**{"end": 0.5, "checkpoint": {"every": 5}}), tmp_path / "parts")
    wsph.run(scene.with_(**{"checkpoint": {"every": 5}}), tmp_path / "parts", resume=True)
    assert files(tmp_path / "parts") == files(tmp_path / "whole")


def test_a_body_from_another_file_is_refused(tmp_path: Path) -> None:
    """Nodes that have moved in the file are another body, though nothing in the scene says so."""
    path, (nodes, corners) = tmp_path / "square.vtu", moved_grid((1.0, 1.0), (4, 4), 0.0)
    write(path, nodes, quad=around(corners))
    body = {
        "name": "b",
        "mesh": {"file": str(path)},
        "state": "strain",
        "material": scenes.material(),
        "velocity": ["x", "0"],
    }
    run = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.3}
    scene = wsph.Scene(schema=1, dim=2, run=run, bodies=[body], checkpoint={"every": 2})
    wsph.run(scene, tmp_path / "out")
    wsph.run(scene, tmp_path / "out", resume=True, end=1.5)
    write(path, nodes * 1.01, quad=around(corners))
    with pytest.raises(CheckpointError, match=r"is of another scene: content of bodies.0.mesh.file is"):
        wsph.run(scene, tmp_path / "out", resume=True, end=2.0)


@pytest.mark.filterwarnings("ignore:.*follow the lattice", "ignore:.*energy was created")
@pytest.mark.parametrize(
    "part", [pytest.param("phase field", marks=pytest.mark.slow), "phase field, evolved stress", "links"]
)
def test_what_is_broken_and_what_touches_are_kept(part: str, tmp_path: Path) -> None:
    changes = {f"bodies.0.{key}": value for key, value in BREAKING[part].items()}
    scene = block(dt=0.02, formulation="total-lagrangian").with_(**{"bodies.0.velocity": ["0.1*x", "0"], **changes})
    other = {**scene.data()["bodies"][0], "name": "c", "velocity": ["-0.2", "0"]}
    other["shape"] = scenes.box((1.05, 2.05), 1.0)
    data = scene.data()
    data["bodies"].append(other)
    data["contact"] = [
        {"between": ["b", "c"], "law": "pinball", "friction": 0.1},
        {"self": "b", "law": "pinball"},
    ]
    data["output"]["fields"] = ["velocity", "stress", "damage"]
    scene = wsph.Scene(**data)
    straight = wsph.run(scene, tmp_path / "straight")
    assert straight.field("damage").max() > 0.5
    assert straight.history["contact"].max() > 0.0
    wsph.run(scene.with_(end=0.7, checkpoint={"every": 10}), tmp_path / "resumed")
    wsph.run(scene, tmp_path / "resumed", resume=True)
    assert files(tmp_path / "straight") == files(tmp_path / "resumed")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
def test_an_interrupt_leaves_a_checkpoint_and_resuming_ends_the_run(tmp_path: Path, number: int) -> None:
    scene = block(dt=0.02)
    straight = wsph.run(scene, tmp_path / "straight")

    def stop(step: int, steps: int, time: float) -> None:
        if step >= 20:
            signal.raise_signal(number)

    cut = wsph.run(scene, tmp_path / "cut", throw=False, progress=stop)
    assert cut.status == "interrupted"
    assert len(checkpoint.listed(tmp_path / "cut" / "checkpoints")) == 1
    resumed = wsph.run(scene, tmp_path / "cut", resume=True)
    assert resumed.status == "completed"
    assert np.array_equal(straight.particles["velocity"], resumed.particles["velocity"])
    a, b = files(tmp_path / "straight"), files(tmp_path / "cut")
    assert a == b


def test_the_last_ones_stay(tmp_path: Path) -> None:
    wsph.run(block(dt=0.02, end=0.8).with_(checkpoint={"every": 5, "keep": 3}), tmp_path / "out")
    assert [p.name for p in checkpoint.listed(tmp_path / "out" / "checkpoints")] == [
        f"checkpoint_{step:012d}.npz" for step in (25, 30, 35)
    ]


def test_wall_time_and_what_is_no_cadence(tmp_path: Path) -> None:
    wsph.run(block(dt=0.02, end=0.8).with_(checkpoint={"every": "1 us"}), tmp_path / "out")
    assert checkpoint.listed(tmp_path / "out" / "checkpoints")
    with pytest.raises(wsph.SceneError, match=r"checkpoint.every: 0.5 is no number of steps"):
        block().with_(checkpoint={"every": 0.5})
    with pytest.raises(wsph.SceneError, match=r"checkpoint.keep: 0: must be greater than or equal to 1"):
        block().with_(checkpoint={"every": 5, "keep": 0})


def run_and_cut(folder: Path) -> Path:
    """A run with checkpoints; the last of them."""
    wsph.run(block(dt=0.02, end=0.5).with_(checkpoint={"every": 10}), folder)
    return checkpoint.listed(folder / "checkpoints")[-1]


DAMAGE = {
    "cut off": lambda whole: whole[: len(whole) // 2],
    "empty": lambda whole: b"",
    "zeros": lambda whole: bytes(len(whole)),
    "a bit flipped": lambda whole: whole[:-100] + bytes([whole[-100] ^ 4]) + whole[-99:],
    "another file": lambda whole: b"PK\x03\x04" + whole,
}


@pytest.mark.parametrize("damage", list(DAMAGE))
def test_a_damaged_one_is_passed_over_for_the_one_before(damage: str, tmp_path: Path) -> None:
    scene = block(dt=0.02).with_(checkpoint={"every": 10, "keep": 3})
    straight = wsph.run(scene, tmp_path / "straight")
    wsph.run(scene.with_(end=0.7), tmp_path / "out")
    *_, before, last = checkpoint.listed(tmp_path / "out" / "checkpoints")
    last.write_bytes(DAMAGE[damage](last.read_bytes()))
    with pytest.warns(RuntimeWarning, match=rf"{last.name}: is .*; the run goes on from the one before, {before.name}"):
        resumed = wsph.run(scene.with_(end=1.2), tmp_path / "out", resume=True)
    assert resumed.summary["energy"] == straight.summary["energy"]
    assert files(tmp_path / "straight") == files(tmp_path / "out")
    for path in checkpoint.listed(tmp_path / "out" / "checkpoints"):
        checkpoint.read(path)


def test_a_damaged_one_does_not_take_the_place_of_one_to_come(tmp_path: Path) -> None:
    """Where the next are of other steps."""
    run_and_cut(tmp_path / "out").write_bytes(b"")
    with pytest.warns(RuntimeWarning, match="the run goes on from the one before"):
        wsph.run(block(dt=0.02, end=0.5).with_(checkpoint={"every": 7}), tmp_path / "out", resume=True)
    steps = [checkpoint.read(path)[0]["step"] for path in checkpoint.listed(tmp_path / "out" / "checkpoints")]
    assert steps == [14, 21]


def test_where_none_is_whole_it_is_refused(tmp_path: Path) -> None:
    run_and_cut(tmp_path / "out")
    for path in checkpoint.listed(tmp_path / "out" / "checkpoints"):
        path.write_bytes(b"")
    before = files(tmp_path / "out")
    with pytest.raises(
        wsph.WsphError, match="checkpoint_000000000020.npz: is .*; .*checkpoint_000000000010.npz: is .*: none is whole"
    ):
        wsph.run(block(dt=0.02), tmp_path / "out", resume=True)
    assert files(tmp_path / "out") == before


MATERIAL = """
from dataclasses import dataclass, field
from wsph_materials.elastic import Elastic

@dataclass(frozen=True)
class Plugin(Elastic):
    pass
"""


def test_other_plugins_are_refused_with_both_named(here: Path) -> None:
    install(here, "some-laws", "material", "some_laws", MATERIAL)
    scene = block(dt=0.02).with_(**{"bodies.0.material.model": "broken", "checkpoint": {"every": 10}})
    wsph.run(scene.with_(end=0.5), here / "out")
    install(here, "some-laws", "material", "some_laws", MATERIAL, version="4.3")
    with pytest.raises(
        wsph.WsphError,
        match="version of material broken is 'some-laws 4.2' there and 'some-laws 4.3' here; run without",
    ):
        wsph.run(scene, here / "out", resume=True)
    install(here, "some-laws", "material", "some_laws", MATERIAL, version="4.2")
    assert wsph.run(scene, here / "out", resume=True).status == "completed"


class TestRefused:
    """By name, leaving the folder as it was."""

    @pytest.mark.parametrize(("key", "value", "what"), [
        ("bodies.0.spacing", 0.25, "bodies.0.spacing is 0.125 there and 0.25 here"),
        ("run.precision", "f32", "run.precision is 'f64' there and 'f32' here"),
        ("run.dt", 0.01, "run.dt is 0.02 there"),
        ("bodies.0.material.poisson_ratio", 0.2, "poisson_ratio is 0.3 there"),
        ("run.integrator", "rk4", "run.integrator"),
    ])  # fmt: skip
    def test_another_scene(self, key: str, value: object, what: str, tmp_path: Path) -> None:
        run_and_cut(tmp_path / "out")
        before = files(tmp_path / "out")
        with pytest.raises(wsph.WsphError, match=f"is of another scene: .*{what}"):
            wsph.run(block(dt=0.02).with_(**{key: value}), tmp_path / "out", resume=True)
        assert files(tmp_path / "out") == before

    def test_other_output_is_no_other_scene(self, tmp_path: Path) -> None:
        run_and_cut(tmp_path / "out")
        probe = {"name": "new", "at": [[0.3, 0.5]], "fields": ["velocity_x"], "every": 1}
        scene = block(dt=0.02).with_(
            title="longer", threads=1, stop={"energy": 0.5}, output={"every": 5}, probes=[probe]
        )
        with pytest.warns(
            RuntimeWarning, match="probe 'new' is not one of the checkpoint's: its record begins at step 20"
        ):
            result = wsph.run(scene, tmp_path / "out", resume=True)
        assert result.status == "completed"
        assert result.probes["new"]["time"][0] == pytest.approx(0.42)

    def test_cut_off_or_altered_anywhere(self, tmp_path: Path) -> None:
        path = run_and_cut(tmp_path / "out")
        whole = path.read_bytes()
        places = np.linspace(0, len(whole) - 1, 50).astype(int)
        for at in places:
            path.write_bytes(whole[:at])
            with pytest.raises(wsph.WsphError, match="is no checkpoint|is cut off or altered"):
                checkpoint.read(path)
            path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
            with pytest.raises(wsph.WsphError, match="is no checkpoint|is cut off or altered"):
                checkpoint.read(path)
        path.write_bytes(whole)
        assert checkpoint.read(path)[0]["step"] == 20

    def test_nothing_to_resume_from_and_nowhere_left_to_go(self, tmp_path: Path) -> None:
        with pytest.raises(wsph.WsphError, match="holds no checkpoint to resume from"):
            wsph.run(block(dt=0.02), tmp_path / "empty", resume=True)
        assert not (tmp_path / "empty").exists()
        run_and_cut(tmp_path / "out")
        with pytest.raises(wsph.WsphError, match=r"stands at step 20; the run ends at step 10: raise run.end"):
            wsph.run(block(dt=0.02, end=0.2), tmp_path / "out", resume=True)
        with pytest.raises(wsph.WsphError, match="without overwrite"):
            wsph.run(block(dt=0.02), tmp_path / "out", resume=True, overwrite=True)
        with pytest.raises(wsph.WsphError, match="name the folder"):
            wsph.run(block(dt=0.02), resume=True)


def test_from_the_shell(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    text = (Path(__file__).parents[2] / "examples" / "shock_bar.toml").read_text()
    path = tmp_path / "bar.toml"
    path.write_text(text + "\n[checkpoint]\nevery = 50\n")
    out = str(tmp_path / "bar-out")
    assert main(["run", str(path), "-o", out, "--set", "run.end=0.006", "--quiet"]) == 0
    assert main(["run", str(path), "-o", out, "--resume", "--quiet"]) == 0
    assert json.loads((tmp_path / "bar-out" / "summary.json").read_text())["status"] == "completed"
    assert main(["run", str(path), "-o", out, "--resume", "--quiet", "--set", "run.cfl=0.5"]) == 2
    assert "is of another scene: run.cfl" in capsys.readouterr().err
