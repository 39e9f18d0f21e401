"""A face by name is one thing on every shape: the outermost cell faces of its direction, and nothing beside or behind
them."""

import numpy as np
import pytest

from tests.scenes import Data, box, cube, shape
from wsph.geometry.faces import FACES
from wsph.geometry.lattice import Lattice, lattice

DISC = {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}
SPHERE = {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}
RING = {"type": "ring", "center": [0.0, 0.0], "inner": 0.5, "outer": 1.0}
BAR = {"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 0.0, 3.0], "radius": 1.0}
L_SHAPE = {"type": "polygon", "points": [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]}
U_SHAPE = {"type": "union", "shapes": [box(3.0, 1.0), box((0.0, 1.0), 2.0), box((2.0, 3.0), 1.5)]}
HOLED = {"type": "difference", "shapes": [box(4.0, 4.0), {"type": "disc", "center": [2.0, 2.0], "radius": 1.0}]}
# A wall of one cell between the hole and the outside.
THIN = {"type": "difference", "shapes": [box(4.0, 4.0), box((1.0, 3.75), (1.0, 3.0))]}
NOTCHED = {"type": "difference", "shapes": [box(4.0, 4.0), box((3.0, 4.0), (3.0, 4.0))]}

# A shape, its spacing, and per face where it lies along its axis and its area.
CASES: dict[str, tuple[Data, float, dict[str, tuple[float, float]]]] = {
    "box": (box(3.0, 2.0), 0.25, {"-x": (0.0, 2.0), "+x": (3.0, 2.0), "-y": (0.0, 3.0), "+y": (2.0, 3.0)}),
    "block": (cube(3), 0.25, {face: (float(face[0] == "+"), 1.0) for face in FACES}),
    "polygon": (L_SHAPE, 0.25, {"-x": (0.0, 2.0), "+x": (3.0, 1.0), "-y": (0.0, 3.0), "+y": (2.0, 1.0)}),
    "union": (U_SHAPE, 0.25, {"-x": (0.0, 2.0), "+x": (3.0, 1.5), "-y": (0.0, 3.0), "+y": (2.0, 1.0)}),
    "hole": (HOLED, 0.25, {"-x": (0.0, 4.0), "+x": (4.0, 4.0), "-y": (0.0, 4.0), "+y": (4.0, 4.0)}),
    "thin wall": (THIN, 0.25, {"-x": (0.0, 4.0), "+x": (4.0, 4.0), "-y": (0.0, 4.0), "+y": (4.0, 4.0)}),
    "notch": (NOTCHED, 0.25, {"-x": (0.0, 4.0), "+x": (4.0, 3.0), "-y": (0.0, 4.0), "+y": (4.0, 3.0)}),
    "cylinder": (BAR, 0.25, {"-z": (0.0, np.pi), "+z": (3.0, np.pi)}),
}


def centres(body: Lattice, rows: np.ndarray) -> np.ndarray:
    """Middles of faces, (m, dim)."""
    return body.nodes[body.faces.nodes[rows]].mean(1)


@pytest.mark.parametrize("name", list(CASES))
def test_a_face_is_the_whole_outermost_side_and_no_other(name: str) -> None:
    made, spacing, faces = CASES[name]
    body = lattice(shape(**made), spacing)
    for face, (at, area) in faces.items():
        axis, rows = "xyz".index(face[1]), body.faces.named(face)
        np.testing.assert_allclose(centres(body, rows)[:, axis], at, atol=1e-12)
        assert (body.faces.axis[rows] == axis).all()
        assert body.faces.area[rows].sum() == pytest.approx(area, rel=0.06 if name == "cylinder" else 1e-12)


@pytest.mark.parametrize("made", [DISC, RING, SPHERE], ids=lambda made: made["type"])
def test_of_a_round_body_it_is_the_flat_of_cells_at_the_end(made: Data) -> None:
    """Not the stairs beside it, whose other cell faces look across other axes, nor the inside of a ring."""
    body = lattice(shape(**made), 0.1)
    dim = body.nodes.shape[1]
    for face in FACES[: 2 * dim]:
        axis, rows = "xyz".index(face[1]), body.faces.named(face)
        at = centres(body, rows)
        assert np.ptp(at[:, axis]) < 1e-12
        assert abs(at[0, axis]) == pytest.approx(np.abs(body.nodes[:, axis]).max())
        assert (body.faces.axis[rows] == axis).all()
        assert np.abs(np.delete(at, axis, 1)).max() < 0.5
    areas = [body.faces.area[body.faces.named(face)].sum() for face in FACES[: 2 * dim]]
    assert areas == pytest.approx([areas[0]] * 2 * dim)


@pytest.mark.parametrize("angle", [10.0, 30.0, 44.0, 60.0])
def test_of_a_turned_lattice_it_is_the_stairs_along_the_whole_side(angle: float) -> None:
    """Of every line of cells that ends at the side one cell face; none looks to another side."""
    body = lattice(shape(**box(4.0, 4.0)), 0.1, lattice_rotate=angle)
    away = np.radians(min(angle, 90.0 - angle))
    for face in FACES[:4]:
        axis, sign = "xyz".index(face[1]), 1.0 if face[0] == "+" else -1.0
        rows = body.faces.named(face)
        normal = sign * body.faces.sign[rows] * body.frame.axes[axis, body.faces.axis[rows]]
        np.testing.assert_allclose(normal, np.cos(away), atol=1e-12)
        at = centres(body, rows)
        assert np.ptp(at[:, axis]) < 0.1
        assert body.faces.area[rows].sum() == pytest.approx(4.0 * np.cos(away), rel=0.04)
        assert np.ptp(at[:, 1 - axis]) > 3.6


@pytest.mark.parametrize("name", list(CASES))
def test_a_turned_shape_takes_its_faces_with_it(name: str) -> None:
    made, spacing, _ = CASES[name]
    straight = lattice(shape(**made), spacing)
    dim = straight.nodes.shape[1]
    turned = lattice(shape(**made, rotate=25.0 if dim == 2 else ["z", 25.0]), spacing)
    for face in straight.faces.names:
        np.testing.assert_array_equal(straight.faces.named(face), turned.faces.named(face))


def test_a_map_takes_the_faces_with_it() -> None:
    straight = lattice(shape(**L_SHAPE), 0.25)
    bent = lattice(shape(**L_SHAPE), 0.25, map=lambda x: np.stack([x[:, 0] + 0.1 * x[:, 1] ** 2, x[:, 1]], 1))
    for face in FACES[:4]:
        np.testing.assert_array_equal(straight.faces.named(face), bent.faces.named(face))


@pytest.mark.parametrize("spacing", [0.25, (0.25, 0.5)], ids=str)
def test_jitter_and_cells_that_are_not_square_keep_the_faces(spacing: float | tuple[float, float]) -> None:
    straight, moved = (lattice(shape(**NOTCHED), spacing, jitter) for jitter in (0.0, 0.3))
    for face in FACES[:4]:
        np.testing.assert_array_equal(straight.faces.named(face), moved.faces.named(face))
        assert straight.faces.area[straight.faces.named(face)].sum() == pytest.approx(3.0 if face[0] == "+" else 4.0)


def test_the_sides_of_a_crack_are_no_face() -> None:
    body = lattice(shape(**cube(2)), 0.125, cracks=(((0.0, 0.5), (0.5, 0.5)),))
    assert (centres(body, body.faces.named("+y"))[:, 1] == 1.0).all()
    assert (centres(body, body.faces.named("-y"))[:, 1] == 0.0).all()


def test_a_turned_lattice_may_be_without_some_faces() -> None:
    """At 45 degrees every cell face looks as much to x as to y: those there are are named."""
    assert lattice(shape(**cube(2)), 0.1, lattice_rotate=45.0).faces.names == ["-x", "+x"]
