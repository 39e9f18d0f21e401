"""The examples of docs/states.md: what a run begins with."""

from pathlib import Path

import pytest

import wsph

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_cooks_membrane_rises_as_it_should() -> None:
    result = wsph.run(wsph.load(EXAMPLES / "cook.toml"), end="1 ms")
    rise = result.probes["corner"]["displacement_y"][0]
    # E b/F u = 23.96 of fine meshes (Simo & Rifai 1990).
    assert rise * 1e9 / 16e3 == pytest.approx(23.96, rel=0.005)
    assert result.summary["relaxation"]["status"] == "at rest"
