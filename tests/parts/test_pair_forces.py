"""What acts between pairs beside the stress: its work on the ledger, and where it is refused."""

import numpy as np
import pytest

import wsph
from tests.scenes import spinning
from wsph.simulation.compose import compose


@pytest.mark.parametrize("part", [{"hourglass": {"coefficient": 0.1}}, {"artificial_stress": {}}], ids=str)
def test_their_work_is_on_the_ledger(part: dict) -> None:
    result = wsph.run(spinning(**part))
    energy, history = result.summary["energy"], result.history
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    assert np.abs(history["hourglass"]).max() > 0.0
    assert np.abs(history["momentum_x"]).max() < 1e-15


def test_they_are_refused_where_there_are_points() -> None:
    for part, value in (("hourglass", {"coefficient": 0.1}), ("artificial_stress", {})):
        with pytest.raises(wsph.Refused, match=f"{part} is a part of the one-set form total-lagrangian"):
            compose(spinning(**{part: value}).with_(**{"run.formulation": "stress-points"}))
