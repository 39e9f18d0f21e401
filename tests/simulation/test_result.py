"""Results: errors against exact fields, and a summary that any reader of JSON takes."""

import json
from pathlib import Path

import numpy as np
import pytest

import wsph


def test_the_summary_says_what_was_run(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    wsph.run(shock_bar, tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "completed"
    assert summary["plugins"] == {
        "integrator tsph": "wsph " + wsph.__version__,
        "material elastic": "wsph " + wsph.__version__,
    }
    assert wsph.Scene(**summary["scene"]) == shock_bar
    assert summary["particles"] == 101
    assert summary["pairs"] == 400
    assert summary["right_hand_sides"] == 400
    assert summary["particle_steps_per_second"] > 0


def test_errors_against_an_exact_field(shock_bar: wsph.Scene) -> None:
    result = wsph.run(shock_bar.with_(end="4 ms"))
    exact = lambda x, t: np.where((x[:, 0] > 0.3) & (x[:, 0] <= 0.8), 1.0, 0.0)  # noqa: E731
    assert result.error(exact, "velocity_x", 1) < 0.05
    assert result.error(exact, "velocity", 2) == result.error(exact(result.particles["position"], 0.0), "velocity_x", 2)
    for norm, values, message in (
        (3, exact, "norm 3"),
        (2, np.ones(3), "3 values for 101"),
        (2, np.zeros(101), "zero everywhere"),
    ):
        with pytest.raises(ValueError, match=message):
            result.error(values, "velocity_x", norm)
    with pytest.raises(KeyError, match="name a component of stress"):
        result.error(np.ones(101), "stress") if result.particles["stress"].shape[1] > 1 else None


def test_what_is_not_finite_is_null_in_the_summary(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    wild = shock_bar.with_(cfl=3.0, guard="off", stop={"energy": 1e300}, end=0.2, output={"history": 1})
    with pytest.warns(RuntimeWarning, match="energy was created"):
        wsph.run(wild, tmp_path / "out", throw=False)
    text = (tmp_path / "out" / "summary.json").read_text()
    summary = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert summary["status"] in ("unstable", "stopped")
