"""Signals: a run ends after a whole step, or the program gets its KeyboardInterrupt."""

import json
import os
import signal
import threading
from pathlib import Path

import numpy as np
import pytest

import wsph


def test_an_interrupt_ends_after_a_whole_step_and_says_where(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    scene = shock_bar.with_(end="1e6 s", output={"history": 10_000}, probes=[])
    result = wsph.run(scene, tmp_path / "out", throw=False)
    assert result.status == "interrupted"
    steps = result.summary["steps"]
    assert result.history["step"][-1] == steps
    again = wsph.run(shock_bar.with_(end=steps * 5e-5, output={"history": 10_000}, probes=[]))
    assert again.summary["steps"] == steps
    assert np.array_equal(again.particles["velocity"], result.particles["velocity"])
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "interrupted"


def test_an_interrupt_takes_its_course_in_a_program(shock_bar: wsph.Scene) -> None:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        wsph.run(shock_bar.with_(end="1e6 s", output={"history": 10_000}, probes=[]))
