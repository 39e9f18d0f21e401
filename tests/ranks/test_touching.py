"""What bodies touch by, and how far points see, processes find by their parts as one process finds it, to the bit."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from tests.ranks import test_layers, test_parts
from tests.ranks.threads import together, unlocked
from tests.scenes import box, shape
from wsph.contact.overlap import bounds_of, first_inside, overlapping, solid_of
from wsph.contact.surfaces.meshing.embedding import embedding
from wsph.contact.surfaces.meshing.mesh import surface_mesh
from wsph.contact.surfaces.meshing.own import OwnCells
from wsph.contact.surfaces.meshing.shell import shell_of
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, lattice, slab_of
from wsph.geometry.meshes.inspection import doubts
from wsph.geometry.meshes.layered import shared
from wsph.geometry.shapes.combined import Shape
from wsph.parts.phase_field.sight import sight_of
from wsph.ranks.cuts import Reach
from wsph.ranks.mpi import Ranks

__all__ = ["unlocked"]
pytestmark = pytest.mark.usefixtures("unlocked")

BALL = {"type": "sphere", "center": [8.0] * 3, "radius": 8.0}
SOLID = {"solid": (shape(**box(20.0, 12.0, 12.0)), {"jitter": 0.1}), "ball": (shape(**BALL), {})}
LATTICES: dict[str, tuple[Shape, dict[str, Any]]] = test_parts.BODIES | SOLID


@cache
def whole_of(name: str) -> Geometry:
    if name in LATTICES:
        outline, keys = LATTICES[name]
        return lattice(outline, 1.0, seed=3, **keys)
    return test_layers.whole_of(name)


def part_of(name: str, domain: Ranks, reach: int = 1) -> Geometry:
    if name not in LATTICES:
        return shared(test_layers.BODIES[name], domain, Reach(reach, name == "points"), who="body", doubts=doubts)
    outline, keys = LATTICES[name]
    given = {"lattice_rotate": 0.0, "cracks": (), "split": True, "map": None, **keys}
    return slab_of(outline, 1.0, given.pop("jitter", 0.0), 3, domain, Reach(reach, reach > 1), who="body", **given)


def next_to(cells: int, rng: np.random.Generator) -> np.ndarray:
    """Pairs of cells of which one comes after the other, a tenth of all, (k, 2)."""
    first = np.flatnonzero(rng.random(cells - 1) < 0.1)
    return np.stack([first, first + 1], 1)


def surface(geometry: Geometry, live: np.ndarray, parted: np.ndarray) -> dict[str, np.ndarray]:
    """All that a surface is, of the cells that are alive and the pairs that have parted, and how it hangs on nodes and, of a
    lattice, on cells."""
    own, deep = OwnCells.of(geometry), isinstance(geometry, Lattice)
    shell = shell_of(geometry, own, live[own.numbers], parted, deep=deep)
    mesh = surface_mesh(shell, deep=deep)
    found = {**vars(mesh.boundary), **{name: getattr(mesh, name) for name in ("X", "moved", "faces", "side", "N", "A")}}
    for at_nodes in (True, False)[: 1 + deep]:
        B = embedding(shell, mesh, at_nodes=at_nodes).B
        found |= {f"{key}, {at_nodes}": each for key, each in vars(B).items()}
    return found


@pytest.mark.parametrize(
    ("name", "broken"),
    [*((name, False) for name in ("cracked and jittered", "turned", "mapped", "ball")),
     *((name, True) for name in ("plain", "not parted", "solid", "mixed", "triangles", "drilled"))],
)  # fmt: skip
def test_a_surface_is_that_of_the_whole(name: str, broken: bool) -> None:
    """Also of one of which cells have died, and others parted, along all of it."""
    whole = whole_of(name)
    cells = sum(map(len, whole.blocks))
    rng = np.random.default_rng(7)
    live = np.ones(cells, bool) if not broken else rng.random(cells) > 0.1
    parted = np.zeros((0, 2), int) if not broken else next_to(cells, rng)
    one = surface(whole, live, parted)
    for found in together(3, lambda domain: surface(part_of(name, domain), live, parted)):
        for key, each in one.items():
            np.testing.assert_array_equal(found[key], each, err_msg=key)


@pytest.mark.parametrize("name", ["mapped", "cracked and jittered", "solid", "mixed", "drilled", "pieces"])
def test_what_points_see_is_that_of_the_whole(name: str) -> None:
    one = sight_of(whole_of(name))
    assert np.ptp(one.laplacian) > 0.0

    def seen(domain: Ranks) -> tuple[slice, np.ndarray, float]:
        part = part_of(name, domain)
        found = sight_of(part)
        return part.split.points.window, found.laplacian, found.skew

    for window, laplacian, skew in together(3, seen):
        np.testing.assert_array_equal(laplacian, one.laplacian[window])
        assert skew == one.skew


def moved(places: np.ndarray) -> np.ndarray:
    """A motion that turns and bends a body somewhat."""
    return places + 0.02 * places[:, ::-1] + 0.3 * np.sin(0.2 * places)


def looked(body: Geometry, other: Geometry, at_nodes: bool) -> list[object]:
    """What is found of a body and another one, at the start and when they have moved."""
    one, two = (solid_of(each, at_nodes=at_nodes) for each in (body, other))
    found: list[object] = [overlapping(one, two), overlapping(two, one, 2.5)]
    for a, b in ((one, two), (two, one)):
        there, places = moved(b.places), moved(a.places) + 0.4
        ends = bounds_of(there, b.share, b.domain)
        inside = b.inside(np.random.default_rng(2).uniform(*ends, (400, len(ends[0]))), there, 0.2)
        met = first_inside(places, a.share, a.domain, b, there, 1.0)
        found += [*ends, inside, met and (met.number, *met.place)]
    return found


@pytest.mark.parametrize(
    ("name", "at_nodes"),
    [("plain", True), ("plain", False), ("jittered", True), ("cracked", False), ("turned", True), ("mapped", True),
     ("solid", False), ("mixed", True), ("points", False)],
)  # fmt: skip
def test_what_lies_in_another_body_is_found_as_by_one_process(name: str, at_nodes: bool) -> None:
    """Of a body beside whose end another one begins inside of it."""
    whole = whole_of(name)
    dim = whole.nodes.shape[1]
    low, high = whole.nodes.min(0), whole.nodes.max(0)
    far = {"min": (low + 0.6 * (high - low)).tolist(), "max": (high + 0.3 * (high - low) + 0.1).tolist()}
    outline = Placed(far, dim)
    one = looked(whole, outline.whole(), at_nodes)
    assert one[0] is not None
    assert np.any(one[4]) or np.any(one[8])
    for found in together(3, lambda domain: looked(part_of(name, domain, 8), outline.part(domain), at_nodes)):
        for mine, theirs in zip(found, one, strict=True):
            np.testing.assert_array_equal(mine, theirs)


class Placed:
    """A box of cells that are as fine as makes it some thousand."""

    def __init__(self, ends: dict[str, list[float]], dim: int):
        self._shape = shape(type="box", **ends)
        size = np.subtract(ends["max"], ends["min"])
        self._spacing = tuple((size / np.rint(size / (np.prod(size) / 6000.0) ** (1.0 / dim))).tolist())

    def whole(self) -> Geometry:
        return lattice(self._shape, self._spacing)

    def part(self, domain: Ranks) -> Geometry:
        given: dict[str, Any] = {"lattice_rotate": 0.0, "cracks": (), "split": True, "map": None}
        return slab_of(self._shape, self._spacing, 0.0, 0, domain, Reach(8, joined=True), who="body", **given)
