"""Lattices: volumes, faces, corners, jitter."""

import numpy as np
import pytest

from tests.scenes import box, cube, shape
from wsph.geometry.lattice import lattice
from wsph.geometry.shapes.box import Box


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_volumes_faces_and_corners(dim: int) -> None:
    n = 5
    body = lattice(shape(**cube(dim)), 1.0 / n)
    assert len(body.nodes) == (n + 1) ** dim
    assert len(body.cells) == n**dim
    assert body.node_volume.sum() == pytest.approx(1.0, rel=1e-14)
    assert body.cell_volume.sum() == pytest.approx(1.0, rel=1e-14)
    assert body.node_volume.min() == pytest.approx((0.5 / n) ** dim)
    assert len(body.faces.area) == 2 * dim * n ** (dim - 1)
    for name in ("+x", "-x"):
        rows = body.faces.named(name)
        assert body.faces.area[rows].sum() == pytest.approx(1.0)
        assert (body.nodes[body.faces.nodes[rows]][..., 0] == (1.0 if name == "+x" else 0.0)).all()
    assert body.on_face.sum() == (n + 1) ** dim - (n - 1) ** dim


def test_the_last_node_is_the_corner_to_the_last_bit() -> None:
    assert lattice(Box(type="box", min=[0.1], max=[0.7]), 0.6 / 7).nodes[-1, 0] == 0.7


def test_jitter_keeps_faces_and_is_seeded() -> None:
    body, again, other = (lattice(shape(**cube(2)), 0.1, 0.4, seed) for seed in (3, 3, 4))
    straight = lattice(shape(**cube(2)), 0.1)
    assert (body.nodes == again.nodes).all()
    assert (body.nodes != other.nodes).any()
    moved = np.abs(body.nodes - straight.nodes)
    assert moved.max() <= 0.04 + 1e-15
    assert moved.max() > 0.03
    for axis in range(2):
        on = body.faces.nodes[body.faces.axis == axis]
        assert (moved[on, axis] == 0.0).all()
    np.testing.assert_allclose(body.cells, body.nodes[body.corners].mean(1))


SQUARE = box(4.0, 4.0)
HOLE = box((1.0, 3.0), (1.0, 2.0))


def test_a_hole_has_faces_that_are_not_the_outer_ones() -> None:
    body = lattice(shape(type="difference", shapes=[SQUARE, HOLE]), 0.5)
    assert body.cell_volume.sum() == pytest.approx(14.0)
    assert body.faces.outer.sum() == 32
    assert len(body.faces.area) == 32 + 12
    for name in ("-x", "+x", "-y", "+y"):
        assert body.faces.area[body.faces.named(name)].sum() == pytest.approx(4.0)


def test_a_turned_lattice_fills_the_same_square() -> None:
    body = lattice(shape(**SQUARE), 0.05, lattice_rotate=30.0)
    assert body.cell_volume.sum() == pytest.approx(16.0, rel=0.01)
    assert body.nodes.min() > -0.05
    edges = body.nodes[body.corners[:, 1]] - body.nodes[body.corners[:, 0]]
    np.testing.assert_allclose(np.degrees(np.arctan2(edges[:, 1], edges[:, 0])) % 90.0, 30.0)


def test_a_turned_box_turns_about_its_middle_and_keeps_the_names_of_its_faces() -> None:
    body = lattice(shape(type="box", min=[0.0, 0.0, 0.0], max=[1.0, 2.0, 1.0], rotate=["z", 90.0]), 0.25)
    np.testing.assert_allclose([body.nodes.min(0), body.nodes.max(0)], [[-0.5, 0.5, 0.0], [1.5, 1.5, 1.0]], atol=1e-12)
    on = np.unique(body.faces.nodes[body.faces.named("+y")])
    np.testing.assert_allclose(body.nodes[on, 0], -0.5, atol=1e-12)


def test_spacing_per_axis() -> None:
    body = lattice(shape(type="box", min=[0.0, 0.0], max=[1.0, 0.02]), (0.05, 0.01))
    assert len(body.nodes) == 21 * 3
    assert body.spacing == pytest.approx(0.01)
    assert body.faces.area[body.faces.named("+x")] == pytest.approx([0.01, 0.01])
    assert body.cell_volume.sum() == pytest.approx(0.02)


def polar(points: np.ndarray) -> np.ndarray:
    """The unit square bent to a quarter of a ring between radii 1 and 2."""
    r, angle = 1.0 + points[:, 0], 0.5 * np.pi * points[:, 1]
    return np.stack([r * np.cos(angle), r * np.sin(angle)], 1)


def test_a_map_moves_nodes_volumes_and_areas() -> None:
    body = lattice(shape(**cube(2)), 1 / 40, map=polar)
    assert body.mapped
    assert body.cell_volume.sum() == pytest.approx(0.25 * np.pi * 3.0, rel=1e-3)
    assert body.node_volume.sum() == pytest.approx(body.cell_volume.sum(), rel=1e-14)
    for name, length in (("-x", 0.5 * np.pi), ("+x", np.pi), ("-y", 1.0), ("+y", 1.0)):
        assert body.faces.area[body.faces.named(name)].sum() == pytest.approx(length, rel=1e-3)
    assert body.spacing == pytest.approx(1 / 40, rel=1e-9)
    assert body.edges[1] == pytest.approx(np.pi / 40, rel=1e-3)
    with pytest.raises(ValueError, match="inside out"):
        lattice(shape(**cube(2)), 0.1, map=lambda x: x * [1.0, -1.0])
    with pytest.raises(ValueError, match="not finite"):
        lattice(shape(**cube(2)), 0.1, map=lambda x: x / 0.0 if len(x) == 0 else np.full_like(x, np.nan))


def test_a_map_in_three_dimensions() -> None:
    body = lattice(shape(**cube(3)), 0.1, map=lambda x: np.concatenate([polar(x[:, :2]), 2.0 * x[:, 2:]], 1))
    assert body.cell_volume.sum() == pytest.approx(0.5 * np.pi * 3.0, rel=5e-3)
    assert body.faces.area[body.faces.named("+z")].sum() == pytest.approx(0.25 * np.pi * 3.0, rel=5e-3)
    assert body.faces.area[body.faces.named("+x")].sum() == pytest.approx(2.0 * np.pi, rel=3e-3)


def test_a_map_that_leaves_the_shortest_edge_as_it_was_is_a_map() -> None:
    body = lattice(shape(**cube(2)), 0.25, map=lambda x: np.stack([x[:, 0], x[:, 1] * (1.0 + x[:, 0])], 1))
    assert body.edges[0] == 0.25
    assert body.mapped
    assert body.irregular
    assert body.boxes is None
    assert body.cell_volume.sum() == pytest.approx(1.5)
    assert body.mean_volume == pytest.approx(1.5 / 16.0)
    assert not lattice(shape(**cube(2)), 0.25, map=lambda x: x.copy()).mapped
