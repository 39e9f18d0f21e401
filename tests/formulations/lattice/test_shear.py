"""Bodies by their lattice in simple shear throughout, against closed forms of laws that integrate their stress.

A hypoelastic solid of Jaumann's rate has s_xy = G sin g, s_xx = -s_yy = G (1 - cos g) at the shear g (Dienes 1979), in
plane strain, plane stress and space alike, as nothing strains across. A perfectly plastic one of von Mises yields at
g = 2 arcsin(t/2G), t the yield stress in shear; from there on s_xy = t cos f, s_xx = t sin f with df/dg = 1 - G/t sin f.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests import scenes
from wsph.formulations.lattice import rates
from wsph.formulations.lattice.edges import rows as edge_rows
from wsph.simulation.compose import compose

BODIES: dict[str, tuple[dict[str, Any], Any, dict[str, Any]]] = {
    "strain": (scenes.box(1.0, 1.3) | {"rotate": 25.0}, [0.1, 0.13], {"state": "strain"}),
    "stress": (scenes.box(1.0, 1.3) | {"rotate": 25.0}, [0.1, 0.13], {"state": "stress"}),
    "space": (scenes.box(0.5, 0.65, 0.8) | {"rotate": [[1.0, 2.0, 3.0], 35.0]}, [0.1, 0.13, 0.16], {}),
}
"""Turned boxes of unequal cells, by their states."""

SHEAR, YIELD, RATE = 1.0e6, 0.15e6, 100.0
"""G and the yield stress in shear [Pa]; the rate of the shear [1/s]."""


def closed(end: float, plastic: bool) -> tuple[float, float]:
    """s_xx and s_xy [Pa] at the shear `end`."""
    if not plastic:
        return SHEAR * (1.0 - np.cos(end)), SHEAR * np.sin(end)
    begins = 2.0 * np.arcsin(0.5 * YIELD / SHEAR)
    turning = solve_ivp(lambda _, f: 1.0 - SHEAR / YIELD * np.sin(f), (begins, end), [0.5 * begins], rtol=1e-10)
    return YIELD * np.sin(turning.y[0, -1]), YIELD * np.cos(turning.y[0, -1])


def sheared(
    name: str, model: str, form: str, precision: str, steps: int, threads: int = 1
) -> tuple[dict[str, np.ndarray], float]:
    """The components of the stress at all points [Pa] after so many steps, and the shear there."""
    shape, spacing, keys = BODIES[name]
    law = {"model": model, "density": 1000.0, "youngs_modulus": 2.6 * SHEAR, "poisson_ratio": 0.3}
    law |= {"yield_stress": np.sqrt(3.0) * YIELD} if model == "mises" else {}
    run = {"formulation": form, "precision": precision, "end": 0.01, "cfl": 4.0 / steps, "guard": "off"}
    run |= {"threads": threads}
    still = dict.fromkeys("yz"[: len(shape["min"]) - 1], 0.0)
    moved = {"body": "b", "where": "x > -1e3", "velocity": {"x": f"{RATE}*y"} | still}
    body = scenes.body(shape, spacing, material=law, velocity=[f"{RATE}*y", *["0"] * len(still)], **keys)
    made = compose(scenes.scene(body, run=run, boundary=[moved]))
    system = made.bodies[0].system
    assert system.regular == 1.0
    made.compile()
    made.program.run(steps)
    stress = system.state.read("stress") * system.scales.of("Pa")
    found = dict(zip(system.constitutive.state.labels, stress.T, strict=True))
    return found, RATE * steps * system.clock.dt * system.scales.time


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
@pytest.mark.parametrize("name", BODIES)
def test_so_it_is_where_each_thread_has_a_part(
    name: str, form: str, share: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    share()
    for each in (rates, edge_rows):
        monkeypatch.setattr(each, "PIECE_BYTES", 2**10)
    found, end = sheared(name, "jaumann", form, "f64", 40, threads=3)
    xx, xy = closed(end, plastic=False)
    for label, right in (("xx", xx), ("yy", -xx), ("xy", xy)):
        assert np.abs(found[label] - right).max() < 2e-4 * np.hypot(xx, xy), label


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
@pytest.mark.parametrize("model", ["jaumann", "mises"])
@pytest.mark.parametrize("name", BODIES)
def test_simple_shear_is_that_of_the_closed_form(name: str, model: str, form: str, precision: str) -> None:
    found, end = sheared(name, model, form, precision, 40)
    if model == "mises":
        # A return to the yield surface is of first order in the step: what twice as many steps leave is taken off.
        finer, same = sheared(name, model, form, precision, 80)
        assert same == pytest.approx(end)
        found = {key: 2.0 * finer[key] - each for key, each in found.items()}
    xx, xy = closed(end, model == "mises")
    for label, right in (("xx", xx), ("yy", -xx), ("xy", xy)):
        assert np.abs(found[label] - right).max() < 2e-4 * np.hypot(xx, xy), label
