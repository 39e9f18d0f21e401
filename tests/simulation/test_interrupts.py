"""Signals: a run ends after a whole step, or the program gets its KeyboardInterrupt."""

import json
import signal
from pathlib import Path

import numpy as np
import pytest

import wsph


def interrupt(step: int, steps: int, time: float) -> None:
    """Asks a run to end once it has begun: a timer would interrupt what is still compiled where nothing is cached."""
    if step >= 1000:
        signal.raise_signal(signal.SIGINT)


def test_an_interrupt_ends_after_a_whole_step_and_says_where(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    scene = shock_bar.with_(end="1e6 s", output={"history": 10_000}, probes=[])
    result = wsph.run(scene, tmp_path / "out", throw=False, progress=interrupt)
    assert result.status == "interrupted"
    steps = result.summary["steps"]
    assert result.history["step"][-1] == steps
    assert 1000 <= steps < 1e6 / 5e-5
    again = wsph.run(shock_bar.with_(end=steps * 5e-5, output={"history": 10_000}, probes=[]))
    assert again.summary["steps"] == steps
    assert np.array_equal(again.particles["velocity"], result.particles["velocity"])
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "interrupted"


def test_an_interrupt_takes_its_course_in_a_program(shock_bar: wsph.Scene) -> None:
    with pytest.raises(KeyboardInterrupt):
        wsph.run(shock_bar.with_(end="1e6 s", output={"history": 10_000}, probes=[]), progress=interrupt)
