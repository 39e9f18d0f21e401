"""Probes of many places, along lines, and of fields that follow from stress and strain."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from wsph.errors import SceneError

STRETCH, SHEAR, STEP = 100.0, 40.0, 1e-5
LENGTH, HEIGHT = 1.0, 0.4
RHO, E = 1000.0, 1e6


def block(form: str, *probes: dict[str, Any], steps: int = 1, **run: Any) -> wsph.Scene:
    """A block that is pulled and sheared: v = (a x + b y, 0), in steps that are short beside the time of a wave."""
    named = [{"name": f"p{k}", **probe} for k, probe in enumerate(probes)]
    body = {
        "name": "block",
        "shape": {"type": "box", "min": [0.0, 0.0], "max": [LENGTH, HEIGHT]},
        "spacing": 0.1,
        "state": "strain",
        "velocity": [f"{STRETCH}*x + {SHEAR}*y", "0"],
        "material": {"model": "elastic", "density": RHO, "youngs_modulus": E, "poisson_ratio": 0.25},
    }
    integrator = "tsph" if form == "small-strain" else "leapfrog"
    times = {"integrator": integrator, "formulation": form, "end": steps * STEP, "dt": STEP, **run}
    return wsph.Scene(schema=1, dim=2, run=times, bodies=[body], probes=named)


INSIDE = "abs(x - 0.5) < 0.26 and abs(y - 0.2) < 0.11"


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_strains_are_those_of_the_motion(form: str) -> None:
    """Inside, where no face is felt yet, H = dt [[a, b], [0, 0]]: Green and Lagrange's strain of it, to rounding."""
    fields = ["strain", "principal_strain_1", "principal_strain_3"]
    probe = wsph.run(block(form, {"at": [[0.5, 0.2]], "fields": fields})).probes["p0"]
    H = STEP * np.array([[STRETCH, SHEAR], [0.0, 0.0]])
    wanted = 0.5 * (H + H.T + H.T @ H)
    assert probe["strain_xx"][-1] == pytest.approx(wanted[0, 0], rel=1e-9)
    assert probe["strain_yy"][-1] == pytest.approx(wanted[1, 1], rel=1e-9)
    assert probe["strain_xy"][-1] == pytest.approx(wanted[0, 1], rel=1e-9)
    assert "strain_zz" not in probe
    low, high = np.linalg.eigvalsh(np.diag([wanted[0, 0], wanted[1, 1], 0.0]) + np.array([[0, wanted[0, 1], 0], [wanted[0, 1], 0, 0], [0, 0, 0]]))[[0, 2]]  # fmt: skip
    assert probe["principal_strain_1"][-1] == pytest.approx(high, rel=1e-9)
    assert probe["principal_strain_3"][-1] == pytest.approx(low, rel=1e-9)


def test_the_small_strain_form_has_no_strain_and_says_so() -> None:
    with pytest.raises(
        SceneError, match="small-strain form of body 'block' follows no deformation: there is no strain"
    ):
        wsph.compose(block("small-strain", {"at": [[0.5, 0.2]], "fields": ["strain_xx"]}))


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_reductions_are_those_of_what_stands_there(form: str) -> None:
    """Against the particles of the result, after a few steps: the velocity, where particles are."""
    reductions = ("min", "max", "mean", "sum", "integral")
    probes = [{"where": "x < 0.55", "reduce": reduce, "fields": ["velocity"], "every": 1} for reduce in reductions]
    result = wsph.run(block(form, *probes, steps=3))
    chosen = result.particles["position"][:, 0] < 0.55
    v = result.particles["velocity"][chosen, 0]
    found = [result.probes[f"p{k}"]["velocity_x"][-1] for k in range(5)]
    assert found[:4] == pytest.approx([v.min(), v.max(), v.mean(), v.sum()], rel=1e-12)
    units = result.summary["units"]["probes"]
    assert units["p0"]["velocity_x"] == "m/s"
    assert units["p4"]["velocity_x"] == "m/s m2"


def test_an_integral_is_over_the_volume() -> None:
    """Of v = a x + b y over the whole block at the start: area times the velocity of the middle."""
    probe = {"where": "x > -1", "reduce": "integral", "fields": ["velocity_x", "von_mises"]}
    result = wsph.run(block("stress-points", probe))
    start = result.probes["p0"]["velocity_x"][0]
    assert start == pytest.approx(LENGTH * HEIGHT * (STRETCH * 0.5 * LENGTH + SHEAR * 0.5 * HEIGHT), rel=1e-12)
    assert result.summary["units"]["probes"]["p0"]["von_mises"] == "J/m"


def test_what_is_not_linear_is_reduced_place_by_place() -> None:
    """The largest von Mises stress, and principal stresses, of places whose stress is uniform: by a closed form."""
    fields = ["von_mises", "principal_stress_1", "principal_stress_2", "principal_stress_3", "max_shear", "pressure"]
    reductions = ("max", "mean", "min")
    probes = [{"where": INSIDE, "reduce": reduce, "fields": fields} for reduce in reductions]
    result = wsph.run(block("stress-points", *probes))
    H = STEP * np.array([[STRETCH, SHEAR, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    F, G = np.eye(3) + H, 0.5 * (H + H.T + H.T @ H)
    lam, mu = E * 0.25 / (1.25 * 0.5), E / 2.5
    stress = F @ (lam * np.trace(G) * np.eye(3) + 2.0 * mu * G) @ F.T / np.linalg.det(F)
    principal = np.linalg.eigvalsh(stress)[::-1]
    s = stress - np.trace(stress) / 3.0 * np.eye(3)
    wanted = [np.sqrt(1.5 * np.sum(s * s)), *principal, 0.5 * (principal[0] - principal[2]), -np.trace(stress) / 3.0]
    for k in range(3):
        found = [result.probes[f"p{k}"][name][-1] for name in fields]
        assert found == pytest.approx(wanted, rel=1e-9)


def test_a_line_is_so_many_points_with_its_ends() -> None:
    line = {"line": {"from": [0.0, 0.2], "to": [1.0, 0.2], "points": 11}, "fields": ["velocity_x"]}
    result = wsph.run(block("stress-points", line))
    assert list(result.probes["p0"]) == ["time", *(f"velocity_x[{k}]" for k in range(11))]
    wanted = [STRETCH * 0.1 * k + SHEAR * 0.2 for k in range(11)]
    assert [result.probes["p0"][f"velocity_x[{k}]"][0] for k in range(11)] == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_a_record_is_the_same_after_a_resumption(tmp_path: Path) -> None:
    probe = {"where": INSIDE, "reduce": "max", "fields": ["von_mises", "velocity"], "every": 5}
    whole = wsph.run(block("stress-points", probe, steps=20)).probes["p0"]
    kept = block("stress-points", probe, steps=10).with_(**{"checkpoint.final": True})
    wsph.run(kept, tmp_path / "out")
    again = wsph.run(block("stress-points", probe, steps=20), tmp_path / "out", resume=True).probes["p0"]
    for name, values in whole.items():
        assert np.array_equal(values, again[name]), name


WRONG: list[tuple[dict[str, Any], str]] = [
    (
        {"where": "x < 0.5", "fields": ["stress_xx"]},
        'reduce = "min", "max", "mean", "sum" or "integral" goes with where',
    ),
    ({"at": [[0.5, 0.2]], "reduce": "min", "fields": ["stress_xx"]}, "goes with where"),
    ({"line": {"from": [0.0, 0.2], "to": [1.0]}, "fields": ["stress_xx"]}, "from has 2 coordinates and to 1"),
    ({"line": {"from": [0.0], "to": [1.0]}, "fields": ["stress_xx"]}, "has 1 coordinates in a scene of dim = 2"),
    ({"line": {"from": [0.0, 0.2], "to": [2.0, 0.2]}, "fields": ["stress_xx"]}, "does not lie in one body"),
    ({"at": [[0.5, 0.2]], "where": "x < 1", "fields": ["stress_xx"]}, "exactly one of at, line, where and of"),
    ({"where": "x < 0.5", "reduce": "max", "fields": ["density"]}, "density"),
]


@pytest.mark.parametrize(("probe", "message"), WRONG)
def test_what_cannot_be_probed_is_refused(probe: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        wsph.compose(block("stress-points", probe))
