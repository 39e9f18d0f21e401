"""What processes make of a body is what one process makes of it, to the bit: slabs of lattices, and sums over them."""

from typing import Any

import numpy as np
import pytest

from tests.ranks.threads import together, unlocked
from tests.scenes import box, shape
from wsph.backend.domain import WHOLE, Share, Split
from wsph.boundary.loads.rows import whole_area
from wsph.formulations.updated.sharing.anew import Anew
from wsph.formulations.updated.sharing.beyond import Beyond
from wsph.geometry.gradients import CELLS, nodal_gradients
from wsph.geometry.lattice import Lattice, lattice, slab_of
from wsph.geometry.shapes.combined import Shape
from wsph.ranks.blocks import Dots, own_sum
from wsph.ranks.cuts import Reach
from wsph.ranks.mpi import Ranks

__all__ = ["unlocked"]
pytestmark = pytest.mark.usefixtures("unlocked")

BOX = shape(**box(90.0, 40.0))
DISC = {"type": "disc", "center": [45.0, 20.0], "radius": 9.0}
PLATE = shape(type="difference", shapes=[box(90.0, 40.0), DISC])
CRACKS = (((20.0, 25.0), (70.0, 25.0)), ((60.0, 0.0), (60.0, 20.0)))

BODIES: dict[str, tuple[Shape, dict[str, Any]]] = {
    "plain": (PLATE, {}),
    "jittered": (PLATE, {"jitter": 0.2}),
    "cracked": (BOX, {"cracks": CRACKS}),
    "cracked and jittered": (BOX, {"cracks": CRACKS, "jitter": 0.1}),
    "not parted": (BOX, {"cracks": CRACKS, "split": False}),
    "turned": (PLATE, {"lattice_rotate": 0.3}),
    "mapped": (
        PLATE,
        {"map": lambda x: np.stack([x[:, 0] + 0.2 * np.sin(x[:, 1]), x[:, 1] * (1.0 + 0.002 * x[:, 0])], 1)},
    ),
}


def parts(size: int, outline: Shape, keys: dict[str, Any], reach: int) -> list[Lattice]:
    given = {"lattice_rotate": 0.0, "cracks": (), "split": True, "map": None, **keys}
    jitter = given.pop("jitter", 0.0)

    def made(domain: Ranks) -> Lattice:
        found = slab_of(outline, 1.0, jitter, 3, domain, Reach(reach, reach > 1), who="body", **given)
        _ = found.sides, found.mean_volume, found.middle  # which all ask for together
        return found

    return together(size, made)


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("name", BODIES)
def test_slabs_are_parts_of_the_lattice_to_the_bit(name: str, size: int) -> None:
    outline, keys = BODIES[name]
    whole = lattice(outline, 1.0, seed=3, **keys)
    for reach in (1, 8):
        for part in parts(size, outline, keys, reach):
            nodes, cells = part.split.nodes, part.split.points
            assert (nodes.whole, cells.whole) == (len(whole.nodes), len(whole.cells))
            for of in ("nodes", "node_volume", "index"):
                np.testing.assert_array_equal(getattr(part, of), getattr(whole, of)[nodes.window], err_msg=of)
            for of in ("cells", "cell_volume"):
                np.testing.assert_array_equal(getattr(part, of), getattr(whole, of)[cells.window], err_msg=of)
            np.testing.assert_array_equal(part.corners + nodes.first, whole.corners[cells.window])
            np.testing.assert_array_equal(part.centred[0], whole.centred[0][nodes.window])
            assert (part.edges, part.mean_volume) == (whole.edges, whole.mean_volume)
            assert part.irregular == whole.irregular
            mine = np.isin(whole.faces.cell, np.arange(cells.first, cells.first + cells.held))
            for of in ("share", "vector", "name", "outer", "last"):
                np.testing.assert_array_equal(getattr(part.sides, of), getattr(whole.sides, of)[mine], err_msg=of)
            np.testing.assert_array_equal(part.faces.nodes + nodes.first, whole.faces.nodes[mine])


@pytest.mark.parametrize("name", ["plain", "cracked and jittered"])
def test_a_part_with_more_around_it_says_which_of_it_is_right(name: str) -> None:
    outline, keys = BODIES[name]
    whole = lattice(outline, 1.0, seed=3, **keys)
    given = {"lattice_rotate": 0.0, "cracks": (), "split": True, "map": None, **keys}
    jitter = given.pop("jitter", 0.0)

    def made(domain: Ranks) -> tuple[Lattice, ...]:
        reaches = Reach(1, joined=True), Reach(1, joined=True, stressed=2, beyond=3)
        narrow, wide = (slab_of(outline, 1.0, jitter, 3, domain, each, who="body", **given) for each in reaches)
        low, high = wide.split.around
        return narrow, wide, wide.seeing((low - 2 * domain.rank, high + 1)), wide.wider((0, 2**31))

    for narrow, wide, more, every in together(2, made):
        assert narrow.split.around == narrow.split.layers
        low, high = wide.split.layers
        count = wide.layer_count
        assert wide.split.around == (max(low - 3, 0), min(high + 3, count))
        assert (more.split.layers, every.split.layers) == (wide.split.layers, (0, count))
        assert more.split.around[1] == min(wide.split.around[1] + 1, count)
        for part in (narrow, wide, more, every):
            split = part.split
            assert split.right is not None
            for share, right, layer in zip((split.nodes, split.points), split.right, layers_in(whole), strict=True):
                there = np.flatnonzero((layer >= split.layers[0]) & (layer < split.layers[1] + (share is split.nodes)))
                assert (share.first + right.start, share.first + right.stop) == (there[0], there[-1] + 1)
            for of in ("nodes", "node_volume", "index"):
                np.testing.assert_array_equal(getattr(part, of), getattr(whole, of)[split.nodes.window], err_msg=of)
            np.testing.assert_array_equal(part.cell_volume, whole.cell_volume[split.points.window])


def layers_in(body: Lattice) -> tuple[np.ndarray, np.ndarray]:
    return body.node_layer, body.point_layer


@pytest.mark.parametrize("size", [2, 3, 4])
def test_what_came_near_and_is_not_held_is_known(size: int) -> None:
    random = np.random.default_rng(size)
    layer = np.repeat(np.arange(40), 25)
    place = np.column_stack([layer + random.uniform(0.0, 1.0, 1000), random.uniform(0.0, 5.0, 1000)])
    place[layer > 25, 0] = 48.0 - place[layer > 25, 0]  # folded back: the last are beside those before the fold
    place[layer > 25, 1] += 5.0
    reach, ends = 1.5, np.linspace(0, 1000, size + 1).astype(int)
    apart = np.linalg.norm(place[:, None] - place[None], axis=2)

    def missing(rank: int, first: int, end: int) -> np.ndarray:
        own = np.arange(ends[rank], ends[rank + 1])
        seen = (apart[own] < reach).any(0)
        every = (apart[seen] < reach).any(0)
        return np.flatnonzero(every & ((np.arange(1000) < first) | (np.arange(1000) >= end)))

    def found(domain: Ranks) -> tuple[int, int] | None:
        low, high = int(ends[domain.rank]), int(ends[domain.rank + 1])
        held = max(low - 100, 0), min(high + 100, 1000)
        around = int(layer[held[0]]), int(layer[held[1] - 1]) + 1
        share = Share(1000, held[0], held[1] - held[0], low, high)
        rows = place[share.window]
        seeing = (apart[low:high, share.window] < reach).any(0)
        beyond = Beyond(
            "b", Split(domain, share, share, layers=around, around=around), share, layer[share.window], "cpu"
        )
        with pytest.raises(Anew) as caught:
            beyond.refuse(rows, seeing, reach)
        layers, lost = caught.value.by.layers, layer[missing(domain.rank, *held)]
        assert caught.value.body == "b"
        assert layers is not None
        assert layers[0] <= lost.min(initial=40)
        assert lost.max(initial=-1) < layers[1]
        assert len(lost) or layers == around
        share = Share(1000, 0, 1000, low, high)
        beyond = Beyond("b", Split(domain, share, share, layers=(0, 40), around=(0, 40)), share, layer, "cpu")
        beyond.refuse(place, (apart[low:high] < reach).any(0), reach)  # all of it is held: nothing is missing
        return layers

    assert len(together(size, found)) == size


def test_rows_are_passed_to_those_that_they_are_for() -> None:
    def passed(domain: Ranks) -> list[np.ndarray]:
        return domain.passed([np.full((k + domain.rank, 2), 10.0 * domain.rank + k) for k in range(domain.size)])

    for rank, found in enumerate(together(3, passed)):
        for other, rows in enumerate(found):
            np.testing.assert_array_equal(rows, np.full((rank + other, 2), 10.0 * other + rank))


CHOSEN = [np.array([3, 7, 1030, 2047, 2048]), np.array([0, 1, 1023]), np.array([0, 2047])]
IN_THREE = [Share(3000, 0, 3000, low, high) for low, high in ((0, 1024), (1024, 2048), (2048, 3000))]


def test_chosen_copies_are_what_their_owners_have_and_no_others() -> None:
    def changed(domain: Ranks) -> np.ndarray:
        halo, rows = domain.chosen_halo(IN_THREE[domain.rank]), np.full((3000, 2), float(domain.rank))
        halo.choose(np.arange(0))
        halo.fill(rows)
        assert (rows == domain.rank).all()
        others = CHOSEN[domain.rank][~IN_THREE[domain.rank].owns(CHOSEN[domain.rank])]
        halo.choose(others)
        halo.fill(rows)
        return rows[:, 1]

    owner = np.arange(3000) // 1024
    for rank, rows in enumerate(together(3, changed)):
        expected = np.full(3000, rank)
        expected[CHOSEN[rank]] = owner[CHOSEN[rank]]
        np.testing.assert_array_equal(rows, expected)


def test_a_crack_that_parts_no_cells_is_refused_by_all() -> None:
    with pytest.raises(ValueError, match="part no cells"):
        parts(2, BOX, {"cracks": (((200.0, 25.0), (210.0, 25.0)),), "split": False}, 1)


@pytest.mark.parametrize("name", ["turned", "jittered"])
def test_the_area_that_a_whole_force_is_shared_out_over_is_that_of_the_whole(name: str) -> None:
    outline, keys = BODIES[name]
    whole = lattice(outline, 1.0, seed=3, **keys)
    given = {"lattice_rotate": 0.0, "cracks": (), "split": True, "map": None, **keys}
    jitter = given.pop("jitter", 0.0)

    def area(domain: Ranks) -> float:
        part = slab_of(outline, 1.0, jitter, 3, domain, Reach(1, joined=False), who="body", **given)
        return whole_area(part, part.sides.named("+y"))

    assert together(3, area) == [whole_area(whole, whole.sides.named("+y"))] * 3


SHARES = [Share(5000, 0, 3000, 0, 2048), Share(5000, 1500, 3500, 2048, 5000)]
SPLIT = [Share(5000, 0, 3000, 0, 2500), Share(5000, 1500, 3500, 2500, 5000)]


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_scalar_products_over_shares_are_those_of_the_whole(kind: type) -> None:
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((4, 15000)).astype(kind), rng.standard_normal((3, 15000)).astype(kind)

    def numbers(share: Share, domain: Any) -> tuple[float, np.ndarray]:
        dots, window = Dots(share, domain, 3), slice(3 * share.first, 3 * (share.first + share.held))
        return dots.one(a[0, window], b[0, window]), dots.products(a[:, window], b[:, window])

    one, every = numbers(Share.all(5000), WHOLE)
    assert every == pytest.approx(a.astype(float) @ b.astype(float).T, rel=1e-9, abs=1e-9)
    for found in together(2, lambda domain: numbers(SHARES[domain.rank], domain)):
        assert found[0] == one
        np.testing.assert_array_equal(found[1], every)


def test_sums_of_blocks_that_processes_share_are_those_of_the_whole() -> None:
    values = np.random.default_rng(2).standard_normal(5000)
    whole = own_sum(values, Share.all(5000), WHOLE)
    found = together(2, lambda domain: own_sum(values[SPLIT[domain.rank].window], SPLIT[domain.rank], domain))
    assert found == [whole, whole]
    assert own_sum(values[:3000], Share.all(5000), WHOLE) == pytest.approx(values[:3000].sum())


def test_gradients_of_a_part_are_added_up_as_those_of_the_whole() -> None:
    made = lattice(shape(**box(400.0, 60.0)), 1.0, jitter=0.2)
    places, first, nodes = made.nodes, 3000, 50 * 61
    assert len(made.corners) > CELLS
    whole = nodal_gradients(places, made.corners)
    part = nodal_gradients(places[nodes:], made.corners[first:] - nodes, before=first)
    inside = part.start >= 2 * 61
    chosen = whole.start - nodes >= 2 * 61
    np.testing.assert_array_equal(part.start[inside] + nodes, whole.start[chosen])
    np.testing.assert_array_equal(part.slope[inside], whole.slope[chosen])
    np.testing.assert_array_equal(part.volume[2 * 61 :], whole.volume[nodes + 2 * 61 :])
