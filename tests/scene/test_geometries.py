"""Which geometry a body gets: a lattice, fitted cells or those of a mesh; and what is refused by name."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.cli import main
from wsph.errors import Refused, SceneError
from wsph.geometry.lattice import Lattice
from wsph.geometry.meshes.meshed import Meshed
from wsph.simulation.compose import compose
from wsph.validation.meshes import around, moved_grid, write

DISC = {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}


def geometry(run: dict[str, Any] | None = None, boundary: tuple[Any, ...] = (), **keys: Any) -> object:
    """That of a disc."""
    body = scenes.body(DISC, 0.1, **keys)
    return compose(scenes.scene(body, run=run or {}, boundary=list(boundary))).bodies[0].system.geometry


def meshed_scene(folder: Path, others: tuple[Any, ...] = (), **tables: Any) -> Any:
    """A scene with a square of quadrilaterals from a file."""
    nodes, corners = moved_grid((1.0, 1.0), (4, 4), 0.0)
    write(folder / "square.vtu", nodes, quad=around(corners))
    data = scenes.scene(scenes.body(DISC, 0.1, "b"), *others, **tables).data()
    body = data["bodies"][0]
    del body["shape"], body["spacing"]
    body["mesh"] = {"file": str(folder / "square.vtu")}
    return wsph.Scene(**data)


def test_a_round_body_is_fitted_by_default_and_one_on_the_grid_a_lattice() -> None:
    assert isinstance(geometry(), Meshed)
    assert isinstance(geometry(surface="fitted"), Meshed)
    assert isinstance(geometry(surface="stairs"), Lattice)
    box = scenes.body(scenes.box(1.0, 1.0), 0.1, surface="fitted")
    assert isinstance(compose(scenes.scene(box)).bodies[0].system.geometry, Lattice)


WHYS = [
    ({"run": {"support": 1.5}}, "run.support asks for the pairs of a kernel"),
    ({"run": {"kernel": "wendland-c2"}}, "run.kernel asks for the pairs of a kernel"),
    ({"jitter": 0.1}, "the body has jitter"),
    ({"lattice_rotate": 10.0}, "the body has lattice_rotate"),
    ({"map": ["x + 0.1*y", "y"]}, "the body has map"),
    ({"run": {"formulation": "total-lagrangian"}}, "the total-lagrangian form has no points in cells of every kind"),
]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("keys", "why"), WHYS, ids=[why for _, why in WHYS])
def test_what_keeps_a_body_in_stairs_does_so_by_default_and_refuses_a_fitted_surface(keys: Any, why: str) -> None:
    assert isinstance(geometry(**keys), Lattice)
    with pytest.raises(Refused, match=f"its surface cannot be fitted: {why}.*; leave that out, or write surface"):
        geometry(surface="fitted", **keys)


@pytest.mark.parametrize("surface", ["stairs", "fitted"])
def test_a_patch_that_is_not_there_is_refused_with_those_that_are(surface: str) -> None:
    with pytest.raises(SceneError, match="has no patch 'rim': it has disc"):
        geometry(surface=surface, boundary=({"body": "b", "patch": "rim", "pressure": 1.0},))


@pytest.mark.parametrize(
    ("run", "text"),
    [
        ({"support": 1.5}, "leave out run.support"),
        ({"kernel": "wendland-c2"}, "leave out run.kernel"),
        ({"formulation": "total-lagrangian"}, "for run.formulation = \"stress-points\", not for 'total-lagrangian'"),
        ({"integrator": "tsph"}, "for run.formulation = \"stress-points\", not for 'small-strain'"),
    ],
    ids=str,
)
def test_what_a_mesh_cannot_have_is_refused(tmp_path: Path, run: dict[str, Any], text: str) -> None:
    with pytest.raises(Refused, match=text):
        compose(meshed_scene(tmp_path, run=run))


def test_contact_of_balls_with_a_mesh_is_refused(tmp_path: Path) -> None:
    beside = scenes.body(scenes.box((3.0, 4.0), 1.0), 0.25, "a")
    with pytest.raises(Refused, match="'b': contact between balls needs particles of equal size"):
        compose(meshed_scene(tmp_path, (beside,), contact=[{"between": ["a", "b"], "law": "pinball"}]))


def test_check_says_of_a_mesh_that_its_memory_is_not_estimated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes, corners = moved_grid((1.0, 1.0), (4, 4), 0.0)
    write(tmp_path / "square.vtu", nodes, quad=around(corners))
    (tmp_path / "scene.toml").write_text("""
schema = 1
dim = 2
run = { integrator = "leapfrog", end = 1.0, cfl = 0.5 }
[[bodies]]
name = "b"
mesh = { file = "square.vtu" }
state = "strain"
material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.3 }
""")
    assert main(["check", str(tmp_path / "scene.toml")]) == 0
    assert "not estimated: all bodies are from mesh files" in capsys.readouterr().out


def test_a_mesh_has_its_own_cells(tmp_path: Path) -> None:
    found = compose(meshed_scene(tmp_path)).bodies[0].system.geometry
    assert isinstance(found, Meshed)
    assert np.sum(found.cell_volume) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "body",
    [
        scenes.body(DISC, 0.1),
        scenes.body({"type": "ring", "center": [0.0, 0.0], "inner": 0.25, "outer": 0.5}, 0.05),
        scenes.body({"type": "sphere", "center": [0.0] * 3, "radius": 0.5}, 0.125),
        scenes.body(scenes.box((0.25, 0.5), (0.0, 6.28)), [0.05, 0.157], map=["x*cos(y)", "x*sin(y)"]),
    ],
    ids=["disc", "ring", "sphere", "mapped"],
)
def test_points_up_to_a_round_surface_are_inside_and_none_half_a_cell_beyond(body: dict[str, Any]) -> None:
    found: Any = compose(scenes.scene(body)).bodies[0].system.geometry
    dim = found.nodes.shape[1]
    ways = np.random.default_rng(1).standard_normal((50, dim))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    size = float(found.edges[1])
    assert found.holds(0.5 * ways).all()
    assert found.holds(0.3 * ways).all()
    assert not found.holds((0.5 + 0.3 * size) * ways).any()
    if dim == 2 and np.hypot(*found.nodes.T).min() > 0.2:
        assert found.holds(0.2501 * ways).all()
        assert not found.holds((0.25 - 0.3 * size) * ways).any()
