"""What acts between pairs beside the stress: its work on the ledger, and where it is refused."""

import numpy as np
import pytest

import wsph
from wsph.simulation.compose import compose


def block(**body: object) -> wsph.Scene:
    """A free block that spins and stretches."""
    data = {"name": "b", "shape": {"type": "box", "min": [-0.5, -0.5], "max": [0.5, 0.5]}, "spacing": 0.1, "state": "strain",
            "velocity": ["-0.1*y + 0.05*x", "0.1*x"], "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}, **body}  # fmt: skip
    run = {"integrator": "leapfrog", "formulation": "total-lagrangian", "end": 4.0, "cfl": 0.5}
    return wsph.Scene(schema=1, dim=2, run=run, bodies=[data])


@pytest.mark.parametrize("part", [{"hourglass": {"coefficient": 0.1}}, {"artificial_stress": {}}], ids=str)
def test_their_work_is_on_the_ledger(part: dict) -> None:
    result = wsph.run(block(**part))
    energy, history = result.summary["energy"], result.history
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    assert np.abs(history["hourglass"]).max() > 0.0
    assert np.abs(history["momentum_x"]).max() < 1e-15


def test_they_are_refused_where_there_are_points() -> None:
    for part, value in (("hourglass", {"coefficient": 0.1}), ("artificial_stress", {})):
        with pytest.raises(wsph.Refused, match=f"{part} is a part of the one-set form total-lagrangian"):
            compose(block(**{part: value}).with_(**{"run.formulation": "stress-points"}))
