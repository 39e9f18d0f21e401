"""Bodies of particles alone, from a file of positions and volumes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Refused, SceneError
from wsph.simulation.compose import compose

FORMS = ("total-lagrangian", "updated-lagrangian")


def written(folder: Path, position: np.ndarray, volume: np.ndarray, names: str | None = None) -> str:
    """The path of a file of particles."""
    dim = position.shape[1]
    rows = [",".join(repr(float(x)) for x in (*place, v)) for place, v in zip(position, volume, strict=True)]
    path = folder / "particles.csv"
    path.write_text("\n".join([names or ",".join([*"xyz"[:dim], "volume"]), *rows]) + "\n")
    return str(path)


def of_file(path: str, formulation: str = "total-lagrangian", dim: int = 2, **keys: Any) -> wsph.Scene:
    state = {"state": "strain"} if dim < 3 else {}
    body = {"name": "b", "shape": {"type": "points", "file": path}, "material": scenes.material(), **state, **keys}
    run = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.3, "formulation": formulation}
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=[body])


@pytest.mark.parametrize("formulation", FORMS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_the_cells_of_a_lattice_from_a_file_move_as_the_lattice_does(
    tmp_path: Path, dim: int, formulation: str
) -> None:
    """By a kernel's pairs, which both have."""
    cells = 8 if dim < 3 else 5
    block = scenes.block(dim, cells, run={"formulation": formulation}, placement="cells",
                         velocity=["0.01*sin(3*x)", "0.02*x", "0.01*z"][:dim])  # fmt: skip
    lattice = compose(block).bodies[0].system.lattice
    path = written(tmp_path, lattice.cells, lattice.cell_volume)
    scene = of_file(path, formulation, dim, velocity=["0.01*sin(3*x)", "0.02*x", "0.01*z"][:dim])
    one, other = (wsph.run(each).particles for each in (block, scene))
    for name in ("velocity", "stress"):
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=1e-12 * np.abs(one[name]).max())


@pytest.mark.parametrize("formulation", FORMS)
def test_held_and_driven_particles_are_selected_by_where(tmp_path: Path, formulation: str) -> None:
    random = np.random.default_rng(2)
    grid = np.stack(np.meshgrid(np.arange(12), np.arange(8), indexing="ij"), -1).reshape(-1, 2) + 0.5
    place = 0.1 * (grid + random.uniform(-0.1, 0.1, grid.shape))
    path = written(tmp_path, place, np.full(len(place), 0.01))
    base = of_file(path, formulation).data()
    base["boundary"] = [
        {"body": "b", "where": "x < 0.15", "fixed": ["x", "y"]},
        {"body": "b", "where": "x > 1.05", "velocity": {"x": 0.01}},
    ]
    with pytest.warns(RuntimeWarning):
        result = wsph.run(wsph.Scene(**base))
    moved = result.particles["position"][:, 0] > 1.05
    assert result.particles["velocity"][moved, 0] == pytest.approx(0.01)
    assert result.summary["energy"]["external_work"] > 0.0


def test_what_is_no_body_of_particles_is_refused_by_name(tmp_path: Path) -> None:
    place, volume = np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]]), np.full(4, 0.01)
    path = written(tmp_path, place, volume)
    for changed, text in (
        ({"formulation": "stress-points"}, "particles without cells are for"),
        ({"integrator": "tsph"}, "particles without cells are for"),
    ):
        with pytest.raises(Refused, match=text):
            compose(of_file(path).with_(**changed) if "integrator" not in changed else _taylor(path))
    for made, text in (
        (lambda: written(tmp_path, place, np.array([0.01, 0.0, 0.01, 0.01])), "not above zero"),
        (lambda: written(tmp_path, place[[0, 0, 1, 2]], volume), "in one place"),
        (lambda: written(tmp_path, place, volume, "x,y,mass"), "has the columns x, y, mass"),
        (lambda: str(tmp_path / "none.csv"), "No such file"),
    ):
        with pytest.raises(SceneError, match=text):
            compose(of_file(made()))
    with pytest.raises(SceneError, match="spacing is of bodies with a shape"):
        of_file(path, spacing=0.1)
    path = written(tmp_path, place, volume)
    with pytest.raises(SceneError, match="boundary.0.face"):
        compose(wsph.Scene(**{**of_file(path).data(), "boundary": [{"body": "b", "face": "+x", "fixed": ["x"]}]}))


def _taylor(path: str) -> wsph.Scene:
    data = of_file(path).data()
    data["run"] = {"integrator": "tsph", "end": 1.0, "cfl": 0.3}
    return wsph.Scene(**data)
