"""Clamped beams against finite elements, and the guard's limits beside where runs begin to grow."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.composition import compose
from wsph.validation.cases import example
from wsph.validation.oracles import BEAM_FREQUENCY

FORMS = ("stress-points", "total-lagrangian")
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
    low = [0.0, *(-0.5 * edge for edge in size[1:])]
    data = {
        "name": "beam", "shape": {"type": "box", "min": low, "max": [length, *(0.5 * edge for edge in size[1:])]},
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
    hold = {"body": "beam", "face": "-x", "fixed": ["x", "y", "z"][:dim]}
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=[data], boundary=[hold], probes=[probe])


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

    @pytest.mark.slow
    def test_three_dimensions(self) -> None:
        assert ratio("block, 10 x 1 x 1", 6, cfl=0.8)[0] == pytest.approx(1.0, abs=0.01)

    def test_the_usual_form_is_slow_and_nodes_on_the_boundary_mend_it(self) -> None:
        case = "magnesium, L = .5, W = .1"
        usual, _ = ratio(case, 8, formulation="total-lagrangian", residual=False, cfl=1.0)
        mended, _ = ratio(
            case, 8, formulation="total-lagrangian", placement="nodes", residual={"coefficient": 0.3}, cfl=1.0
        )
        assert usual < 0.985
        assert mended == pytest.approx(1.0, abs=5e-3)


class TestGuard:
    """The limit from Lanczos' frequency beside where runs begin to grow."""

    @pytest.mark.parametrize("formulation", FORMS)
    @pytest.mark.parametrize("name", ["leapfrog", "rk4", "kg4-8", "lf4"])
    def test_predicted_over_measured(self, name: str, formulation: str) -> None:
        reference = REFERENCES["magnesium, L = .5, W = .1"]
        material = {key: reference[key] for key in ("density", "youngs_modulus", "poisson_ratio")}
        scene = beam(material, (0.5, 0.1), 6, integrator=name, formulation=formulation, omega=reference["omega"],
                     periods=0.5, cfl=0.1, guard="off")  # fmt: skip
        predicted = compose(scene).bodies[0].limit
        assert predicted is not None

        def grows(cfl: float) -> bool:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                result = wsph.run(scene.with_(cfl=cfl, stop={"energy": 1e6}), throw=False)
            return result.status != "completed" or result.history["kinetic"].max() > 2.0 * result.history["kinetic"][0]

        assert not grows(predicted)
        assert grows(1.05 * predicted)

    @pytest.mark.parametrize(("alpha", "name", "measured"), [
        (2.5, "euler", 0.87), (2.5, "rk4", 1.26), (2.5, "rkc 3", 2.40), (2.5, "rkc 10", 3.80), (2.5, "leapfrog", 0.90),
        (1.0, "pc2", 1.95), (1.0, "rk4", 3.10), (1.0, "rkc 5", 3.02), (1.0, "leapfrog", 2.11),
    ])  # fmt: skip
    def test_never_above_the_measured_limit_of_the_switched_viscous_bar(
        self, alpha: float, name: str, measured: float
    ) -> None:
        method, _, stages = name.partition(" ")
        options = {"stages": int(stages)} if stages else {"lagged": True} if method == "leapfrog" else {}
        bar = example("magnesium_bar").with_(guard="off", probes=[], integrator={"name": method, **options})
        limit = compose(bar.with_(**{"bodies.0.viscosity": {"alpha": alpha, "beta": alpha}})).bodies[0].limit
        assert limit is not None
        assert 0.6 * measured < limit < measured

    def test_beyond_it_is_refused_by_name(self) -> None:
        reference = REFERENCES["magnesium, L = .5, W = .1"]
        material = {key: reference[key] for key in ("density", "youngs_modulus", "poisson_ratio")}
        with pytest.raises(
            wsph.Refused, match=r"leapfrog at Courant number 1.2 is beyond its stability limit 1\.03.*omega dt <= 2"
        ):
            compose(beam(material, (0.5, 0.1), 6, cfl=1.2))
        with pytest.raises(
            wsph.Refused,
            match=r"limit 0.000 \(RKC amplifies every undamped wave: give the body viscosity, or use leapfrog",
        ):
            compose(beam(material, (0.5, 0.1), 6, cfl=0.1, integrator="rkc"))
        with pytest.raises(
            wsph.Refused, match="rk2 .*limit 0.000 .*amplifies every undamped wave: use leapfrog or rk4"
        ):
            compose(beam(material, (0.5, 0.1), 6, cfl=0.1, integrator="rk2"))


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
