"""Fitted bodies: cells, patches and corners are those of the shape, or the body is refused with the place."""

import re
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests.geometry.fitted_quality import (
    BODIES,
    SQUARE,
    Case,
    L,
    area_vectors,
    bracket_case,
    flux,
    local_lengths,
    offsets,
    patch_areas,
    polygon,
    volumes,
)  # fmt: skip
from tests.scenes import box, shape
from wsph.geometry.fitted.fit import fit
from wsph.geometry.lattice import lattice
from wsph.geometry.meshes.mesh import Mesh

STRAIGHT = ("box at 30", "box at 45", "triangle of 60", "wedge of 30", "L at 20", "hexagon", "star of 10")
SHARP = ("star of 10", "cylinder, turned", "plate with boss", "bracket")


@pytest.fixture(scope="module")
def bodies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Case]:
    return BODIES | {"bracket": bracket_case(tmp_path_factory.mktemp("part"))}


@cache
def fitted(name: str, path: Path | None = None) -> Mesh:
    case = BODIES[name] if path is None else bracket_case(path)
    return fit(shape(**case.shape), case.spacing)


@pytest.fixture(params=[*BODIES, "bracket"])
def body(request: pytest.FixtureRequest, bodies: dict[str, Case]) -> tuple[str, Case, Mesh]:
    name = request.param
    case = bodies[name]
    return name, case, fitted(name, None if name in BODIES else Path(case.shape["file"]).parent)


class TestEveryBody:
    def test_cells_have_volume_and_a_length_that_bounds_no_step_too_far(self, body: tuple[str, Case, Mesh]) -> None:
        name, case, mesh = body
        assert volumes(mesh).min() > 0.0
        assert local_lengths(mesh).min() > (0.5 if name in SHARP else 0.55) * case.spacing

    def test_patches_and_volume_are_those_of_the_shape(self, body: tuple[str, Case, Mesh]) -> None:
        name, case, mesh = body
        # Flat sides on straight edges are exact; on round ones chords are short by (h/r)^2/24 and a few times that.
        within = 1e-12 if name in STRAIGHT else 1e-2
        assert patch_areas(mesh) == pytest.approx(case.areas, rel=within)
        assert volumes(mesh).sum() == pytest.approx(case.volume, rel=1.6 * within)

    def test_the_sides_are_closed_and_hold_the_cells(self, body: tuple[str, Case, Mesh]) -> None:
        _, _, mesh = body
        vectors = area_vectors(mesh)
        assert np.abs(vectors.sum(0)).max() < 1e-13 * np.linalg.norm(vectors, axis=1).sum()
        assert flux(mesh) == pytest.approx(volumes(mesh).sum(), rel=1e-12)

    def test_sides_are_the_faces_of_one_cell_alone(self, body: tuple[str, Case, Mesh]) -> None:
        _, _, mesh = body
        cells, corner = mesh.blocks[0], offsets(mesh.nodes.shape[1])
        faces = np.concatenate(
            [np.sort(cells[:, corner[:, k] == end], axis=1) for k, end in product(range(corner.shape[1]), (0, 1))]
        )
        found, count = np.unique(faces, axis=0, return_counts=True)
        assert count.max() == 2
        sides = np.sort(mesh.sides, axis=1)
        assert np.array_equal(found[count == 1], sides[np.lexsort(sides.T[::-1])])
        assert all(np.isin(side, cells[cell]).all() for side, cell in zip(mesh.sides, mesh.side_cell, strict=True))

    def test_nodes_of_a_patch_lie_on_it(self, body: tuple[str, Case, Mesh]) -> None:
        name, case, mesh = body
        for patch in shape(**case.shape).patches():
            if patch.name not in mesh.patches:
                assert patch.name == "boss/from"
                continue
            on = np.unique(mesh.sides[mesh.side_patch == mesh.patches.index(patch.name)])
            # On an edge between triangles the nearest of two is asked, either may be it.
            within = 1e-6 if name == "bracket" else 1e-12
            assert np.abs(patch.surface.height(mesh.nodes[on])[0]).max() < within


@pytest.mark.parametrize("name", STRAIGHT)
def test_corners_of_polygons_are_nodes(name: str) -> None:
    for point in BODIES[name].shape["points"]:
        assert np.linalg.norm(fitted(name).nodes - point, axis=1).min() < 1e-12


def test_a_box_is_its_lattice() -> None:
    data = shape(**box(1.0, 0.5, 0.75), rotate=[[1, 2, 2], 30.0])
    mesh, known = fit(data, 0.125), lattice(data, 0.125)
    assert np.abs(mesh.nodes - known.nodes).max() < 1e-15
    assert np.array_equal(mesh.blocks[0], known.corners)


def test_planes_off_the_grid_get_a_layer() -> None:
    """A spacing that divides no edge: one plane of each pair is on the grid, the other is met by a layer."""
    mesh = fit(shape(**box(1.03, 0.98)), 0.1)
    assert volumes(mesh).sum() == pytest.approx(1.03 * 0.98, rel=1e-12)
    assert local_lengths(mesh).min() > 0.07


@pytest.mark.parametrize("turned", [0.0, 10.0])
def test_sides_in_one_line_meet_where_they_do(turned: float) -> None:
    points = ((0.0, 0.0), (0.43, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    mesh = fit(shape(**polygon(*points, turned=turned)), 0.1)
    assert patch_areas(mesh)["side-1"] == pytest.approx(0.43, rel=1e-12)
    assert local_lengths(mesh).min() > 0.05


def test_a_turned_shape_has_the_cells_turned() -> None:
    case = BODIES["hole in plate"]
    turned = shape(**case.shape, rotate=30.0)
    mesh, upright = fit(turned, case.spacing), fitted("hole in plate")
    back = turned.middle + (mesh.nodes - turned.middle) @ turned.axes
    assert np.abs(back - upright.nodes).max() < 1e-14


@pytest.mark.parametrize("name", ["ring", "L at 20", "cylinder", "spherical hole"])
def test_a_shifted_shape_has_the_cells_shifted(name: str) -> None:
    case = BODIES[name]
    data = shape(**case.shape)
    by = np.array([3.0, -2.0, 5.0])[: data.dim] * case.spacing

    def moved(value: object, key: str = "") -> object:
        if key in {"center", "from", "to", "min", "max", "points"}:
            return (np.array(value) + by).tolist()
        if isinstance(value, dict):
            return {k: moved(v, k) for k, v in value.items()}
        return [moved(v) for v in value] if isinstance(value, list) else value

    there = fit(shape(**moved(case.shape)), case.spacing)
    assert np.array_equal(there.blocks[0], fitted(name).blocks[0])
    # Descent makes roundings grow until it ends.
    assert np.abs(there.nodes - by - fitted(name).nodes).max() < 1e-4 * case.spacing


def test_permuted_axes_permute_the_cells() -> None:
    """A bar along z and one along x: the nodes, each the other's with its coordinates turned round, are the same ones."""
    bar = fitted("cylinder")
    other = fit(shape(**{"type": "cylinder", "from": [0.0] * 3, "to": [2.0, 0.0, 0.0], "radius": 0.5}), 0.1)
    there, here = (x[np.lexsort(np.round(x, 4).T)] for x in (np.roll(other.nodes, -1, axis=1), bar.nodes))
    assert np.abs(there - here).max() < 1e-5


def test_the_seed_alone_chooses() -> None:
    case = BODIES["star of 10"]
    again = fit(shape(**case.shape), case.spacing)
    assert np.array_equal(again.nodes, fitted("star of 10").nodes)


class TestRefused:
    @pytest.mark.parametrize(
        ("data", "spacing", "message"),
        [
            ({"type": "ring", "center": [0.0, 0.0], "inner": 0.75, "outer": 1.0}, 0.1,
             r"the wall at \[.*\] m, between (outer and inner|inner and outer), is 0.25 m thick, 2.5 spacings, and a fitted surface needs 4: a spacing of 0.0562 m does for all walls"),
            ({"type": "difference", "shapes": [box(1.0, 1.0), {"type": "disc", "name": "hole", "center": [0.45, 0.5], "radius": 0.2}]}, 0.1,
             r"the wall at \[0.12\d*, 0.5\d*\] m, between hole and box-1/-x, is 0.25\d* m thick, 2.5 spacings, and a fitted surface needs 3"),
            ({"type": "union", "shapes": [box(2.0, 2.0, 0.5), {"type": "difference", "shapes": [
                {"type": "cylinder", "from": [1.0, 1.0, 0.2], "to": [1.0, 1.0, 1.2], "radius": 0.8},
                {"type": "cylinder", "from": [1.0, 1.0, 0.1], "to": [1.0, 1.0, 1.4], "radius": 0.55}]}]}, 0.1,
             r"the wall at \[.*\] m, between difference-1/cylinder-. and difference-1/cylinder-., is 0.25 m thick, 2.5 spacings"),
            (polygon((0, 0), (1, 0), (1, 0.97), (0.97, 1), (0, 1), turned=10.0), 0.1, "side-3"),
            (polygon(*SQUARE), 0.6, "leaves no cells|spacings"),
            (box(1.0), 0.1, "a fitted surface needs 2 or 3 dimensions and one spacing, not 1"),
            (box(1.0, 1.0), (0.1, 0.2), "a fitted surface needs 2 or 3 dimensions and one spacing"),
        ],
        ids=["wall", "wall beside a hole", "wall of a tube", "chamfer", "coarse", "1D", "two spacings"],
    )  # fmt: skip
    def test_with_the_place_and_the_reason(self, data: dict, spacing: float, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            fit(shape(**data), spacing)

    @pytest.mark.parametrize(
        ("data", "spacing"),
        [
            ({"type": "ring", "center": [0.0, 0.0], "inner": 0.75, "outer": 1.0}, 0.1),
            ({"type": "difference", "shapes": [box(1.0, 1.0), {"type": "disc", "center": [0.45, 0.5], "radius": 0.2}]}, 0.1),
            ({"type": "difference", "shapes": [box(1.0, 1.0), {"type": "disc", "center": [0.3, 0.5], "radius": 0.2},
                                               {"type": "disc", "center": [0.71, 0.5], "radius": 0.11}]}, 0.1),
            ({"type": "stl", "file": "examples/bracket.stl", "scale": "1 mm"}, 3e-3),
        ],
        ids=["ring", "hole", "two holes", "bracket"],
    )  # fmt: skip
    def test_a_wall_with_a_spacing_that_does_for_all_walls(self, data: dict, spacing: float) -> None:
        with pytest.raises(ValueError, match="does for all") as error:
            fit(shape(**data), spacing)
        (offered,) = re.findall(r"a spacing of (\S+) m does for all walls", str(error.value))
        assert fit(shape(**data), float(offered)).nodes.size

    def test_with_the_place_after_the_rotation(self) -> None:
        hole = {"type": "disc", "name": "hole", "center": [0.45, 0.5], "radius": 0.2}
        with pytest.raises(ValueError, match=r"the wall at \[0.5\d*, 0.87\d*\] m, between hole and box-1/-x"):
            fit(shape(type="difference", shapes=[box(1.0, 1.0), hole], rotate=-90.0), 0.1)

    def test_not_where_the_grid_meets_both_sides_of_a_wall(self) -> None:
        """A plate of two rows of cells with a hole through it."""
        hole = {"type": "cylinder", "name": "hole", "from": [0.5, 0.5, -1.0], "to": [0.5, 0.5, 1.0], "radius": 0.2}
        mesh = fit(shape(type="difference", shapes=[box(1.0, 1.0, 0.1), hole]), 0.05)
        assert patch_areas(mesh)["hole"] == pytest.approx(0.04 * np.pi, rel=1e-2)

    def test_an_l_of_any_turn_is_not(self) -> None:
        for turned in (5.0, 33.0, 45.0, 71.0):
            assert volumes(fit(shape(**polygon(*L, turned=turned)), 1 / 16)).sum() == pytest.approx(0.75, rel=1e-12)


class TestShortSides:
    @pytest.mark.parametrize(("count", "spacing"), [(16, 0.1), (40, 0.1), (300, 0.15)])
    def test_of_a_polygon_along_a_circle_are_one_surface(self, count: int, spacing: float) -> None:
        angle = np.arange(count) * 2.0 * np.pi / count + 0.1
        mesh = fit(shape(**polygon(*zip(np.cos(angle), np.sin(angle), strict=True))), spacing)
        # Chords over several sides lie inside of them.
        exact = 0.5 * count * np.sin(2.0 * np.pi / count)
        assert volumes(mesh).sum() == pytest.approx(exact, rel=1e-12 if count == 16 else 5e-3)
        assert local_lengths(mesh).min() > 0.6 * spacing
        assert set(mesh.patches) <= {f"side-{k}" for k in range(1, count + 1)}

    def test_leave_long_ones_beside_them_their_ends(self) -> None:
        """A plate with rounded corners of eight sides each: its straight sides are whole."""
        arc = 0.3 * np.stack([f(np.linspace(0.0, np.pi / 2.0, 9)) for f in (np.cos, np.sin)], 1)
        turns = [np.array([[c, -s], [s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        middles = [(1.7, 0.7), (0.3, 0.7), (0.3, 0.3), (1.7, 0.3)]
        points = np.concatenate([m + arc @ turn.T for m, turn in zip(middles, turns, strict=True)])
        mesh = fit(shape(**polygon(*points.tolist(), turned=17.0)), 0.06)
        areas = patch_areas(mesh)
        assert [areas[f"side-{k}"] for k in (9, 18, 27, 36)] == pytest.approx([1.4, 0.4, 1.4, 0.4], rel=1e-9)
