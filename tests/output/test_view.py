"""Pictures: made off-screen, with something in them."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.cli import main
from wsph.errors import OutputError
from wsph.output.view import frames, picture

pytest.importorskip("pyvista")
Image = pytest.importorskip("PIL.Image")


def colours(path: Path) -> int:
    """Number of different colours in a picture."""
    with Image.open(path) as page:
        return len(np.unique(np.asarray(page.convert("RGB")).reshape(-1, 3), axis=0))


def test_a_bar_is_a_curve_and_a_body_its_particles(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    out = tmp_path / "out"
    wsph.run(shock_bar.with_(output={"every": "2 ms"}), out)
    assert main(["view", str(out), "--field", "stress_xx", "--save", str(tmp_path / "bar.png")]) == 0
    assert colours(tmp_path / "bar.png") > 10
    grid = np.stack(np.meshgrid(np.arange(8.0), np.arange(5.0), indexing="ij"), -1).reshape(-1, 2)
    picture(
        {"position": grid, "stress": np.arange(40.0)[:, None] * np.ones(6)}, "stress_xy", 0.0, tmp_path / "plate.png"
    )
    assert colours(tmp_path / "plate.png") > 100
    assert main(["view", str(out), "--field", "velocity", "--save", str(tmp_path / "bar.gif")]) == 0
    with Image.open(tmp_path / "bar.gif") as animation:
        assert animation.n_frames == len(frames(out)) == 6


def test_what_cannot_be_drawn_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", str(tmp_path)]) == 2
    assert "no frames.pvd" in capsys.readouterr().err
    with pytest.raises(OutputError, match="no field 'heat' in the frame; there is velocity"):
        picture({"position": np.zeros((3, 3)), "velocity": np.zeros((3, 3))}, "heat", 0.0, tmp_path / "x.png")
