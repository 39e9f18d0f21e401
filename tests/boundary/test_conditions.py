"""Conditions: all that are given act, what contradicts itself is a fault."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.simulation.compose import compose


def test_equal_loads_on_two_faces_are_both_applied(shock_bar: wsph.Scene) -> None:
    faces = [{"body": "bar", "face": face, "stress": {"xx": "1 MPa"}} for face in ("-x", "+x")]
    stress = wsph.run(shock_bar.with_(end="1 ms", boundary=faces, probes=[])).particles["stress"][:, 0]
    assert stress[[0, -1]].tolist() == pytest.approx([1e6, 1e6])
    assert np.abs(stress - stress[::-1]).max() < 1e-6 * 1e6


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ({"face": "-x", "velocity": {"x": 1.0}, "stress": {"xx": 1.0}}, "the face prescribes the velocity x too"),
        ({"where": "x > 0.3 and x < 0.4", "stress": {"xx": 1.0}}, "acts on no face selected here"),
    ],
)
def test_contradicting_conditions_are_faults(shock_bar: wsph.Scene, condition: dict, message: str) -> None:
    with pytest.raises(wsph.SceneError, match=message):
        compose(shock_bar.with_(boundary=[{"body": "bar", **condition}]))


def test_a_start_that_is_not_finite_is_refused(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    for change in (
        {"bodies.0.velocity": ["0/(x - 0.5)"]},
        {"boundary": [{"body": "bar", "face": "-x", "velocity": {"x": "1/t"}}]},
    ):
        with pytest.raises(wsph.Refused, match="not finite"):
            wsph.run(shock_bar.with_(**change), tmp_path / "out")
    assert not (tmp_path / "out").exists()
