"""Bodies that no grid has cut stand layer by layer, and what processes have of them are parts of the whole, to the bit."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from tests.ranks.threads import together, unlocked
from tests.scenes import box, shape
from wsph.errors import WsphError
from wsph.geometry.fitted.fit import fit
from wsph.geometry.meshes.inspection import doubts
from wsph.geometry.meshes.layered import Layered, shared
from wsph.geometry.meshes.mesh import Mesh
from wsph.geometry.meshes.meshed import Meshed, meshed
from wsph.geometry.meshes.scattered import Scattered, scattered
from wsph.geometry.meshes.sides import outer_sides
from wsph.ranks.cuts import Reach
from wsph.ranks.mpi import Ranks
from wsph.ranks.slabs import TooFew
from wsph.validation import meshes

__all__ = ["unlocked"]
pytestmark = pytest.mark.usefixtures("unlocked")


def mesh_of(nodes: np.ndarray, *blocks: np.ndarray) -> Mesh:
    """A mesh whose nodes and cells are in no order, with a patch."""
    order, rng = np.random.default_rng(3).permutation(len(nodes)), np.random.default_rng(4)
    number = np.argsort(order)
    mixed = tuple(number[corners[rng.permutation(len(corners))]] for corners in blocks)
    sides, owner = outer_sides(nodes[order], mixed)
    patch = (nodes[order][sides].mean(1)[:, 0] > 30.0).astype(int)
    return Mesh(nodes[order], mixed, sides, owner, patch, ("near", "far"))


def plane(kind: str) -> Mesh:
    nodes, corners = meshes.moved_grid((30.0, 100.0), (30, 100), 0.2)
    left = nodes[corners].mean(1)[:, 0] < 11.0
    blocks = {
        "quads": (corners,),
        "triangles": (meshes.triangles(corners),),
        "mixed": (corners[left], meshes.triangles(corners[~left])),
    }
    return mesh_of(nodes, *blocks[kind])


def solid(kind: str) -> Mesh:
    nodes, corners = meshes.moved_grid((30.0, 12.0, 12.0), (30, 12, 12), 0.2)
    if kind == "hexahedra":
        return mesh_of(nodes, corners)
    cells = meshes.tetrahedra(corners)
    turned = np.linalg.det(nodes[cells[:, 1:]] - nodes[cells[:, :1]]) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return mesh_of(nodes, cells)


def pieces() -> Mesh:
    """Two bodies of one mesh, which are doubted."""
    nodes, corners = meshes.moved_grid((30.0, 100.0), (30, 100), 0.2)
    return mesh_of(
        np.concatenate([nodes, nodes + np.array([40.0, 0.0])]), np.concatenate([corners, corners + len(nodes)])
    )


def drilled() -> Meshed:
    """A plate of one grid but for a hole near one end, turned."""
    hole = {"type": "disc", "name": "hole", "center": [10.0, 15.0], "radius": 5.0}
    outline = shape(type="difference", shapes=[box(120.0, 30.0), hole], rotate=0.3)
    return meshed(fit(outline, 1.0), outline.axes)


def points() -> Scattered:
    rng = np.random.default_rng(5)
    nodes = rng.permutation(meshes.moved_grid((100.0, 30.0), (100, 30), 0.2)[0])
    return scattered(nodes, rng.uniform(0.5, 1.5, len(nodes)))


BODIES: dict[str, Callable[[], Layered]] = {
    "quads": lambda: meshed(plane("quads")),
    "triangles": lambda: meshed(plane("triangles")),
    "mixed": lambda: meshed(plane("mixed")),
    "hexahedra": lambda: meshed(solid("hexahedra")),
    "tetrahedra": lambda: meshed(solid("tetrahedra")),
    "pieces": lambda: meshed(pieces()),
    "drilled": drilled,
    "points": points,
}
whole_of = cache(lambda name: BODIES[name]())


def parts(name: str, size: int, reach: int, more: int = 0) -> list[Layered]:
    joined = name == "points"

    def made(domain: Ranks) -> Layered:
        found = shared(BODIES[name], domain, Reach(reach, joined), who="body", doubts=doubts)
        low, high = found.split.layers
        return found.wider((low - more, high + more))

    return together(size, made)


@pytest.mark.parametrize("name", BODIES)
def test_points_see_nodes_of_their_own_layer_and_of_the_next(name: str) -> None:
    body = whole_of(name)
    node, point = (np.repeat(np.arange(len(n)), n) for n in (body.layers.nodes, body.layers.points))
    assert len(node) == len(body.nodes)
    assert len(point) == len(body.cells)
    np.testing.assert_array_equal(body.node_layer, node)
    if name != "points":
        step = node[body.rows.indices] - np.repeat(point, np.diff(body.rows.offsets))
        assert set(np.unique(step)) == {0, 1}
        assert np.maximum.reduceat(step, body.rows.offsets[:-1]).mean() > 0.3  # they are not much thicker than that
        # So that the cells of a block that a process owns are a run of them.
        assert all((np.diff(points.min(1)) >= 0).all() for points in body.points_of_cells)


@pytest.mark.parametrize(("size", "reach", "more"), [(2, 1, 0), (3, 1, 2), (3, 6, 0)])
@pytest.mark.parametrize("name", BODIES)
def test_parts_are_parts_of_the_whole_to_the_bit(name: str, size: int, reach: int, more: int) -> None:
    whole, cells, faces = whole_of(name), 0, 0
    for part in parts(name, size, reach, more):
        nodes, points = part.split.nodes, part.split.points
        assert (nodes.whole, points.whole) == (len(whole.nodes), len(whole.cells))
        for of, share in (("nodes", nodes), ("node_volume", nodes), ("cells", points), ("cell_volume", points)):
            np.testing.assert_array_equal(getattr(part, of), getattr(whole, of)[share.window], err_msg=of)
        np.testing.assert_array_equal(part.places(2.0), whole.places(2.0)[nodes.window])
        for mine, theirs, share in zip(part.centred, whole.centred, (nodes, points), strict=True):
            np.testing.assert_array_equal(mine, theirs[share.window])
        assert (part.edges, part.mean_volume) == (whole.edges, whole.mean_volume)
        if not isinstance(part, Meshed) or not isinstance(whole, Meshed):
            continue
        assert list(doubts(part)) == list(doubts(whole))
        assert len(list(doubts(part))) == (name == "pieces")
        rows = whole.rows.between(points.window, nodes.first)
        for of in ("offsets", "indices", "slope"):
            np.testing.assert_array_equal(getattr(part.rows, of), getattr(rows, of), err_msg=of)
        assert (part.rows.indices >= 0).all()
        assert (part.rows.indices < nodes.held).all()
        # Of the faces it has those of all nodes that it owns.
        around = np.isin(whole.faces.nodes, np.arange(nodes.low, nodes.high)).any(1)
        there = (part.faces.nodes + nodes.first).tolist()
        assert all(face in there for face in whole.faces.nodes[around].tolist())
        assert part.faces.patches.keys() == whole.faces.patches.keys()
        for patch, rows_of in part.faces.patches.items():
            assert set(map(tuple, (part.faces.nodes[rows_of] + nodes.first).tolist())) <= set(
                map(tuple, whole.faces.nodes[whole.faces.patches[patch]].tolist())
            )
        faces += int(part.own_faces.sum())
        cells += sum(int(own.sum()) for own in part.own_cells)
        for block, own, seen in zip(part.blocks, part.own_cells, part.points_of_cells, strict=True):
            assert (block[own] >= 0).all()
            assert len(np.unique(seen[own])) >= own.sum() / 6
    if isinstance(whole, Meshed):
        assert cells == sum(map(len, whole.blocks))
        assert faces == len(whole.faces.cell)


def test_every_part_of_a_mixed_body_has_rows_of_its_grid() -> None:
    whole = whole_of("drilled")
    assert whole.boxes is not None
    share = whole.boxes.share(len(whole.cells))
    for part in parts("drilled", 3, 1):
        assert part.boxes is not None
        assert part.boxes.share(len(part.cells)) == share < 1.0
        assert len(part.boxes.corners) > 0
        steps = np.ptp(part.nodes[part.boxes.corners] @ part.axes, axis=1)
        assert steps == pytest.approx(1.0)
        others = part.boxes.others(len(part.cells))
        assert len(others) + len(part.boxes.corners) == len(part.cells)
    assert {len(each.boxes.others(len(each.cells))) == 0 for each in parts("drilled", 3, 1) if each.boxes} == {
        True,
        False,
    }


def test_errors_of_the_first_process_and_too_few_particles_are_those_of_all() -> None:
    def failing() -> Layered:
        raise WsphError("no such file")

    def made(make: Callable[[], Layered]) -> Callable[[Ranks], str]:
        def caught(domain: Ranks) -> str:
            with pytest.raises(WsphError) as found:
                shared(make, domain, Reach(1, joined=False), who="body 'b'", doubts=doubts)
            return f"{type(found.value).__name__}: {found.value}"

        return caught

    assert together(2, made(failing)) == ["WsphError: no such file"] * 2
    small = meshed(mesh_of(*meshes.moved_grid((9.0, 5.0), (9, 5), 0.2)))
    found = together(2, made(lambda: small))
    assert (
        found
        == [f"{TooFew.__name__}: body 'b': 60 particles in blocks of 1024 are too few for 2 processes: start fewer"] * 2
    )
