"""Mesh files: what is read of every format, names of parts and patches, and what is refused by name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import wsph
from wsph.geometry.meshes.files import read_mesh
from wsph.geometry.meshes.mesh import Mesh
from wsph.geometry.meshes.meshed import meshed
from wsph.simulation.compose import compose
from wsph.validation import meshes

# Two squares side by side, of steel and of copper; a node that no cell has.
POINTS = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1], [0.5, 7]], float)
STEEL, COPPER = [[0, 1, 2, 3]], [[1, 4, 5, 2]]
LEFT, RIGHT, BETWEEN = [[3, 0]], [[4, 5]], [[1, 2]]
PARTED = {"left": [(0.0, 0.5)], "right": [(2.0, 0.5)]}


def padded(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points, np.zeros((len(points), 3 - points.shape[1]))], 1)


def middles(mesh: Mesh, name: str) -> list[tuple[float, ...]]:
    """Middles of the sides of a patch."""
    return sorted(tuple(mesh.nodes[side].mean(0).tolist()) for side in mesh.sides[mesh.named[name]])


def gmsh(path: Path, kind: str, binary: bool, names: bool = True) -> Path:
    """Both squares with physical groups of curves and of surfaces, numbered from 1 on in each dimension."""
    cells = [("quad", np.array(STEEL)), ("quad", np.array(COPPER)), ("line", np.array(LEFT)), ("line", np.array(RIGHT))]
    tags = [np.array([k]) for k in (1, 2, 1, 2)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    # Every entity has a node, without which the writer of 4.1 leaves it out.
    entities = {"gmsh:dim_tags": np.array([[2, 1], [2, 2], [1, 1], [1, 2], [2, 1], [2, 1], [2, 2]])}
    fields = {"left": [1, 1], "right": [2, 1], "steel": [1, 2], "copper": [2, 2]} if names else {}
    mesh = meshio.Mesh(padded(POINTS), cells, cell_data=data, point_data=entities if kind == "gmsh" else {},
                       field_data={name: np.array(value) for name, value in fields.items()})  # fmt: skip
    mesh.write(path, file_format=kind, binary=binary)
    return path


INP = """*HEADING
two squares
** a comment, and an element without a set before one that has one
*NODE
10, 0., 0.
20, 1., 0.
30, 1., 1.
40, 0., 1.
50, 2., 0.
60, 2., 1.
*ELEMENT, TYPE=CPS4R
7, 10, 20, 30, 40
*ELEMENT, TYPE=CPS4R, ELSET=copper
9, 20, 50, 60, 30
*ELSET, ELSET=steel
7
*ELSET, ELSET=both
steel, copper
*NSET, NSET=left
10, 40
*NSET, NSET=below, GENERATE
10, 20, 10
*SURFACE, NAME=right, TYPE=ELEMENT
copper, S2
*MATERIAL, NAME=Steel
*ELASTIC
210e9, 0.3
"""


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("kind", ["gmsh22", "gmsh"])
def test_groups_of_gmsh_are_parts_and_patches(tmp_path: Path, kind: str, binary: bool) -> None:
    """Formats 2.2 and 4.1. The same number is one group among curves and another one among surfaces."""
    path = gmsh(tmp_path / "two.msh", kind, binary)
    mesh = read_mesh(path, 2, 1.0)
    assert meshed(mesh).cell_volume.sum() == pytest.approx(2.0)
    assert len(mesh.nodes) == 6  # the one that no cell has is left out
    assert {name: middles(mesh, name) for name in PARTED} == PARTED
    assert middles(mesh, "unnamed") == [(0.5, 0.0), (0.5, 1.0), (1.5, 0.0), (1.5, 1.0)]
    part = read_mesh(path, 2, 1e-3, "copper")
    assert part.nodes.min(0) == pytest.approx([1e-3, 0.0])
    assert middles(part, "right") == [pytest.approx((2e-3, 0.5e-3))]
    assert "left" not in part.named


def test_groups_without_a_name_have_their_number(tmp_path: Path) -> None:
    mesh = read_mesh(gmsh(tmp_path / "two.msh", "gmsh22", False, names=False), 2, 1.0)
    assert (middles(mesh, "1"), middles(mesh, "2")) == (PARTED["left"], PARTED["right"])
    assert read_mesh(tmp_path / "two.msh", 2, 1.0, "2").nodes[:, 0].min() == 1.0


def test_a_cell_that_is_in_two_groups_is_there_once(tmp_path: Path) -> None:
    """Format 2.2 has a cell again for each of its groups."""
    cells = [("quad", np.array(STEEL)), ("quad", np.array([STEEL[0], COPPER[0]]))]
    tags = [np.array([1]), np.array([2, 2])]
    mesh = meshio.Mesh(padded(POINTS), cells, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
                       field_data={"steel": np.array([1, 2]), "all": np.array([2, 2])})  # fmt: skip
    mesh.write(tmp_path / "twice.msh", file_format="gmsh22", binary=False)
    found = read_mesh(tmp_path / "twice.msh", 2, 1.0)
    assert meshed(found).cell_volume == pytest.approx([1.0, 1.0])
    assert len(found.sides) == 6
    assert len(read_mesh(tmp_path / "twice.msh", 2, 1.0, "steel").sides) == 4


def test_sets_of_abaqus_are_parts_and_patches(tmp_path: Path) -> None:
    path = tmp_path / "two.inp"
    path.write_text(INP)
    mesh = read_mesh(path, 2, 1.0)
    assert {name: middles(mesh, name) for name in PARTED} == PARTED
    assert middles(mesh, "below") == [(0.5, 0.0)]
    assert {name: float(read_mesh(path, 2, 1.0, name).nodes[:, 0].mean()) for name in ("steel", "copper", "both")} == {
        "steel": 0.5, "copper": 1.5, "both": 1.0}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "text"), [
    ("CPS4R", "CPS8R", "line 11, \\*ELEMENT: elements of TYPE=CPS8R are none of"),
    ("50, 60, 30", "50, 60", "4 numbers are no rows of 5"),
    ("steel, copper", "steal, copper", "line 17, \\*ELSET: there is no set 'steal'"),
    ("copper, S2", "copper, S7", "a quad has no side 'S7'"),
    ("9, 20, 50", "9, 21, 50", "element 9 has the node 21, which there is not"),
    ("*NODE", "*PART, NAME=a\n*PART, NAME=b\n*NODE", "a second \\*PART"),
    ("*MATERIAL, NAME=Steel", "*INSTANCE, NAME=a, PART=p\n1., 0., 0.", "an \\*INSTANCE that is moved"),
    ("*MATERIAL, NAME=Steel", "*INCLUDE, INPUT=more.inp", "\\*INCLUDE is not followed"),
])  # fmt: skip
def test_what_of_abaqus_is_refused(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in INP
    (tmp_path / "two.inp").write_text(INP.replace(old, new, 1))
    with pytest.raises(ValueError, match=f"two.inp cannot be read as a mesh: .*{text}"):
        read_mesh(tmp_path / "two.inp", 2, 1.0)


@pytest.mark.parametrize(("kind", "width"), [("hexahedron", 8), ("tetra", 4)])
def test_sides_of_solid_surfaces_are_those_of_abaqus(tmp_path: Path, kind: str, width: int) -> None:
    """Every side of every cell, as a surface of its own, is an outer side of that cell alone, and together they close it."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    rows = list(range(8)) if width == 8 else [0, 1, 3, 4]
    lines = ["*NODE", *(f"{k + 1}, {', '.join(map(str, p))}" for k, p in enumerate(nodes.tolist()))]
    lines += [f"*ELEMENT, TYPE=C3D{width}, ELSET=e", f"1, {', '.join(str(k + 1) for k in rows)}"]
    count = {8: 6, 4: 4}[width]
    lines += [line for k in range(1, count + 1) for line in (f"*SURFACE, NAME=side{k}", f"e, S{k}")]
    (tmp_path / "one.inp").write_text("\n".join(lines))
    mesh = read_mesh(tmp_path / "one.inp", 3, 1.0)
    found = [middles(mesh, f"side{k}") for k in range(1, count + 1)]
    assert all(len(each) == 1 for each in found)
    assert sorted(each[0] for each in found) == sorted(tuple(mesh.nodes[side].mean(0).tolist()) for side in mesh.sides)
    # S1 is the one below; of a hexahedron S2 is above, and of a tetrahedron S4 is the side x = 0.
    assert found[0][0][2] == 0.0
    assert found[1][0][2] == 1.0 if width == 8 else found[3][0][0] == 0.0


@pytest.mark.parametrize("kind", ["triangle", "quad", "tetra", "hexahedron"])
def test_cells_turned_round_are_turned_back(tmp_path: Path, kind: str) -> None:
    dim = 2 if kind in ("triangle", "quad") else 3
    nodes, corners = meshes.moved_grid([1.0] * dim, [3] * dim, 0.2)
    cells = {"triangle": meshes.triangles, "tetra": meshes.tetrahedra}.get(kind, meshes.around)(corners)
    turned = cells.copy()
    half = len(cells) // 2
    if kind in ("triangle", "tetra"):
        turned[:half, [0, 1]] = turned[:half, [1, 0]]
    else:
        turned[:half] = turned[:half][:, [0, 3, 2, 1] if dim == 2 else [0, 3, 2, 1, 4, 7, 6, 5]]
    for name, each in (("as.vtu", cells), ("turned.vtu", turned)):
        meshes.write(tmp_path / name, nodes, **{kind: each})
    one, other = (meshed(read_mesh(tmp_path / name, dim, 1.0)) for name in ("as.vtu", "turned.vtu"))
    assert other.cell_volume.min() > 0.0
    assert np.sort(other.cell_volume) == pytest.approx(np.sort(one.cell_volume), rel=1e-12)
    assert other.faces.vector.sum((0, 1)) == pytest.approx(0.0, abs=1e-14)


def written(kind: str, points: np.ndarray, *blocks: tuple[str, Any]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = folder / f"mesh{kind}"
        meshio.Mesh(padded(points), [(name, np.array(rows)) for name, rows in blocks]).write(path)
        return path

    return write


def plain(name: str, text: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(text)
        return folder / name

    return write


def folder_of(folder: Path) -> Path:
    (folder / "bar.msh").mkdir()
    return folder / "bar.msh"


CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0, 0, 2], [1, 0, 2]], float)  # fmt: skip
FAN = [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
REFUSED: dict[str, tuple[int, Callable[[Path], Path], str | None, str]] = {
    "missing": (2, lambda folder: folder / "none.msh", None, "none.msh is no file"),
    "folder": (2, folder_of, None, "bar.msh is a folder"),
    "no mesh": (2, plain("a.msh", "$MeshFormat\nnonsense"), None, "a.msh cannot be read as a mesh"),
    "no kind": (2, plain("a.xyz", "1 2 3"), None, "a.xyz cannot be read as a mesh"),
    "quadratic": (2, written(".vtu", POINTS, ("triangle6", [[0, 1, 2, 3, 4, 5]])), None, "kind triangle6.* of the first order"),
    "wedge": (3, written(".vtu", CUBE, ("wedge", [[0, 1, 2, 4, 5, 6]])), None, "kind wedge"),
    "pyramid": (3, written(".vtu", CUBE, ("pyramid", [[0, 1, 2, 3, 4]])), None, "kind pyramid"),
    "surface alone": (3, written(".vtu", CUBE, ("triangle", [[0, 1, 2]])), None, "no hexahedron or tetra: it has triangle"),
    "solid in 2D": (2, written(".vtu", CUBE, ("tetra", [[0, 1, 2, 4]])), None, "kind tetra"),
    "not flat": (2, written(".vtu", CUBE, ("quad", [[0, 1, 2, 7]])), None, "not flat in z"),
    "not finite": (2, written(".vtu", POINTS * [1.0, np.nan], ("quad", STEEL)), None, "not finite"),
    "no part": (2, lambda folder: gmsh(folder / "p.msh", "gmsh22", False), "brass", "no group of cells 'brass': it has copper, steel"),
    "no parts": (2, written(".vtu", POINTS, ("quad", STEEL)), "steel", "no group of cells 'steel': it has none"),
    "flat cell": (2, written(".vtu", POINTS, ("triangle", [[0, 1, 2], [1, 4, 0]])), None, "1 cells have no positive volume, the worst at \\[1.0, 0.0\\]"),
    "crossed cell": (2, written(".vtu", POINTS, ("quad", [[0, 2, 1, 3]])), None, "1 cells have no positive volume, the worst at"),
    "three at a side": (2, written(".vtu", POINTS, ("triangle", FAN)), None, "more than two cells share the side at \\[0.5, 0.0\\]"),
    "kinds that meet": (3, written(".vtu", CUBE, ("hexahedron", [list(range(8))]), ("tetra", [[4, 5, 7, 8], [5, 6, 7, 8]])), None,
                        "tetrahedra meet hexahedra at"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(REFUSED))
def test_what_cannot_be_a_body_is_refused_by_name(tmp_path: Path, name: str) -> None:
    """In a scene: with the key, and without a traceback."""
    dim, write, part, text = REFUSED[name]
    mesh = {"file": write(tmp_path).name, **({"part": part} if part else {})}
    material = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}
    state = {"state": "strain"} if dim == 2 else {}
    body = {"name": "b", "mesh": {**mesh, "file": str(tmp_path / mesh["file"])}, "material": material, **state}
    run = {"integrator": "leapfrog", "formulation": "stress-points", "end": 1.0, "cfl": 0.5}
    scene = wsph.Scene(schema=1, dim=dim, run=run, bodies=[body])
    with pytest.raises(wsph.WsphError, match=f"bodies.0.mesh.*{text}"):
        compose(scene)


def test_in_one_dimension_a_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="the scene has dim = 1"):
        read_mesh(gmsh(tmp_path / "two.msh", "gmsh22", False), 1, 1.0)


def test_nodes_of_no_cell_are_refused_where_they_are_asked_for() -> None:
    mesh = Mesh(POINTS, (np.array([[0, 3, 1, 2]]),), np.array([[0, 1]]), np.array([0]), np.array([0]), ("a",))
    with pytest.raises(ValueError, match="3 nodes, the first at \\[2.0, 0.0\\] m, are corners of no cell"):
        meshed(mesh)


def test_a_patch_loads_the_sides_that_it_names(tmp_path: Path) -> None:
    """The resultant of a pressure on a patch is its area's."""
    path = gmsh(tmp_path / "two.msh", "gmsh22", False)
    material = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}
    body = {"name": "b", "mesh": {"file": str(path), "scale": "1 mm"}, "state": "strain", "material": material}
    run = {"integrator": "leapfrog", "formulation": "stress-points", "end": 1e-6, "dt": 1e-6}
    boundary = [{"body": "b", "patch": "right", "pressure": 1e-3}]
    result = wsph.run(wsph.Scene(schema=1, dim=2, run=run, bodies=[body], boundary=boundary))
    # m v = F t: two square millimetres of density 1, one millimetre of side.
    momentum = result.history["momentum_x"][-1]
    assert momentum == pytest.approx(-1e-3 * 1e-3 * 1e-6, rel=1e-6)
