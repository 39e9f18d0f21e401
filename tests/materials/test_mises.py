"""Von Mises plasticity with linear hardening against closed forms and an integration of its own."""

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.simulation.compose import compose

E, NU, YIELD, HARDENING, STRAIN = 2e11, 0.3, 2e8, 1e9, 4e-3
SHEAR = E / 2.6
MATERIAL = scenes.material("mises", youngs_modulus=E, yield_stress=YIELD, hardening_modulus=HARDENING)
FORMS = ("stress-points", "total-lagrangian", "updated-lagrangian")


def strained(dim: int, state: str, velocity: list[str], run: dict) -> wsph.Result:
    """A block whose particles all move with a given velocity, to a strain of 4e-3."""
    end = 2e3 / float(np.sqrt(E))
    rate = STRAIN / end
    velocity = [f"{rate!r}*({v})" for v in velocity]
    moved = [{"body": "b", "where": "x > -1", "velocity": dict(zip("xyz", velocity, strict=False))}]
    tables = {"boundary": moved, "output": {"fields": ["stress", "plastic_strain"]}}
    keys = {"velocity": velocity, "material": MATERIAL, "state": state}
    return wsph.run(scenes.block(dim, 4, run={"end": end, "cfl": 0.5, **run}, tables=tables, **keys))


RUNS = [{"integrator": name, "formulation": form} for name in ("leapfrog", "rk4") for form in FORMS]
RUNS += [{"integrator": "tsph"}, {"integrator": "ul-tsph"}]


@pytest.mark.parametrize("run", RUNS, ids=lambda run: "-".join(run.values()))
def test_uniaxial_stress(run: dict) -> None:
    result = strained(1, "stress", ["x"], run)
    tangent = E * HARDENING / (E + HARDENING)
    exact = YIELD + tangent * (STRAIN - YIELD / E)
    assert result.particles["stress"][:, 0] == pytest.approx(exact, rel=1e-3)
    assert result.particles["plastic_strain"] == pytest.approx(STRAIN - exact / E, rel=4e-3)
    energy = result.summary["energy"]
    assert energy["dissipated"] == pytest.approx(0.5 * (YIELD + exact) * (STRAIN - exact / E), rel=0.01)
    assert abs(energy["residual"]) < 5e-3 * energy["external_work"]


@pytest.mark.parametrize("run", [r for r in RUNS if r["integrator"] != "tsph"], ids=lambda run: "-".join(run.values()))
def test_shear_in_plane_stress(run: dict) -> None:
    result = strained(2, "stress", ["y", "0"], run)
    yields = YIELD / 3**0.5
    slope = SHEAR * (HARDENING / 3.0) / (SHEAR + HARDENING / 3.0)
    assert result.particles["stress"][:, 3] == pytest.approx(yields + slope * (STRAIN - yields / SHEAR), rel=1e-3)


def plane_stress(strain: np.ndarray, steps: int = 4000) -> np.ndarray:
    """Stress after a straight strain path in plane stress, its out-of-plane strain by a secant, step by step."""
    bulk = E / (3.0 * (1.0 - 2.0 * NU))
    stress, plastic, part = np.zeros((3, 3)), 0.0, strain / steps

    def after(x: float) -> tuple[np.ndarray, float]:
        e = part + np.diag([0.0, 0.0, x])
        trial = stress + (bulk - 2 * SHEAR / 3) * np.trace(e) * np.eye(3) + 2 * SHEAR * e
        mean = np.trace(trial) / 3 * np.eye(3)
        size, limit = np.sqrt(1.5 * ((trial - mean) ** 2).sum()), YIELD + HARDENING * plastic
        if size <= limit:
            return trial, plastic
        more = (size - limit) / (3 * SHEAR + HARDENING)
        return mean + (trial - mean) * (limit + HARDENING * more) / size, plastic + more

    for _ in range(steps):
        x, y = 0.0, -NU / (1 - NU) * np.trace(part)
        gap = after(x)[0][2, 2]
        for _ in range(30):
            there = after(y)[0][2, 2]
            if there == gap:
                break
            x, y, gap = y, y - there * (y - x) / (there - gap), there
        stress, plastic = after(y)
    return stress


@pytest.mark.parametrize("form", FORMS)
def test_biaxial_in_plane_stress(form: str) -> None:
    result = strained(2, "stress", ["x", "0"], {"integrator": "leapfrog", "formulation": form})
    exact = plane_stress(np.diag([STRAIN, 0.0, 0.0]))
    assert result.particles["stress"][:, 0] == pytest.approx(exact[0, 0], rel=1e-3)
    assert result.particles["stress"][:, 1] == pytest.approx(exact[1, 1], rel=1e-3)
    assert np.abs(result.particles["stress"][:, 2]).max() < 1e-9 * YIELD


@pytest.mark.parametrize("integrator", ["tsph", "leapfrog"])
def test_a_plastic_wave_has_the_elastic_precursor_of_yield(integrator: str) -> None:
    """A bar hit faster than yield: behind the precursor stands the yield stress, behind the plastic front the rest."""
    speed = float(np.sqrt(E))
    v0 = 2.0 * YIELD / speed
    body = {"material": MATERIAL | {"hardening_modulus": E / 3.0}}
    if integrator == "leapfrog":
        body["viscosity"] = {"alpha": 0.5}
    run = {"integrator": integrator, "end": 0.7 / speed, "cfl": 0.9 if integrator == "tsph" else 0.3}
    if integrator == "leapfrog":
        run |= {"formulation": "total-lagrangian"}
    composition = compose(scenes.bar(500, run=run, tables={"boundary": [scenes.driven("-x", x=v0)]}, **body))
    composition.compile()
    composition.program.run(composition.steps)
    system = composition.bodies[0].system
    x, stress = system.position[:, 0], -system.state.read("stress")[:, 0] * composition.scales.stress
    # The tangent modulus E/4 halves the wave speed: the jump beyond yield is half of what it would be elastically.
    assert stress[(x > 0.45) & (x < 0.6)].mean() == pytest.approx(YIELD, rel=0.01)
    assert stress[(x > 0.1) & (x < 0.25)].mean() == pytest.approx(1.5 * YIELD, rel=0.01)


def test_softening_faster_than_elasticity_is_refused() -> None:
    fault = r"bodies.0.material: mises refuses its fields: hardening_modulus must be above -3 G"
    with pytest.raises(wsph.SceneError, match=fault):
        scenes.bar(10, material=MATERIAL | {"hardening_modulus": -3.1 * SHEAR})
