"""Clamped beams against finite elements."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose
from wsph.testing import whole_spectrum
from wsph.validation.case import example
from wsph.validation.oracles import BEAM_FREQUENCY

REFERENCES = json.loads((Path(__file__).resolve().parents[1] / "references" / "beam_modes.json").read_text())


def beam(material: dict, size: tuple[float, ...], rows: int, *, integrator: object = "leapfrog", formulation: str = "stress-points",
         cfl: float = 0.85, periods: float = 1.1, omega: float = 1.0, guard: str = "refuse", **body: object) -> wsph.Scene:  # fmt: skip
    """A beam clamped at x = 0, started in its first mode with a small velocity."""
    dim, length, spacing = len(size), size[0], size[1] / rows
    kl = 1.8751040687
    k = kl / length
    m, n = float(np.sin(kl) + np.sinh(kl)), float(np.cos(kl) + np.cosh(kl))
    speed = 1e-5 * (material["youngs_modulus"] / material["density"]) ** 0.5
    mode = f"{speed!r}*({n!r}*(sin({k!r}*x)-sinh({k!r}*x))-{m!r}*(cos({k!r}*x)-cosh({k!r}*x)))*(x>0)"
    cells = round(length / spacing)
    data = {
        "name": "beam", "shape": scenes.box(length, *((-0.5 * edge, 0.5 * edge) for edge in size[1:])),
        "spacing": [length / cells, *[spacing] * (dim - 1)], "velocity": ["0", mode, "0"][:dim],
        "material": {"model": "elastic", **material}, **({"state": "stress"} if dim == 2 else {}), **body,
    }  # fmt: skip
    run = {
        "integrator": integrator,
        "formulation": formulation,
        "cfl": cfl,
        "end": periods * 2 * np.pi / omega,
        "guard": guard,
    }
    probe = {"name": "tip", "at": [[length, 0.0, 0.0][:dim]], "fields": ["displacement_y"], "every": 1}
    return scenes.scene(data, run=run, boundary=[scenes.held("-x", dim, "beam")], probes=[probe])


def ratio(case: str, rows: int, **keys: object) -> tuple[float, wsph.Result]:
    """Frequency over the finite-element one, from the first two returns of the tip through its rest, and the run."""
    reference = REFERENCES[case]
    material = {key: reference[key] for key in ("density", "youngs_modulus", "poisson_ratio")}
    result = wsph.run(beam(material, tuple(reference["size"]), rows, omega=reference["omega"], **keys))
    t, u = result.probes["tip"]["time"], result.probes["tip"]["displacement_y"]
    k = np.flatnonzero(np.diff(np.sign(u[1:])))[:2] + 1
    zero = t[k] - u[k] * (t[k + 1] - t[k]) / (u[k + 1] - u[k])
    return float(np.pi / (zero[1] - zero[0]) / reference["omega"]), result


def test_the_published_cases_have_the_same_references() -> None:
    for height, omega in BEAM_FREQUENCY.items():
        assert REFERENCES[f"magnesium, L = .5, W = {height:g}".replace("0.", ".")]["omega"] == pytest.approx(
            omega, rel=1e-5
        )


class TestBeam:
    """Clamped beams against biquadratic finite elements (tests/references/beam_modes.py)."""

    @pytest.mark.parametrize("case", ["magnesium, L = .5, W = .1", "slender, L = 10, W = 1"])
    def test_stress_points_within_a_thousandth_at_six_rows(self, case: str) -> None:
        found, result = ratio(case, 6)
        assert found == pytest.approx(1.0, abs=1.5e-3)
        energy = result.history
        assert (energy["hourglass"][1:] / energy["strain"].max()).max() < 0.05

    @pytest.mark.parametrize("scene", ["oscillating_beam", "plate_with_void"])
    def test_what_holds_spurious_modes_has_half_a_per_cent_of_the_shipped_scenes(self, scene: str) -> None:
        history = wsph.run(example(scene)).history
        assert 0.0 < history["hourglass"].max() < 0.006 * history["strain"].max()

    @pytest.mark.slow
    @pytest.mark.parametrize("case", ["magnesium, L = .5, W = .05", "magnesium, L = .5, W = .1"])
    def test_fifteen_rows(self, case: str) -> None:
        found, result = ratio(case, 15)
        assert found == pytest.approx(1.0, abs=3e-4)
        assert (result.history["hourglass"][1:] / result.history["strain"].max()).max() < 0.01

    @pytest.mark.slow
    @pytest.mark.parametrize("seed", [0, 1])
    def test_jitter(self, seed: int) -> None:
        reference = REFERENCES["slender, L = 10, W = 1"]
        material = {key: reference[key] for key in ("density", "youngs_modulus", "poisson_ratio")}
        scene = beam(material, (10.0, 1.0), 12, omega=reference["omega"], jitter=0.2).with_(seed=seed)
        t, u = (wsph.run(scene).probes["tip"][key] for key in ("time", "displacement_y"))
        k = np.flatnonzero(np.diff(np.sign(u[1:])))[:2] + 1
        zero = t[k] - u[k] * (t[k + 1] - t[k]) / (u[k + 1] - u[k])
        assert np.pi / (zero[1] - zero[0]) / reference["omega"] == pytest.approx(1.0, abs=5e-3)

    @pytest.mark.parametrize("case", ["magnesium, L = .5, W = .1", "slender, L = 10, W = 1"])
    def test_no_spurious_mode_among_the_first_eight(self, case: str) -> None:
        """All of them, past the third in bending, are modes of the finite elements; what nothing holds has others."""
        reference = REFERENCES[case]
        material = {key: reference[key] for key in ("density", "youngs_modulus", "poisson_ratio")}

        def ratios(**keys: Any) -> np.ndarray:
            system = compose(beam(material, tuple(reference["size"]), 6, cfl=0.1, **keys)).bodies[0].system
            stiffness, _ = whole_spectrum(system)
            squares = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[:8]
            return np.sqrt(np.maximum(squares, 0.0)) / system.scales.time / reference["modes"]

        np.testing.assert_allclose(ratios(), 1.0, atol=0.01)
        np.testing.assert_allclose(ratios(formulation="total-lagrangian"), 1.0, atol=0.1)
        assert ratios(formulation="total-lagrangian", residual=False)[2] < 0.7

    @pytest.mark.slow
    def test_three_dimensions(self) -> None:
        assert ratio("block, 10 x 1 x 1", 6, cfl=0.8)[0] == pytest.approx(1.0, abs=0.01)

    def test_particles_inside_of_the_cells_are_slow_and_pairs_along_their_edges_mend_it(self) -> None:
        case = "magnesium, L = .5, W = .1"
        kernel, _ = ratio(case, 8, formulation="total-lagrangian", placement="cells", residual=False, cfl=1.0)
        mended, _ = ratio(case, 8, formulation="total-lagrangian", cfl=1.0)
        assert kernel < 0.985
        assert mended == pytest.approx(1.0, abs=5e-3)


def test_lf4_has_a_tenth_of_leapfrogs_error_in_time_at_the_same_cost() -> None:
    """The one-set beam of h = 1.5 spacings over one period, at a Courant number of 1.2 an evaluation: displacements at the
    end against the same beam in small steps."""
    data = example("oscillating_beam").data()
    data["bodies"][0] |= {"spacing": 0.01, "residual": False}
    data["output"], data["probes"] = {"fields": ["displacement"]}, []
    period = 2.0 * np.pi / REFERENCES["magnesium, L = .5, W = .1"]["omega"]
    data["run"] = {"formulation": "total-lagrangian", "support": 3.0, "end": period, "cfl": 0.3, "integrator": "lf4"}
    scene = wsph.Scene(**data)
    unit = compose(scene).dt / 0.3

    def final(name: str, courant: float) -> np.ndarray:
        steps = int(np.ceil(period / (courant * unit)))
        return wsph.run(scene.with_(integrator=name, cfl=None, dt=period / steps)).particles["displacement"]

    exact = final("lf4", 0.3)
    leapfrog, lf4 = (np.linalg.norm(final(*each) - exact) for each in (("leapfrog", 1.2), ("lf4", 2.4)))
    assert leapfrog / lf4 > 10.0
    assert lf4 < 7e-4 * np.linalg.norm(exact)
