"""The shipped scene of a beam that breaks; the others of fracture and impact are published cases (`wsph.validation`)."""

import numpy as np
import pytest

import wsph
from wsph.validation.case import example


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*follow the lattice")
def test_the_notched_beam_breaks_at_its_notch() -> None:
    result = wsph.run(example("notched_beam"))
    assert result.summary["fracture"]["beam"]["broken_links"] >= 4
    X, damage = result.particles["position"], result.field("damage")
    assert np.abs(X[np.nan_to_num(damage) > 0.0][:, 0]).max() < 5e-3
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 0.025 * energy["external_work"]
