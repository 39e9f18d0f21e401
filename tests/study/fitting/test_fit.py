"""Fits: what was put in comes out, and the scatter that is said of it is that of repeated fits."""

import importlib.util
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from wsph import Scene
from wsph.errors import Refused, SceneError, WsphError
from wsph.study.fitting.curves import Curves, Sample, check_curves, computed, read_curves
from wsph.study.fitting.fit import Fit, fit
from wsph.study.fitting.parameters import Parameter, check_parameters, read_parameter, with_values

needs_scipy = pytest.mark.skipif(importlib.util.find_spec("scipy") is None, reason='needs the extra "calibrate"')

TRUE = np.array([200.0, 300.0])
"""Young's modulus [GPa] and yield stress [MPa]."""
FREE = ("bodies.0.material.youngs_modulus=100..300 GPa @150", "bodies.0.material.yield_stress=100..600 MPa @450")
NAMES = ("mid.stress_xx", "mid.velocity_x")
TIMES = np.linspace(2e-6, 1.49e-4, 60)


def bar(cells: int) -> Scene:
    """A bar of steel that is pulled beyond its yield stress, so fast that waves are seen."""
    steel = {
        "model": "mises",
        "density": 7850.0,
        "youngs_modulus": "200 GPa",
        "poisson_ratio": 0.0,
        "yield_stress": "300 MPa",
        "hardening_modulus": "20 GPa",
    }
    shape = {"type": "box", "min": [0.0], "max": [0.1]}
    body = {"name": "bar", "shape": shape, "spacing": {"cells": cells}, "state": "stress", "material": steel}
    pulled = {"body": "bar", "face": "+x", "velocity": {"x": "pull"}}
    return Scene(
        schema=1,
        dim=1,
        run={"integrator": "leapfrog", "formulation": "total-lagrangian", "end": "150 us", "cfl": 0.5},
        bodies=[body],
        functions={"pull": {"t": [0.0, 5e-5, 1.5e-4], "value": [0.0, 5.0, 5.0]}},
        boundary=[{"body": "bar", "face": "-x", "fixed": ["x"]}, pulled],
        probes=[{"name": "mid", "at": [[0.05]], "fields": ["stress_xx", "velocity_x"], "every": "1 us"}],
    )


def noisy(values: np.ndarray, part: float, seed: int) -> Curves:
    """Curves with noise of a part of their size."""
    size = np.sqrt((values**2).mean(axis=1))[:, None]
    return Curves(
        NAMES[: len(values)], TIMES, values + part * size * np.random.default_rng(seed).standard_normal(values.shape)
    )


def parameters(scene: Scene) -> list[Parameter]:
    """What is fitted."""
    return [read_parameter(each, scene) for each in FREE]


@needs_scipy
def test_a_modulus_and_a_yield_stress_come_out_of_a_finer_run_with_noise() -> None:
    """The mesh is the last per cent: 16 cells against 64."""
    scene = bar(16)
    curves = noisy(computed(NAMES, TIMES, bar(64)).values, 0.02, 1)
    found = fit(scene, curves, parameters(scene), lambda scenes: [computed(NAMES, TIMES, each) for each in scenes])
    assert found.converged
    assert not found.at_bounds
    assert found.values == pytest.approx(TRUE, rel=0.015)
    assert found.model.units == ("Pa", "m/s")
    assert found.scatter == pytest.approx([0.02, 0.02], rel=0.5)
    assert (found.deviations < 0.01 * TRUE).all()
    assert abs(found.correlation[0, 1]) < 0.6


def straight(scenes: Sequence[Scene]) -> list[Sample]:
    """Stress of a strain that grows evenly, elastic to the yield stress and at 20 GPa beyond: what runs cost nothing of."""
    made: list[Sample] = []
    for scene in scenes:
        material = scene.data()["bodies"][0]["material"]  # type: ignore[index]
        modulus, limit = (float(material[key].split()[0]) * unit for key, unit in (("youngs_modulus", 1e9), ("yield_stress", 1e6)))  # fmt: skip
        strain = TIMES / TIMES[-1] * 5e-3
        values = np.minimum(modulus * strain, limit + 2e10 * (strain - limit / modulus))
        made.append(Sample(values[None, :], ("Pa",)))
    return made


@needs_scipy
def test_the_covariance_is_that_of_repeated_noise() -> None:
    scene = bar(16)
    free = parameters(scene)
    (true,) = straight([with_values(scene, free, np.array([0.5, 0.4]))])
    found = [fit(scene, noisy(true.values, 0.02, seed), free, straight) for seed in range(80)]
    values = np.array([each.values for each in found])
    said = np.mean([each.covariance * np.outer(each.ranges, each.ranges) for each in found], axis=0)
    seen = np.cov(values.T)
    assert np.abs(values.mean(axis=0) - TRUE) == pytest.approx(0.0, abs=float(4.0 * np.sqrt(seen.max() / 80.0)))
    # 80 fits know a variance to 16 %.
    assert np.diag(said) == pytest.approx(np.diag(seen), rel=0.5)
    assert said[0, 1] / np.sqrt(said[0, 0] * said[1, 1]) == pytest.approx(np.corrcoef(values.T)[0, 1], abs=0.25)
    inside = np.mean([np.abs(each.values - TRUE) < 2.0 * each.deviations for each in found])
    assert inside > 0.88


@needs_scipy
def test_findings_of_a_bad_fit() -> None:
    """The yield stress is never reached: nothing is known of it; and a modulus beyond its bound."""
    scene = bar(16)
    free = [read_parameter("bodies.0.material.youngs_modulus=100..150 GPa", scene)]
    (true,) = straight([with_values(scene, parameters(scene), np.array([0.5, 1.0]))])
    found: Fit = fit(scene, noisy(true.values, 1e-3, 1), free, straight)
    assert found.at_bounds == ["bodies.0.material.youngs_modulus"]
    assert found.following[0] > 0.9


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("bodies.0.material.youngs_modulus", "write it as KEY=LOW..HIGH UNIT"),
        ("bodies.0.material.youngs_modulus=3..1 GPa", "3 is not below 1"),
        ("bodies.0.material.youngs_modulus=1..3 GPaa", "unknown unit 'GPaa'; did you mean 'GPa'?"),
        ("bodies.0.material.youngs_modulus=1..3 GPa @ 4", "its start 4 is not between 1 and 3"),
        ("bodies.0.material.youngs_modulus=1..3 m", "'3 m' is not in units of Pa|'1 m' is not in units of Pa"),
        ("bodies.0.material.youngs_modulu=1..3 GPa", "youngs_modulu: unknown key; did you mean 'youngs_modulus'"),
        ("bodies.0.material.youngs_modulus=-1..3 GPa", "youngs_modulus"),
        ("bodies.1.material.youngs_modulus=1..3 GPa", "there is no entry '1'"),
    ],
)
def test_parameters_at_fault(text: str, message: str) -> None:
    scene = bar(16)
    with pytest.raises(WsphError, match=message):
        check_parameters([read_parameter(text, scene)], scene)


def test_a_search_starts_where_the_scene_is() -> None:
    scene = bar(16)
    key = "bodies.0.material.youngs_modulus"
    assert read_parameter(f"{key}=100..240 GPa", scene).start == 200.0
    assert read_parameter(f"{key}=100e3..240e3 MPa", scene).start == 200e3
    assert read_parameter(f"{key}=100..140 GPa", scene).start == 120.0
    assert read_parameter(f"{key}=1e11..3e11", scene).written(2.5e11) == 2.5e11
    with pytest.raises(WsphError, match="nothing to fit"):
        check_parameters([], scene)
    with pytest.raises(WsphError, match="one of them is given twice"):
        check_parameters([read_parameter(f"{key}=1e11..3e11", scene)] * 2, scene)


DATA = {
    "": "is empty",
    "t,mid.stress_xx\n": "line 1: begins with t, mid.stress_xx: its columns are time",
    "time,mid.stress_xx\n1e-5,1\n1e-5,2\n": "its times do not rise",
    "time,mid.stress_xx\n1e-5,1,3\n": "line 2: has 3 cells, the first line 2",
    "time,mid.stress_xx\n1e-5,one\n": "line 2: could not convert string to float: 'one'",
    "time,mid.stress_xx\n1e-5,\n2e-5,0\n": "column mid.stress_xx has no number other than zero",
    "time,mid.stress_xx\n1e-5,1\n1,2\n": "is of 1e-05 to 1 s, the run of 0 to 0.00015 s",
    "time,end.stress_xx\n1e-5,1\n": "column end.stress_xx is of no probe; there is mid",
}


@pytest.mark.parametrize("text", DATA)
def test_data_at_fault(text: str, tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(SceneError, match=DATA[text]):
        check_curves(read_curves(path), bar(16), path)


def test_cells_that_are_empty_are_not_compared(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("time,mid.stress_xx,mid.velocity_x\n1e-5,3,\n2e-5,4,2\n")
    curves = read_curves(path)
    assert np.isnan(curves.values).tolist() == [[False, False], [True, False]]
    assert curves.sizes == pytest.approx([np.sqrt(12.5), 2.0])


@pytest.mark.filterwarnings("ignore:step .* energy was created")
def test_a_run_that_does_not_end_or_has_no_such_column_is_named() -> None:
    with pytest.raises(
        SceneError, match=r"no column mid.stress_yy is recorded; there is mid.stress_xx, mid.velocity_x"
    ):
        computed(("mid.stress_yy",), TIMES, bar(8))
    wild = bar(8).with_(stop={"energy": 1e-9})
    with pytest.raises(Refused, match="did not come to its end"):
        computed(NAMES, TIMES, wild)
