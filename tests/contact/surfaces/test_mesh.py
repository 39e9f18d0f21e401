"""Surfaces on the host: closed, on the shape, with its areas and its normals, and with both banks of what is cut."""

import numpy as np
import pytest

from tests import scenes
from tests.contact.surfaces.bodies import BODIES, CYLINDER, DISC, PLATE, SLIT, SPHERE, SQUARE, cut, whole
from wsph.contact.surfaces.meshing.mesh import SurfaceMesh, area_vectors
from wsph.geometry.geometry import Geometry

TURNED = [
    (scenes.box(3.0, 1.0), n, {"lattice_rotate": angle}, 8.0, 1e-12)
    for angle in (10.0, 30.0, 45.0)
    for n in (5, 10, 20)
]


def vectors(mesh: SurfaceMesh) -> np.ndarray:
    return area_vectors(mesh.X, mesh.faces, mesh.N)


@pytest.mark.parametrize(
    ("shape", "cells", "keys", "area", "off"),
    [
        # Chords of a circle are short by their angle squared/24, some 1/(4 n)^2.
        (DISC, 10, {}, 2.0 * np.pi, 4e-4),
        (DISC, 40, {}, 2.0 * np.pi, 3e-5),
        (SPHERE, 10, {}, 4.0 * np.pi, 2e-3),
        (SPHERE, 20, {}, 4.0 * np.pi, 5e-4),
        (CYLINDER, 10, {}, 6.0 * np.pi, 1e-3),
        ({"type": "polygon", "points": [[0, 0], [1, 0], [0, 1]]}, 10, {}, 2.0 + 2.0**0.5, 1e-12),
        (PLATE, 8, {}, 8.0 + np.pi, 6e-4),
        (PLATE, 32, {}, 8.0 + np.pi, 4e-5),
        (scenes.box(2.0, 1.0, 1.0), 5, {"lattice_rotate": ((0.0, 0.0, 1.0), 30.0)}, 10.0, 1e-12),
        *TURNED,
    ],
)
def test_areas_are_those_of_the_shape(shape: scenes.Data, cells: int, keys: dict, area: float, off: float) -> None:
    geometry = cut(shape, 1.0 / cells, **keys)
    assert whole(geometry).A.sum() == pytest.approx(area, rel=off)
    # What the stairs have: a seventh too much and more.
    assert geometry.faces.area.sum() > 1.05 * area


@pytest.mark.parametrize("name", BODIES)
def test_a_surface_is_closed(name: str) -> None:
    """The sum of n A is zero, and every edge has two faces, which run along it in opposite ways."""
    mesh = whole(BODIES[name]())
    assert np.abs(vectors(mesh).sum(0)).max() < 1e-14 * mesh.A.sum()
    dim = mesh.faces.shape[1]
    if dim > 1:
        faces = mesh.faces
        ways = [faces[:, [k, (k + 1) % dim]] for k in range(dim)] if dim == 3 else [faces]
        ends = np.concatenate(ways)
        if dim == 3:
            there, back = ({tuple(end) for end in each} for each in (ends, ends[:, ::-1]))
            assert there == back
        else:
            assert (np.sort(ends[:, 0]) == np.sort(ends[:, 1])).all()


@pytest.mark.parametrize("name", BODIES)
def test_faces_look_out_of_the_body(name: str) -> None:
    """The volume inside the faces is that of the body."""
    geometry: Geometry = BODIES[name]()
    mesh = whole(geometry)
    inside = (mesh.X[mesh.faces].mean(1) * vectors(mesh)).sum() / mesh.X.shape[1]
    # Stairs have up to 7 % less or more of a volume than their shape has.
    off = 0.07 if mesh.moved.any() else 0.02
    assert inside == pytest.approx(geometry.cell_volume.sum(), rel=off)
    assert (vectors(mesh) * mesh.N).sum(1).min() >= -1e-12 * mesh.A.max()


def test_vertices_lie_on_all_patches_of_their_faces() -> None:
    """The corner of a turned lattice is the corner of the box, the rim of a disc has its radius."""
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 1.0], [3.0, 1.0]])
    mesh = whole(cut(scenes.box(3.0, 1.0), 0.1, lattice_rotate=30.0))
    for corner in corners:
        assert np.linalg.norm(mesh.X - corner, axis=1).min() < 1e-12
    assert np.linalg.norm(whole(cut(DISC, 0.1)).X, axis=1) == pytest.approx(1.0, abs=1e-12)
    ball = whole(cut(SPHERE, 0.2))
    assert np.linalg.norm(ball.X, axis=1) == pytest.approx(1.0, abs=1e-12)
    middles = ball.X[ball.faces].mean(1)
    assert pytest.approx(middles / np.linalg.norm(middles, axis=1, keepdims=True), abs=1e-12) == ball.N


@pytest.mark.parametrize("keys", [{}, {"jitter": 0.2}, {"cracks": SLIT}])
def test_what_lies_on_the_shape_keeps_its_bits(keys: dict) -> None:
    geometry = cut({**SQUARE, "rotate": 0.0}, 0.1, **keys)
    mesh = whole(geometry)
    assert not mesh.moved.any()
    assert (geometry.nodes[mesh.boundary.node] == mesh.X).all()


@pytest.mark.parametrize("split", [True, False])
def test_both_banks_of_a_crack_have_vertices_of_their_own(split: bool) -> None:
    """Five sides of cells on either bank: four nodes twice, the mouth twice, the tip once."""
    geometry = cut(SQUARE, 0.1, cracks=SLIT, split=split)
    parted = np.zeros((0, 2), int)
    if not split:
        rows = 0.05 + 0.1 * np.arange(5)
        parted = np.array(
            [[np.linalg.norm(geometry.cells - [x, y], axis=1).argmin() for x in (0.45, 0.55)] for y in rows]
        )
    mesh = whole(geometry, parted)
    on = np.abs(mesh.X[:, 0] - 0.5) < 1e-12
    heights, counts = np.unique(np.round(mesh.X[on & (mesh.X[:, 1] < 0.6), 1], 9), return_counts=True)
    assert heights == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert counts.tolist() == [2, 2, 2, 2, 2, 1]
    assert mesh.A.sum() == pytest.approx(5.0)
    tip = np.flatnonzero(on & (np.abs(mesh.X[:, 1] - 0.5) < 1e-12))
    assert mesh.groups()[2][tip].all()
    # The last cells of both banks share the tip, and do not hang together there.
    joins = {tuple(pair) for pair in mesh.boundary.joins.tolist()}
    assert not any(tuple(pair) in joins for pair in parted.tolist())


def test_cells_that_meet_at_a_corner_alone_have_a_vertex_each() -> None:
    shapes = [scenes.box((0.0, 0.5), (0.0, 0.5)), scenes.box((0.5, 1.0), (0.5, 1.0))]
    mesh = whole(cut({"type": "union", "shapes": shapes}, 0.1))
    pinched = np.flatnonzero(np.linalg.norm(mesh.X - 0.5, axis=1) < 1e-12)
    assert len(pinched) == 2
    assert len(mesh.X) == 40
    assert (np.diff(mesh.starts) == 2).all()


def test_edges_and_corners_are_sharp_and_round_sides_are_not() -> None:
    assert whole(cut(scenes.box(1.0, 1.0), 0.1)).groups()[2].sum() == 4
    assert whole(cut(scenes.box(1.0, 1.0, 1.0), 0.2)).groups()[2].sum() == 12 * 4 + 8
    assert not whole(cut(SPHERE, 0.1)).groups()[2].any()
    rims = whole(cut(CYLINDER, 0.1))
    assert np.linalg.norm(rims.X[rims.groups()[2]][:, :2], axis=1) == pytest.approx(1.0)
    assert np.unique(np.round(rims.X[rims.groups()[2]][:, 2], 9)).tolist() == [0.0, 2.0]


@pytest.mark.parametrize("name", ["bar", "cracked square", "sphere", "tetrahedra and cubes"])
def test_groups_are_the_faces_around_a_corner_that_meet_it_smoothly(name: str) -> None:
    mesh = whole(BODIES[name]())
    starts, smooth, _ = mesh.groups()
    dim = mesh.faces.shape[1]
    for corner in np.random.default_rng(3).integers(0, mesh.faces.size, 40):
        face = corner // dim
        around = np.flatnonzero((mesh.faces == mesh.faces.ravel()[corner]).any(1))
        own = around[mesh.N[around] @ mesh.N[face] > 0.64]
        assert smooth[starts[corner] : starts[corner + 1]].tolist() == own.tolist()


@pytest.mark.parametrize("name", ["rectangle", "cracked square", "cube"])
def test_near_are_the_faces_within_two_rings(name: str) -> None:
    mesh = whole(BODIES[name]())
    rings = [set(np.flatnonzero((mesh.faces == v).any(1)).tolist()) for v in range(len(mesh.X))]
    for v in range(0, len(mesh.X), 7):
        own = set().union(*(rings[w] for f in rings[v] for w in mesh.faces[f]))
        keys = mesh.near[mesh.near // len(mesh.faces) == v] % len(mesh.faces)
        assert set(keys.tolist()) == own


def test_a_turned_lattice_folds_no_faces() -> None:
    """Under many angles; in three dimensions some would be, and are laid flat."""
    bodies = [(scenes.box(3.0, 1.0), 1.0 / n, float(a), 8.0) for a in range(3, 90, 12) for n in (5, 7, 16)]
    bodies += [(scenes.box(2.0, 1.0, 1.0), 0.125, ((1.0, 1.0, 0.3), 45.0), 10.0)]
    for shape, spacing, turn, area in bodies:
        mesh = whole(cut(shape, spacing, lattice_rotate=turn))
        assert (vectors(mesh) * mesh.N).sum(1).min() > -1e-9 * mesh.A.max()
        assert mesh.A.sum() == pytest.approx(area, rel=1e-9)
