"""Initial stress and initial states: bars at rest, columns in balance, waves, energy; what does not fit is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.checking import described
from wsph.errors import Refused, SceneError

FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "updated-lagrangian"},
    {"integrator": "tsph"},
    {"integrator": "ul-tsph"},
]
LAWS = ["elastic", "neo-hookean", "jaumann", "mises", "perzyna"]
TWO_SETS = ("jaumann", "mises", "perzyna", "elastic")


def law(model: str) -> dict[str, Any]:
    flows = {"yield_stress": 0.01, "hardening_modulus": 0.1}
    more = {"mises": flows, "perzyna": {**flows, "fluidity": 0.1, "exponent": 1.0}}
    return scenes.material(model, **more.get(model, {}))


def between_ends(dim: int, run: dict[str, Any], model: str, **keys: Any) -> wsph.Scene:
    """A bar or block that pulls at two held ends, its sides free."""
    ends = [scenes.held("-x", dim), scenes.held("+x", dim)]
    keys = {"initial": {"stress": {"xx": 1e-3}}, "material": law(model), **keys}
    tables = {"boundary": ends, "output": {"history": 1}}
    return scenes.block(dim, {1: 20, 2: 8, 3: 4}[dim], run={"end": 2.0, **run}, tables=tables, **keys)


def cases() -> list[Any]:
    found = []
    for run in FORMS:
        for model in LAWS:
            if "integrator" in run and model not in TWO_SETS:
                continue
            found += [
                pytest.param(run, model, dim, id=f"{next(iter(run.values()))}-{model}-{dim}") for dim in (1, 2, 3)
            ]
    return found


@pytest.mark.parametrize(("run", "model", "dim"), cases())
def test_a_prestressed_bar_stays_at_rest(run: dict[str, Any], model: str, dim: int) -> None:
    state = {"state": "stress"} if dim < 3 else {}
    result = wsph.run(between_ends(dim, run, model, **state))
    # Speeds to rounding of the stress over the impedance 1.
    assert np.abs(result.particles["velocity"]).max() < 1e-15
    # The energy of the stress: s^2/(2 E) where its sides are free.
    assert result.history["strain"] == pytest.approx(0.5e-6, rel=1e-12)
    assert np.abs(result.history["residual"]).max() < 1e-20
    assert result.particles["stress"][:, 0] == pytest.approx(1e-3, rel=1e-12)


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_in_single_precision_and_plane_strain(run: dict[str, Any]) -> None:
    result = wsph.run(between_ends(2, {**run, "precision": "f32"}, "jaumann"))
    # To roundings of single precision, 1.2e-7 of the stress, summed up over two times of a wave across.
    assert np.abs(result.particles["velocity"]).max() < 1e-8


@pytest.mark.parametrize("ratio", [0.3, 0.49])
def test_volumes_of_blocks(ratio: float) -> None:
    """Where volumes are averaged over blocks of particles an initial stress is the law's all the same."""
    material = scenes.material(poisson_ratio=ratio)
    run = {"formulation": "total-lagrangian", "cfl": 0.1}
    result = wsph.run(between_ends(2, run, "elastic", material=material))
    assert np.abs(result.particles["velocity"]).max() < 1e-15


@pytest.mark.parametrize("name", ["rk4", "lf4", "blanes-moan4", "kg4-8"])
def test_by_every_method(name: str) -> None:
    assert np.abs(wsph.run(between_ends(2, {"integrator": name}, "elastic")).particles["velocity"]).max() < 1e-15


@pytest.mark.parametrize("run", FORMS, ids=str)
@pytest.mark.parametrize("model", ["elastic", "jaumann"])
def test_a_column_in_balance_with_its_weight(run: dict[str, Any], model: str) -> None:
    tables = {"boundary": [scenes.held("-x", 1)], "gravity": {"x": -1e-4}, "output": {"history": 1}}
    weight = {"stress": {"xx": "-1e-4*(1 - x)"}}
    result = wsph.run(scenes.bar(40, run={"end": 4.0, **run}, tables=tables, initial=weight, material=law(model)))
    part = (result.history["kinetic"] / result.history["strain"]).max()
    if run.get("formulation") in ("total-lagrangian", "updated-lagrangian"):
        # Averages and kernels see the end's cells: what is out of balance there is of second order in the spacing.
        assert part < 1e-4
        coarse = wsph.run(scenes.bar(20, run={"end": 4.0, **run}, tables=tables, initial=weight, material=law(model)))
        assert part < 0.5 * (coarse.history["kinetic"] / coarse.history["strain"]).max()
    else:
        assert part < 1e-28


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_waves_run_as_fast_as_before(run: dict[str, Any]) -> None:
    """Pulses through a bar without and with stress: the small strains of the waves add to it."""

    def speed(stress: float) -> float:
        probe = {"name": "p", "at": [[0.6], [0.8]], "fields": ["velocity"], "every": 1}
        tables = {"boundary": [scenes.held("-x", 1), scenes.held("+x", 1)], "probes": [probe]}
        keys = {"initial": {"stress": {"xx": stress}}} if stress else {}
        velocity = ["1e-6*exp(-((x - 0.4)/0.04)^2)"]
        scene = scenes.bar(
            100, run={"end": 0.55, "cfl": 0.45, **run}, tables=tables, velocity=velocity, model="jaumann", **keys
        )
        found = wsph.run(scene).probes["p"]
        passed = []
        for k in (0, 1):
            pulse = found[f"velocity_x[{k}]"]
            passed.append((found["time"] * pulse**2).sum() / (pulse**2).sum())
        return 0.2 / (passed[1] - passed[0])

    bare = speed(0.0)
    # Of the order of the strain, 1e-4, that the stress would be in an elastic bar.
    assert speed(1e-4) == pytest.approx(bare, rel=3e-4)
    assert speed(-1e-4) == pytest.approx(bare, rel=3e-4)


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian", "updated-lagrangian"])
def test_a_stressed_body_that_turns_keeps_its_energy(form: str) -> None:
    """Free, so that it rings, and turning by a radian: the stress turns with it."""
    scene = scenes.block(2, 8, centred=True, run={"formulation": form, "end": 10.0}, initial={"stress": {"xx": "1e-2*cos(pi*x)"}},
                         velocity=["-0.1*y", "0.1*x"], tables={"output": {"history": 1}})  # fmt: skip
    history = wsph.run(scene).history
    # 1e-6 of all energy: leapfrog's swing at a third of its limit.
    total = history["kinetic"] + history["strain"]
    assert np.abs(history["residual"]).max() < 2e-4 * total[0]
    assert history["strain"].min() < 0.9 * history["strain"][0]


def test_relaxation_settles_what_is_out_of_balance() -> None:
    """A stress that differs from place to place between held ends: at rest it is its mean, and points have moved."""
    probe = {"name": "middle", "at": [[0.25], [0.5]], "fields": ["displacement", "stress_xx"], "every": 1}
    tables = {"boundary": [scenes.held("-x", 1), scenes.held("+x", 1)], "relax": {}, "probes": [probe]}
    found = wsph.run(scenes.bar(40, tables=tables, initial={"stress": {"xx": "1e-4*(1 + cos(2*pi*x))"}})).probes[
        "middle"
    ]
    # du/dx = -1e-4 cos(2 pi x): to sqrt(until) of the energy of what moves, and the spacing's square.
    assert found["displacement_x[0]"][0] == pytest.approx(-1e-4 / (2.0 * np.pi), rel=5e-3)
    assert found["stress_xx[1]"][0] == pytest.approx(1e-4, rel=5e-3)


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_a_stress_that_nothing_carries_is_let_go(form: str) -> None:
    """At rest without stress: what roundings make of its energy is none to be stopped for."""
    tables = {"boundary": [scenes.held("-x", 1)], "relax": {}, "output": {"history": 1, "fields": ["displacement"]}}
    result = wsph.run(scenes.bar(20, run={"formulation": form}, tables=tables, initial={"stress": {"xx": 1e-4}}))
    assert result.status == "completed"
    # P = F (E e + S0) = 0: it is as much shorter as it was stressed, to that squared.
    assert result.particles["displacement"].min() == pytest.approx(-1e-4, rel=1e-3)


STATES = [(run, model) for run in FORMS for model in ("elastic", "jaumann", "mises") if model != "elastic" or "integrator" not in run]  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*energy was lost")
@pytest.mark.parametrize(("run", "model"), STATES, ids=str)
def test_a_body_begins_with_the_state_of_a_checkpoint(run: dict[str, Any], model: str, tmp_path: Path) -> None:
    pulled = [scenes.held("-x", 2), scenes.driven("+x", x="0.01", y="0.005")]
    own = {
        "material": law(model)
        if model != "mises"
        else scenes.material("mises", yield_stress=2e-3, hardening_modulus=0.1)
    }
    fields = ["stress", "displacement"] + (["plastic_strain"] if model == "mises" else [])
    output = {"fields": fields, "history": 1}
    first = wsph.run(scenes.block(2, 8, run={"end": 1.0, **run}, tables={"boundary": pulled, "output": output, "checkpoint": {"final": True}}, **own),
                     tmp_path / "a")  # fmt: skip
    file = max((tmp_path / "a" / "checkpoints").iterdir())
    held = [scenes.held("-x", 2), scenes.held("+x", 2)]
    other = {"boundary": held, "output": {**output, "every": 1}}
    scene = scenes.block(2, 8, run={"end": 0.1, **run}, tables=other, initial={"file": str(file)}, **own)
    second = wsph.run(scene, tmp_path / "b")
    told = dict(described(scene, "scene"))
    assert told["  initial"] == f"the state of 'b' in {file}"
    history = second.history
    assert history["strain"][0] == first.history["strain"][-1]
    assert history["kinetic"][0] == 0.0
    assert abs(history["residual"][0]) < 1e-18
    # What a step of a body that comes to be held swings or loses, as in any run.
    assert np.abs(history["residual"]).max() < 0.03 * history["strain"][0]


def test_units_of_another_run(tmp_path: Path) -> None:
    """A body of a checkpoint beside a faster one, which sets the scales of all: the same state in other units."""
    pulled = {"boundary": [scenes.held("-x", 1), scenes.driven("+x", x="0.01")], "checkpoint": {"final": True},
              "output": {"fields": ["displacement"]}}  # fmt: skip
    first = wsph.run(scenes.bar(10, model="jaumann", run={"end": 1.0}, tables=pulled), tmp_path / "a")
    file = max((tmp_path / "a" / "checkpoints").iterdir())
    own = scenes.body(
        scenes.box(1.0), 0.1, state="stress", material=scenes.material("jaumann"), initial={"file": str(file)}
    )
    fast = scenes.body(
        scenes.box((2.0, 2.5)), 0.05, name="fast", state="stress", material=scenes.material(youngs_modulus=9.0)
    )
    second = wsph.run(
        scenes.scene(fast, own, run={"end": 1e-6, "dt": 1e-6}, output={"fields": ["stress", "displacement"]})
    )
    mine = second.particles["body"] == 1
    assert second.history["strain"][0] == pytest.approx(first.history["strain"][-1], rel=1e-12)
    assert second.particles["displacement"][mine] == pytest.approx(first.particles["displacement"], rel=1e-12)


def test_what_is_no_such_state_is_refused_by_name(tmp_path: Path) -> None:
    tables = {"boundary": [scenes.held("-x", 1)], "checkpoint": {"final": True}, "output": {"formats": ["npz"]}}
    wsph.run(scenes.bar(10, tables=tables), tmp_path / "a")
    file = str(max((tmp_path / "a" / "checkpoints").iterdir()))
    for keys, said in (
        ({"initial": {"file": str(tmp_path / "a" / "frames" / "frame_000000.npz")}}, "is no checkpoint.*a frame has stresses recovered"),
        ({"initial": {"file": str(tmp_path / "none")}}, "no such file"),
        ({"initial": {"file": file}, "name": "other"}, "has no body 'other'; there is b"),
        ({"initial": {"file": file}, "spacing": 0.05}, r"of another body: spacing is 0.1 there and 0.05 here"),
        ({"initial": {"file": file}, "material": scenes.material(poisson_ratio=0.2)}, "of another body: material.poisson_ratio"),
        ({"initial": {"file": file, "stress": {"xx": 1.0}}}, "of another body: initial.stress.xx"),
    ):  # fmt: skip
        with pytest.raises(Refused, match=said):
            wsph.run(scenes.bar(10, **keys))
    with pytest.raises(Refused, match="is of the form 'stress-points', here it is 'total-lagrangian'"):
        wsph.run(scenes.bar(10, run={"formulation": "total-lagrangian"}, initial={"file": file}))


def test_what_cannot_begin_so_is_refused_by_name() -> None:
    for initial, said in (
        ({"temperature": 300.0}, "no law takes a temperature yet"),
        ({}, "says nothing: give stress or file"),
        ({"stress": {"zz": 1.0}}, "is none of xx, yy, xy, the components in plane stress"),
        ({"stress": {"xx": "t"}}, "does not depend on t"),
        ({"stress": {"xx": "z"}}, "uses z"),
        ({"stress": {"xx": "1 m"}}, "Pa"),
    ):
        with pytest.raises(SceneError, match=said):
            scenes.block(2, 4, state="stress", initial=initial)
    with pytest.raises(Refused, match=r"at \(.*\) m is beyond the yield surface of mises"):
        wsph.run(scenes.block(2, 4, material=law("mises"), initial={"stress": {"xx": 0.1}}))
    with pytest.raises(Refused, match="is not finite"):
        wsph.run(scenes.block(2, 4, initial={"stress": {"xx": "1/(x - x)"}}))
    field = {"fracture_energy": 1.0, "length": 0.5}
    with pytest.raises(Refused, match="initial goes with no phase_field"):
        wsph.run(scenes.block(2, 8, initial={"stress": {"xx": 1e-3}}, phase_field=field))


def test_check_tells() -> None:
    told = described(scenes.bar(10, initial={"stress": {"xx": "-1e-4*(1 - x)"}}), "scene")
    assert ("  initial", "stress xx -9.5e-05 to -5e-06 Pa") in told


def test_a_final_checkpoint_is_one_to_go_on_from(tmp_path: Path) -> None:
    tables = {"boundary": [scenes.held("-x", 1)], "checkpoint": {"final": True}}
    scene = scenes.bar(10, tables=tables, velocity=["1e-3*x"])
    wsph.run(scene, tmp_path / "parts")
    wsph.run(scene, tmp_path / "parts", resume=True, end=2.0)
    whole = wsph.run(scene, end=2.0)
    again = np.genfromtxt(tmp_path / "parts" / "history.csv", delimiter=",")[-1]
    assert again[3] == whole.history["kinetic"][-1]
    with pytest.raises(SceneError, match="says not when"):
        scenes.bar(10, tables={"checkpoint": {"keep": 2}})
