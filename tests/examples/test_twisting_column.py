"""The twisting column: large rotation and strain in 3D."""

import numpy as np
import pytest

import wsph
from wsph.validation.case import example


def twist(result: wsph.Result) -> tuple[float, float]:
    """The largest turn of a corner of the top [degrees] and how far it springs back past the start."""
    probe = result.probes["corner"]
    angle = np.unwrap(np.arctan2(0.5 + probe["displacement_y"], 0.5 + probe["displacement_x"]))
    turn = np.degrees(angle - angle[0])
    return float(turn.max()), float(turn.min())


def test_it_twists_and_springs_back_and_keeps_its_energy() -> None:
    result = wsph.run(example("twisting_column"))
    energy, history = result.summary["energy"], result.history
    assert abs(energy["residual"]) < 1e-4 * energy["external_work"]
    # What the residual holds, of what the body does.
    assert history["hourglass"].max() < 0.01 * history["strain"].max()
    assert (history["hourglass"] < 0.01 * (history["strain"] + 0.01 * history["strain"].max())).all()
    # 340.4 and -108.8 degrees at 0.2 m, 339.3 and -111.6 at 0.125 m, 339.2 and -113.9 at 0.1 m.
    assert twist(result) == pytest.approx((338.4, -116.5), abs=1.0)


@pytest.mark.filterwarnings("ignore:.*at a Poisson's ratio")
@pytest.mark.parametrize("formulation", ["total-lagrangian", "updated-lagrangian"])
def test_the_other_forms_run_it_too(formulation: str) -> None:
    changes = {"bodies.0.spacing": 0.25, "run.formulation": formulation}
    if formulation == "updated-lagrangian":
        changes |= {"end": 0.02, "run.cfl": 0.3}
    result = wsph.run(example("twisting_column").with_(**changes))
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    assert twist(result)[0] > (300.0 if formulation == "total-lagrangian" else 30.0)
