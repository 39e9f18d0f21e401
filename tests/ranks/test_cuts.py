"""Bodies are cut by what processes have to do: as evenly as blocks of particles and layers allow, of whatever shape."""

from collections.abc import Callable
from functools import cache, partial
from itertools import combinations, pairwise

import numpy as np
import pytest

from tests.ranks.shared_cases import CRACKS, HOLE, MISES, PERZYNA, UPDATED, scene, two_sets
from tests.ranks.threads import together, unlocked
from tests.scenes import box, shape
from wsph.backend.reduce import BLOCK
from wsph.geometry.cells import LISTED, listed_weight
from wsph.geometry.fitted.fit import fit
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import lattice
from wsph.geometry.meshes.layered import Layered
from wsph.geometry.meshes.mesh import Mesh
from wsph.geometry.meshes.meshed import meshed
from wsph.geometry.meshes.scattered import Scattered, crowd, scattered
from wsph.geometry.meshes.sides import outer_sides
from wsph.ranks.cuts import Counts, Places, Reach
from wsph.ranks.slabs import TooFew, slabs, work_of
from wsph.scene.geometries import geometry_of
from wsph.simulation.compose import compose
from wsph.simulation.composing.parts import slabs_of
from wsph.simulation.composing.setting import bare_bodies, materials_of, method_of
from wsph.validation import meshes

__all__ = ["unlocked"]
pytestmark = pytest.mark.usefixtures("unlocked")


def drawn(seed: int) -> tuple[Counts, np.ndarray]:
    """A body of some blocks whose layers differ, and what three processes have beside it."""
    rng = np.random.default_rng(seed)
    nodes = rng.integers(1, 900, 26)
    points = rng.integers(1, 900, 25)
    return Counts(nodes, points, points * rng.uniform(1.0, 9.0, 25)), rng.uniform(0.0, 9e3, 3) * (seed % 2)


@pytest.mark.parametrize(
    "reach",
    [Reach(1, joined=False), Reach(3, joined=True), Reach(1, joined=True, stressed=2), Reach(1, joined=True, seen=1)],
)
@pytest.mark.parametrize("seed", range(6))
def test_no_cuts_leave_the_largest_share_of_the_work_smaller(seed: int, reach: Reach) -> None:
    body, loads = drawn(seed)
    places = Places.of(body, reach)
    size, worst = len(loads), len(places.nodes) - 1
    every = [
        max(load + places.closed[b] - places.opened[a] for load, (a, b) in zip(loads, pairwise(cut), strict=True))
        for inner in combinations(range(1, worst), size - 1)
        if (np.diff(places.points[list(cut := (0, *inner, worst))]) > 0).all()
    ]
    found = slabs(body, size, reach, who="body", loads=loads)
    assert max(load + each.work for load, each in zip(loads, found, strict=True)) == pytest.approx(min(every))
    for share in ("nodes", "cells"):
        ranges = [(getattr(each, share).low, getattr(each, share).high) for each in found]
        assert all(low < high for low, high in ranges)
        assert [high for _, high in ranges[:-1]] == [low for low, _ in ranges[1:]]
        at_blocks = share == "nodes" or reach.joined
        assert not at_blocks or all(low % BLOCK == 0 for low, _ in ranges)


def test_what_is_left_to_choose_is_shared_out() -> None:
    body = Counts(np.full(102, 1000), np.full(101, 900), np.full(101, 1.0))
    work = [each.work for each in slabs(body, 4, Reach(1, joined=False), who="body")]
    assert max(work) == np.ceil(np.mean(work))
    assert min(work) >= max(work) - 1.0


def solid() -> Layered:
    """Tetrahedra, small ones at one end, in a bar."""
    nodes, corners = meshes.moved_grid((72.0, 14.0, 14.0), (72, 14, 14), 0.0)
    nodes[:, 0] *= 1.5 - 0.5 * nodes[:, 0] / 72.0
    cells = meshes.tetrahedra(corners)
    turned = np.linalg.det(nodes[cells[:, 1:]] - nodes[cells[:, :1]]) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    sides, owner = outer_sides(nodes, (cells,))
    return meshed(Mesh(nodes, (cells,), sides, owner, np.zeros(len(sides), int), ("all",)))


def crowded() -> Layered:
    """Points, of which there are twice as many at one end."""
    nodes = meshes.moved_grid((600.0, 80.0), (600, 80), 0.2)[0]
    nodes[:, 0] *= 1.5 - 0.5 * nodes[:, 0] / 600.0
    return scattered(nodes, np.ones(len(nodes)))


def of_shape(**table: object) -> Layered:
    outline = shape(**table)
    return meshed(fit(outline, 1.0), outline.axes, listed=WEIGHT)


WEIGHT = LISTED["total"][0]
HOLES = [{"type": "disc", "name": f"h{k}", "center": [25.0 + 50.0 * k, 40.0], "radius": 20.0} for k in range(4)]
STEP = [box(80.0, 24.0, 24.0), {"type": "box", "min": [80.0, 8.0, 8.0], "max": [200.0, 16.0, 16.0]}]
BODIES: dict[str, tuple[Callable[[], Geometry], Reach, float]] = {
    "disc": (lambda: of_shape(type="disc", center=[0.0, 0.0], radius=140.0), Reach(1, joined=False), 0.05),
    "drilled": (
        lambda: of_shape(type="difference", shapes=[box(600.0, 80.0), *HOLES]),
        Reach(1, joined=False),
        0.05,
    ),
    "tetrahedra": (solid, Reach(1, joined=False), 0.1),
    "points": (crowded, Reach(6, joined=True), 0.06),
    "stepped": (lambda: lattice(shape(type="union", shapes=STEP), 1.0), Reach(1, joined=False), 0.05),
    "box": (lambda: lattice(shape(**box(60.0, 20.0, 20.0)), 1.0), Reach(5, joined=True), 0.06),
}
"""Bodies, what their processes need around what they own, and by how much of the mean the largest share is to be more."""

whole_of = cache(lambda name: BODIES[name][0]())


def counted(body: Geometry, layers: tuple[int, int], listed: float = WEIGHT) -> float:
    """The pairs that rows in some layers, from one up to another, visit, one by one, of lists so many for one; in rows of a
    grid places of nodes."""
    rows, boxes, node = body.rows, body.boxes, body.node_layer
    first = node[rows.indices[rows.offsets[:-1]]]
    here, of = (first >= layers[0]) & (first < layers[1]), (node >= layers[0]) & (node <= layers[1])
    if isinstance(body, Scattered):
        return float(crowd(body.nodes, 2.6 * body.spacing)[here].sum())
    many = 2.0 * np.diff(rows.offsets)
    if boxes is None:
        return float(many[here].sum())
    others = np.isin(np.arange(len(many)), boxes.others(len(many)))
    seen = of if boxes.nodes is None else of[boxes.nodes]
    return float(listed * many[here & others].sum() + boxes.corners.shape[1] * ((here & ~others).sum() + seen.sum()))


def uneven(work: list[float]) -> float:
    return max(work) / float(np.mean(work)) - 1.0


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("name", BODIES)
def test_every_share_of_a_body_has_as_much_to_do(name: str, size: int) -> None:
    body, (_, reach, most) = whole_of(name), BODIES[name]
    found = slabs(body.counts, size, reach, who="body")
    work = [counted(body, each.layers) for each in found]
    assert work == pytest.approx([each.work for each in found], rel=0.04)  # but for half a layer of nodes at its ends
    assert uneven(work) < most


def test_shares_of_as_many_particles_have_not() -> None:
    far = {"drilled": 0.25, "tetrahedra": 0.2, "points": 0.3, "box": 0.15}
    for name, least in far.items():
        places, worst = Places.of(whole_of(name).counts, BODIES[name][1]), 0.0
        for size in (2, 3, 4):
            cuts = np.rint(np.arange(size + 1) * places.nodes[-1] / size / BLOCK).astype(int)
            cuts[-1] = len(places.nodes) - 1
            worst = max(worst, uneven([places.closed[b] - places.opened[a] for a, b in pairwise(cuts.tolist())]))
        assert worst > least, name


def test_particles_are_crowded_as_they_see_each_other() -> None:
    places = crowded().nodes[::3]
    seen = crowd(places, 6.0)
    exact = np.array([(((places - place) ** 2).sum(1) < 36.0).sum() for place in places[::7]])
    assert seen[::7].mean() == pytest.approx(exact.mean(), rel=0.05)
    ends = [seen[::7][part].mean() / exact[part].mean() for part in (places[::7, 0] < 100.0, places[::7, 0] > 500.0)]
    assert ends == pytest.approx([1.0, 1.0], rel=0.1)


def test_bodies_one_after_the_other_even_out_what_blocks_leave() -> None:
    body, loads = Counts(np.full(31, 100), np.full(30, 100), np.full(30, 100.0)), np.zeros(2)
    for _ in range(4):
        found = slabs(body, 2, Reach(1, joined=False), who="body", loads=loads)
        loads = loads + work_of(found)
    assert loads[0] == loads[1]
    alone = work_of(slabs(body, 2, Reach(1, joined=False), who="body"))
    assert max(alone) > 1.2 * min(alone)


LAWS = {"elastic": "total", "neo-hookean": "total", "jaumann": "rate", "mises": "rate", "perzyna": "relaxing"}
OF_LAW = {"mises": MISES, "perzyna": PERZYNA}


@pytest.mark.parametrize("law", LAWS)
def test_pairs_of_lists_count_by_the_law_and_the_precision(law: str) -> None:
    for k, precision in enumerate(("f64", "f32")):
        told = {"body": {"shape": HOLE["shape"]}, "run": {"precision": precision}}
        made = scene(**{"law": law, **OF_LAW.get(law, {}), **told})
        method = method_of(made)
        (body,) = (each.geometry for each in bare_bodies(made, materials_of(made), method))
        without = geometry_of(made, 0, method.formulation, 0.0).counts.visits
        many, boxes = np.diff(body.rows.offsets), body.boxes
        assert boxes is not None
        others = boxes.others(len(many))
        assert 0 < len(others) < len(many)
        weight = (body.counts.visits - without).sum() / (2.0 * many[others].sum())
        assert weight == pytest.approx(LISTED[LAWS[law]][k])


def test_pairs_of_lists_count_for_most_where_laws_have_least_to_do() -> None:
    weights = np.array([LISTED[each] for each in ("total", "rate", "relaxing")])
    assert (np.diff(weights, axis=0) < 0.0).all()
    assert (weights[:, 1] > weights[:, 0]).all()
    assert set(LISTED) == set(LAWS.values())


CASES = {
    "fitted": lambda: scene(body={"shape": HOLE["shape"]}, **MISES),
    "cracked": lambda: scene(body={"cracks": CRACKS}),
    "edges": lambda: scene(form="total-lagrangian"),
    "moving": lambda: scene(form=UPDATED, probes=[]),
    "several": lambda: scene(more=[(name, [0.0, y], [70.0, y + 50.0], {}) for name, y in (("c", 60.0), ("d", 120.0))]),
}


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("name", CASES)
def test_a_check_knows_the_cuts_of_a_run(name: str, size: int) -> None:
    made = CASES[name]()
    method = method_of(made)
    bare = partial(bare_bodies, made, materials_of(made), method)
    told = slabs_of(made, [each.geometry for each in bare()], method.formulation, size)
    for rank, bodies in enumerate(together(size, bare)):
        for each, expected in zip(bodies, told, strict=True):
            assert expected is not None
            split = each.geometry.split
            assert split.work == work_of([slab for slab, _ in expected])
            # Pairs of what it holds, all of which it works on.
            listed = listed_weight(each.material, "f64")
            held = counted(each.geometry, (-1, 10**9), listed) if name != "moving" else split.work[rank]
            assert held == pytest.approx(split.work[rank], rel=0.06)
            slab, wide = expected[rank]
            assert (split.layers, split.around) == (slab.layers, wide.layers)
            shares, own = (split.nodes, split.points), (slab.nodes, slab.cells)
            assert [(s.low, s.high) for s in shares] == [(s.low, s.high) for s in own]


SETS = {
    "held": lambda: two_sets(),
    "moving": lambda: two_sets(moves=True, body={"jitter": 0.1, "cracks": CRACKS[:1]}),
    "solid": lambda: two_sets(3, moves=True, run={"support": 1.8}),
    "bar": lambda: two_sets(1),
}


@pytest.mark.parametrize("name", SETS)
def test_of_two_sets_a_process_holds_what_its_steps_read(name: str) -> None:
    made = SETS[name]().with_(probes=[])
    method, size = method_of(made), 3
    whole = compose(made).bodies[0].system
    (slabs,) = slabs_of(made, [whole.geometry], method.formulation, size)
    assert slabs is not None
    beyond: list[float] = []
    for (slab, _), shared in zip(slabs, together(size, partial(compose, made)), strict=True):
        split, expected = shared.bodies[0].system.geometry.split, whole.holding(slab)
        assert (split.nodes, split.points) == (expected.nodes, expected.cells)
        layer = whole.geometry.node_layer[[split.nodes.low, split.nodes.high - 1]]
        beyond += [layer[0] - split.layers[0], split.layers[1] - layer[1]]
    assert max(beyond) == {"held": 3, "moving": 4, "solid": 5, "bar": 2}[name]


def test_too_few_particles_are_refused_by_name() -> None:
    body = Counts(np.full(31, 50), np.full(30, 50), np.full(30, 100.0))
    with pytest.raises(TooFew, match="body 'b': 1550 particles in blocks of 1024 are too few for 3 processes"):
        slabs(body, 3, Reach(1, joined=False), who="body 'b'")
