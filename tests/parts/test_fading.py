"""The residual of what flows: plastic fronts and their strain by the closed form, and the energy that it sets free."""

import dataclasses

import numpy as np
import pytest
from wsph_materials.mises import Mises

import wsph
from tests import scenes
from tests.scenes import FORMS, driven, material
from wsph.formulations.lattice.edges.rates import EdgeRates
from wsph.parts.fading import LEAST, Fading
from wsph.simulation.compose import compose

YIELD, HARDENING = 1e-3, 1e-2
"""Of E; the tangent modulus is E H/(E + H)."""
DRIVEN = 4e-3
"""Of the wave speed: four times that at which a bar yields."""


def struck(formulation: str, cells: int, end: float, **keys: object) -> wsph.Scene:
    """A bar whose end is driven on at a constant velocity."""
    steel = material("mises", poisson_ratio=0.3, yield_stress=YIELD, hardening_modulus=HARDENING)
    run = {"formulation": formulation, "end": end, "cfl": 0.5}
    tables = {"boundary": [driven("-x", x=DRIVEN)], "output": {"fields": ["velocity", "plastic_strain"]}}
    return scenes.bar(cells, run=run, tables=tables, material=steel, **keys)


@pytest.mark.parametrize("formulation", FORMS)
def test_a_plastic_front_runs_at_its_speed(formulation: str) -> None:
    """sqrt(E_t/rho) behind a precursor of the yield stress; the residual is no stiffness beside E_t."""
    result = wsph.run(struck(formulation, 200, 0.9))
    x, v = result.particles["position"][:, 0], result.particles["velocity"][:, 0]
    order = np.argsort(x)
    x, v = x[order], v[order]
    tangent = HARDENING / (1.0 + HARDENING)

    def front(level: float) -> float:
        last = np.flatnonzero(v > level)[-1]
        return float(np.interp(-level, -v[last : last + 2], x[last : last + 2]))

    assert front(0.5 * YIELD) == pytest.approx(result.time, rel=0.015)
    speed = np.sqrt(tangent)
    assert front(0.5 * (DRIVEN + YIELD)) == pytest.approx(speed * result.time, rel=0.04)
    behind = result.particles["plastic_strain"][order].ravel()[x < 0.5 * speed * result.time]
    assert np.median(behind) == pytest.approx((DRIVEN - YIELD) / speed * (1.0 - tangent), rel=0.05)


@pytest.mark.filterwarnings("ignore:.*control of spurious modes")
@pytest.mark.parametrize("formulation", FORMS)
def test_what_a_fading_residual_sets_free_is_dissipated(formulation: str) -> None:
    """With a large residual: without the entry three hundredths of the work would be missing. Of a bar's stress points that
    see two nodes nothing is left beside a linear field: these see four."""
    wide = {"run.support": 1.8} if formulation == "stress-points" else {}
    scene = struck(formulation, 50, 0.5, residual={"coefficient": 1.0}).with_(**wide)
    composition = compose(scene)
    run = composition.bodies[0]
    for _ in range(composition.steps):
        composition.program.step()
    fading, system = run.system.attached["fading"], run.system
    booked = fading.ledger[0].value()
    flowed = system.state.read("internals")[:, 0] / YIELD
    if isinstance(system.rates, EdgeRates):
        left = system.rates.grid.left.numpy()[: system.count]
    else:
        assert isinstance(fading, Fading)
        left = fading.share.numpy() / system.rates.seen.points.share.numpy()
    np.testing.assert_allclose(left, np.maximum(LEAST, 1.0 / (1.0 + flowed)), rtol=1e-12)
    assert left.min() < 0.2
    result = wsph.run(scene).summary["energy"]
    scales = composition.scales
    share = booked * scales.stress * scales.length / result["external_work"]
    assert share > (0.01 if formulation == "total-lagrangian" else 5e-4)
    assert abs(result["residual"]) < 0.01 * result["external_work"]


def test_a_material_that_names_what_it_has_not_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Mises, "flows", ("flown", "yield_stress"))
    with pytest.raises(wsph.SceneError, match=r"'mises'.*flows = \('flown', 'yield_stress'\)"):
        compose(struck("stress-points", 20, 0.1))
    monkeypatch.setattr(Mises, "flows", None)
    assert "fading" not in compose(struck("stress-points", 20, 0.1)).bodies[0].system.attached
    assert dataclasses.is_dataclass(Mises)
