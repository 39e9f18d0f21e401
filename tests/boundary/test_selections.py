"""What conditions select, and the resultants of their loads: as they are asked for, on every form."""

import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.boundary.selections import Selection, selections
from wsph.cli import main
from wsph.errors import SceneError
from wsph.scene.load import load
from wsph.simulation.compose import compose
from wsph.validation import meshes

METHODS = [("leapfrog", "stress-points"), ("leapfrog", "total-lagrangian"), ("leapfrog", "updated-lagrangian"), ("tsph", "small-strain"), ("ul-tsph", "updated-lagrangian")]  # fmt: skip


def found(method: tuple[str, str], dim: int, boundary: list[Any], **tables: Any) -> list[Selection]:
    """What the conditions of a block of 2 x 1 (x 1) select; `shape` and `spacing` among the tables are the body's."""
    keys = {"shape": tables.pop("shape", scenes.box(*(2.0, 1.0, 1.0)[:dim])), "spacing": tables.pop("spacing", 0.25)}
    run = {"integrator": method[0], "formulation": method[1], "cfl": 0.1, "end": 2.0}
    scene = scenes.scene(scenes.body(**keys), run=run, boundary=boundary, **tables)
    system = compose(scene).bodies[0].system
    return list(selections(scene, "b", system.geometry, system.position, scene.run.end))


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_areas_and_resultants_are_those_of_the_face(method: tuple[str, str], dim: int) -> None:
    pull = {"body": "b", "face": "+x", "stress": {"xx": 3.0}}
    fixed, pulled = found(method, dim, [scenes.held("-x", dim), pull])
    assert fixed.resultant is None
    assert fixed.faces == {"-x": pytest.approx(1.0)}
    assert pulled.faces == {"+x": pytest.approx(1.0)}
    assert pulled.resultant == pytest.approx([3.0, 0.0, 0.0][:dim])
    at_nodes = method[1] != "updated-lagrangian" or method[0] == "ul-tsph"
    assert pulled.particles == (5 if at_nodes else 4) ** (dim - 1)


@pytest.mark.parametrize("method", METHODS[:3], ids=str)
def test_tractions_of_both_directions_add_up(method: tuple[str, str]) -> None:
    [pulled] = found(method, 2, [{"body": "b", "face": "+y", "traction": {"x": "1 + y", "y": -2.0}}])
    top = 1.0 if method[1] != "updated-lagrangian" else 0.875
    assert pulled.resultant == pytest.approx([2.0 * (1.0 + top), -4.0])


@pytest.mark.parametrize("method", METHODS[:2], ids=str)
def test_a_stress_acts_along_the_axes_of_a_turned_shape(method: tuple[str, str]) -> None:
    turned = {**scenes.box(2.0, 1.0), "rotate": 30.0}
    [pulled] = found(method, 2, [{"body": "b", "face": "+x", "stress": {"xx": 1.0, "xy": 0.5}}], shape=turned)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    assert pulled.resultant == pytest.approx([c - 0.5 * s, s + 0.5 * c])


@pytest.mark.parametrize(
    ("function", "peak", "at"),
    [({"t": [0.0, 0.5, 1.0], "value": [0.0, -7.0, 1.0]}, -7.0, 0.5), ({"t": [0.0, 0.5, 1.0], "value": [1.0, 3.0, 8.0], "interp": "step"}, 3.0, 1.0),
     ({"expression": "4*sin(pi*t/2)"}, 4.0, 1.0), ({"t": [0.0, 5.0], "value": [2.0, 9.0]}, 2.0, 0.0)],
    ids=str,
)  # fmt: skip
def test_a_load_in_time_is_shown_at_its_largest(function: Any, peak: float, at: float) -> None:
    """Within the run: entries of tables beyond its end do not count."""
    pull = {"body": "b", "face": "+x", "traction": {"x": "f"}}
    [pulled] = found(METHODS[0], 2, [pull], functions={"f": function})
    assert pulled.resultant == pytest.approx([peak, 0.0])
    assert pulled.time == pytest.approx(at)


def test_what_a_where_takes_in_beside_the_face_shows() -> None:
    """A region that is thicker than the face has the faces around the corner in it."""
    wide = {"body": "b", "where": "x >= 1.7", "traction": {"y": 1.0}}
    [pulled] = found(METHODS[0], 2, [wide])
    assert pulled.faces == {"+x": pytest.approx(1.0), "-y": pytest.approx(0.25), "+y": pytest.approx(0.25)}
    assert pulled.resultant == pytest.approx([0.0, 1.5])
    assert str(pulled) == "b, where x >= 1.7: 10 particles, faces +x 1 m, -y 0.25 m, +y 0.25 m; resultant (0, 1.5) N/m"


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("method", METHODS[:2], ids=str)
def test_a_pressure_pushes_against_its_face_and_a_spring_does_not(method: tuple[str, str], dim: int) -> None:
    both = [{"body": "b", "face": "+x", "pressure": 3.0}, {"body": "b", "face": "-x", "spring": {"stiffness": 1.0}}]
    pushed, held = found(method, dim, both)
    assert pushed.resultant == pytest.approx([-3.0, 0.0, 0.0][:dim])
    assert held.resultant is None


DISCS = {"type": "difference", "shapes": [
    {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, {"type": "disc", "name": "bore", "center": [0.0, 0.0], "radius": 0.5}]}  # fmt: skip


def test_a_patch_of_a_fitted_body_is_named_and_what_cancels_is_zero() -> None:
    """Cells of no grid: a pressure balances itself round the bore, and one that grows with x pushes by the bore's area."""
    inside = {"body": "b", "patch": "bore", "pressure": 2.0}
    slanted = {"body": "b", "where": "x*x + y*y < 0.3", "pressure": "2*x"}
    whole, other = found(METHODS[0], 2, [inside, slanted], shape=DISCS, spacing=0.125)
    assert str(whole).startswith("b, patch bore: ")
    assert str(whole).endswith("; resultant (0, 0) N/m")
    assert sum(whole.faces.values()) == pytest.approx(np.pi, rel=0.01)
    assert other.resultant == pytest.approx([2.0 * np.pi * 0.25, 0.0], rel=0.02)


HOLE = {"type": "difference", "shapes": [scenes.box(2.0, 2.0), {"type": "disc", "center": [1.0, 1.0], "radius": 0.5}]}
STEPPED = {"type": "polygon", "points": [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]}


@pytest.mark.parametrize("method", METHODS[:3], ids=str)
@pytest.mark.parametrize(("shape", "area"), [(HOLE, 2.0), (STEPPED, 1.0)], ids=["hole", "step"])
def test_a_load_on_a_face_takes_in_no_side_of_a_hole_and_no_step(
    method: tuple[str, str], shape: Any, area: float
) -> None:
    pull = {"body": "b", "face": "+x", "traction": {"x": 1.0}}
    [pulled] = found(method, 2, [pull], shape=shape, spacing=0.125)
    assert pulled.faces == {"+x": pytest.approx(area)}
    assert pulled.resultant == pytest.approx([area, 0.0])


def test_a_face_that_is_not_there_is_refused_with_those_that_are() -> None:
    body = scenes.body(scenes.cube(2), 0.1, lattice_rotate=45.0)
    with pytest.raises(SceneError, match=r"boundary.0.face: '\+y' is no face of 'b', which has -x, \+x"):
        compose(scenes.scene(body, run={"integrator": "tsph"}, boundary=[scenes.driven("+y", x=0.1)]))
    with pytest.raises(SceneError, match=r"boundary.0.where: 'x > 3' selects no particle of 'b'"):
        compose(scenes.scene(body, boundary=[{"body": "b", "where": "x > 3", "fixed": ["x", "y"]}]))


@pytest.mark.parametrize("name", ["cantilever", "ring"])
def test_check_prints_every_condition_and_the_memory(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    example = Path(wsph.__file__).parents[1] / "examples" / f"{name}.toml"
    assert main(["check", str(example)]) == 0
    said = capsys.readouterr().out
    conditions = load(example).boundary
    assert len(conditions) > 0
    for k, condition in enumerate(conditions):
        assert re.search(rf"^boundary {k} +{condition.body}, .*: \d+ particles, faces .* m", said, re.MULTILINE), said
    assert re.search(
        r"^memory +estimated .*B of arrays and .*B on the host while they are set up; .*B free$", said, re.MULTILINE
    )


def test_patches_of_fitted_bodies_and_their_pressures_are_told() -> None:
    ring = {"type": "difference", "shapes": [{"type": "disc", "center": [2.0, 0.0], "radius": 1.0},
                                             {"type": "disc", "name": "bore", "center": [2.0, 0.0], "radius": 0.5}]}  # fmt: skip
    inside = {"body": "b", "patch": "bore", "pressure": 3.0}
    half = {"body": "b", "where": "abs((x - 2)**2 + y**2 - 1) < 0.02 and x >= 2", "pressure": 2.0}
    [bore, pushed] = found(METHODS[0], 2, [inside, half], shape=ring, spacing=0.1)
    assert "patch bore" in str(bore)
    assert bore.resultant == pytest.approx([0.0, 0.0], abs=1e-12)
    assert sum(bore.faces.values()) == pytest.approx(np.pi, rel=2e-3)
    # On half of the rim: p times the diameter.
    assert pushed.resultant == pytest.approx([-4.0, 0.0], abs=1e-9)


def test_a_body_of_a_mesh_is_checked_with_its_patches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nodes, corners = meshes.moved_grid((2.0, 1.0), (4, 2), 0.2)
    mesh = meshio.Mesh(
        np.pad(nodes, ((0, 0), (0, 1))),
        [("quad", meshes.around(corners))],
        point_sets={"low": np.array([0, 3, 6, 9, 12])},
    )
    mesh.write(tmp_path / "block.inp")
    text = """schema = 1
dim = 2
run = { integrator = "leapfrog", formulation = "stress-points", end = 1.0, cfl = 0.5 }
boundary = [{ body = "b", patch = "low", pressure = 2.0 }]
[[bodies]]
name = "b"
mesh = { file = "block.inp" }
state = "strain"
material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.3 }
"""
    (tmp_path / "block.toml").write_text(text)
    assert main(["check", str(tmp_path / "block.toml")]) == 0
    out = capsys.readouterr().out
    assert "  patch        low: area 2 m, centre (1, 0) m, normal (0, -1)" in out
    assert "unnamed" in out
    assert "boundary 0     b, patch low: 5 particles, faces -y 2 m; resultant (0, 4) N/m" in out
    assert "not estimated: all bodies are from mesh files" in out
