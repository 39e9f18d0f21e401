"""The ledger: it closes, what is lost is named, and it is that of the last step."""

import numpy as np
import pytest

import wsph


def test_the_ledger_closes_at_courant_one_and_loses_below(shock_bar: wsph.Scene) -> None:
    energy = wsph.run(shock_bar).summary["energy"]
    assert energy["external_work"] == pytest.approx(
        1005.0, rel=1e-10
    )  # rho c v^2 for 2.5 ms, and the driven node's start
    assert energy["kinetic"] + energy["strain"] == pytest.approx(1005.0, rel=1e-10)
    assert abs(energy["residual"]) < 1e-6
    lossy = wsph.run(shock_bar.with_(cfl=0.5)).summary["energy"]
    assert 0.02 < lossy["residual"] / lossy["external_work"] < 0.05  # numerical dissipation, reported: 3.2 %


def test_dissipation_is_on_the_ledger(viscoplastic_bar: wsph.Scene) -> None:
    result = wsph.run(viscoplastic_bar.with_(**{"bodies.0.spacing": 0.0025}))
    energy = result.summary["energy"]
    assert energy["dissipated"] > 10.0
    assert abs(energy["residual"]) < 0.01 * energy["external_work"]
    assert (np.diff(result.history["dissipated"]) >= 0.0).all()


def test_the_energies_of_a_stopped_run_are_those_of_its_last_step(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(cfl=1.2, guard="off", end="50 ms", output={"history": 50}), throw=False)
    assert result.history["step"][-1] == result.summary["steps"]
    energy = result.summary["energy"]
    assert energy["residual"] < -0.1 * (energy["kinetic"] + energy["strain"])
