"""Lattices: volumes, faces, corners, jitter."""

import numpy as np
import pytest

from wsph.particles import lattice
from wsph.shapes import Box


def box(dim: int, edge: float = 1.0) -> Box:
    """A cube."""
    return Box(type="box", min=[0.0] * dim, max=[edge] * dim)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_volumes_faces_and_corners(dim: int) -> None:
    n = 5
    body = lattice(box(dim), 1.0 / n)
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
    body, again, other = (lattice(box(2), 0.1, 0.4, seed) for seed in (3, 3, 4))
    straight = lattice(box(2), 0.1)
    assert (body.nodes == again.nodes).all()
    assert (body.nodes != other.nodes).any()
    moved = np.abs(body.nodes - straight.nodes)
    assert moved.max() <= 0.04 + 1e-15
    assert moved.max() > 0.03
    for axis in range(2):
        on = body.faces.nodes[body.faces.axis == axis]
        assert (moved[on, axis] == 0.0).all()
    np.testing.assert_allclose(body.cells, body.nodes[body.corners].mean(1))


def test_a_spacing_that_does_not_fit_names_the_two_that_do() -> None:
    with pytest.raises(ValueError, match=r"nearest that do: 0\.333333333333 m, 0\.5 m"):
        box(1).cells(0.4)
