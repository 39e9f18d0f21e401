"""Patches of shapes: their names, heights, areas, and where they meet."""

import numpy as np
import pytest

from tests.geometry.fitted_quality import polygon
from tests.scenes import Data, box, shape
from wsph.geometry.connected import connected
from wsph.geometry.fitted.junctions import corners, junctions
from wsph.geometry.fitted.nearby import nearest_distance
from wsph.geometry.fitted.outline import outline
from wsph.geometry.fitted.planning import plan_layers

DISC = {"type": "disc", "center": [0.5, 0.5], "radius": 0.2}
BAR = {"type": "cylinder", "from": [0.5, 0.5, -1.0], "to": [0.5, 0.5, 2.0], "radius": 0.2}
BALL = {"type": "sphere", "center": [1.0, 1.0, 1.0], "radius": 0.3}
SHAPES = [
    box(1.0), box(1.0, 2.0), box(1.0, 2.0, 3.0), DISC, BALL, BAR, polygon((0, 0), (2, 0), (0, 1)),
    {"type": "ring", "center": [0.5, 0.5], "inner": 0.2, "outer": 0.4},
    {"type": "difference", "shapes": [{**box(1.0, 1.0, 1.0), "rotate": ["z", 30.0]}, BAR, BALL], "rotate": ["x", 20.0]},
]  # fmt: skip


def _names(**data: object) -> list[str]:
    return [patch.name for patch in shape(**data).patches()]


class TestNames:
    @pytest.mark.parametrize(
        ("data", "names"),
        [
            (box(1.0, 1.0), ["-x", "+x", "-y", "+y"]),
            ({**box(1.0, 1.0), "name": "plate"}, ["plate/-x", "plate/+x", "plate/-y", "plate/+y"]),
            (DISC, ["disc"]),
            ({**DISC, "name": "hole"}, ["hole"]),
            (BALL, ["sphere"]),
            (BAR, ["from", "to", "mantle"]),
            ({**BAR, "name": "bore"}, ["bore/from", "bore/to", "bore"]),
            ({"type": "ring", "center": [0.0, 0.0], "inner": 0.2, "outer": 0.4}, ["inner", "outer"]),
            (polygon((0, 0), (2, 0), (0, 1)), ["side-1", "side-2", "side-3"]),
        ],
        ids=lambda v: v["type"] if isinstance(v, dict) else "",
    )  # fmt: skip
    def test_of_a_shape(self, data: Data, names: list[str]) -> None:
        assert _names(**data) == names

    def test_of_shapes_in_shapes(self) -> None:
        cut = {"type": "union", "name": "slot", "shapes": [DISC, {**DISC, "name": "end"}]}
        names = _names(type="difference", shapes=[box(1.0, 1.0), DISC, {**DISC, "name": "hole"}, DISC, cut])
        assert names[4:] == ["disc-1", "hole", "disc-2", "slot/disc-1", "slot/end"]

    @pytest.mark.parametrize("name", ["", "a b", "/x", "-x"])
    def test_that_are_none_are_refused(self, name: str) -> None:
        with pytest.raises(ValueError, match="name"):
            shape(**DISC, name=name)


@pytest.mark.parametrize("data", SHAPES, ids=lambda data: data["type"])
class TestSurfaces:
    def test_heights_have_their_gradients(self, data: Data) -> None:
        made = shape(**data)
        points = made.middle + np.random.default_rng(1).uniform(-0.7, 0.7, (50, made.dim))
        step = 1e-6
        for patch in made.patches():
            height, gradient = patch.surface.height(points)
            for k in range(made.dim):
                ahead = patch.surface.height(points + step * np.eye(made.dim)[k])[0]
                back = patch.surface.height(points - step * np.eye(made.dim)[k])[0]
                assert (ahead - back) / (2 * step) == pytest.approx(gradient[:, k], abs=1e-8)
            assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0, abs=1e-12)
            nearest = patch.surface.nearest(points)
            assert np.abs(patch.surface.height(nearest)[0]).max() < 1e-14
            assert (np.linalg.norm(points - nearest, axis=1) >= np.abs(height) - 1e-14).all()

    def test_nearest_points_are_no_farther_than_samples(self, data: Data) -> None:
        made = shape(**data)
        points = made.middle + np.random.default_rng(2).uniform(-1.0, 1.0, (50, made.dim))
        for patch in made.patches():
            samples = patch.surface.samples(0.05)[0]
            apart = np.linalg.norm(points[:, None] - samples, axis=2).min(1)
            distance = np.linalg.norm(points - patch.surface.nearest(points), axis=1)
            assert (distance <= apart + 1e-12).all()
            assert (apart <= distance + 0.05).all()


class TestAreas:
    def test_of_whole_shapes_are_exact(self) -> None:
        for data, areas, volume in (
            (box(1.0, 2.0, 3.0), [6.0, 6.0, 3.0, 3.0, 2.0, 2.0], 6.0),
            (DISC, [0.4 * np.pi], 0.04 * np.pi),
            (BALL, [0.36 * np.pi], 0.036 * np.pi),
            (BAR, [0.04 * np.pi, 0.04 * np.pi, 1.2 * np.pi], 0.12 * np.pi),
        ):
            body = outline(shape(**data), 0.05)
            assert body.areas == pytest.approx(np.array(areas), rel=1e-12)
            assert body.volume == pytest.approx(volume, rel=2e-3)
            assert all(body.whole)

    def test_of_cut_shapes_are_what_is_left(self) -> None:
        body = outline(shape(type="difference", shapes=[box(1.0, 1.0, 1.0), BAR]), 0.05)
        area = dict(zip([patch.name for patch in body.patches], body.areas, strict=True))
        assert set(area) == {"cylinder-1", *(f"box-1/{s}{a}" for s in "-+" for a in "xyz")}
        assert area["cylinder-1"] == pytest.approx(0.4 * np.pi, rel=0.01)
        assert area["box-1/-z"] == pytest.approx(1.0 - 0.04 * np.pi, rel=0.01)
        assert body.volume == pytest.approx(1.0 - 0.04 * np.pi, rel=0.01)

    def test_of_sides_in_one_plane_are_counted_once(self) -> None:
        body = outline(shape(type="union", shapes=[box(2.0, 1.0), box((1.0, 3.0), 1.0)]), 0.1)
        area = dict(zip([patch.name for patch in body.patches], body.areas, strict=True))
        assert area == pytest.approx({"box-1/-x": 1, "box-1/-y": 2, "box-1/+y": 2, "box-2/+x": 1, "box-2/-y": 1, "box-2/+y": 1})  # fmt: skip

    def test_distances_are_those_to_what_is_left(self) -> None:
        """Under a boss the plate's top has no surface: what is below it is far from it."""
        boss = {"type": "cylinder", "from": [1.0, 1.0, 0.2], "to": [1.0, 1.0, 1.0], "radius": 0.4}
        body = outline(shape(type="union", shapes=[box(2.0, 2.0, 0.5), boss]), 0.1)
        top = [patch.name for patch in body.patches].index("box-1/+z")
        points = np.array([[1.0, 1.0, 0.45], [1.3, 1.0, 0.45], [1.6, 1.0, 0.45]])
        found = body.distance(top, points, 0.3)
        assert np.isinf(found[0])
        assert found[1:] == pytest.approx([np.hypot(0.1, 0.05), 0.05], abs=0.03)


@pytest.mark.parametrize(
    ("data", "names"),
    [
        (box(1.0), ()),
        (box(1.0, 0.5, 0.2), ()),
        (box(1.03, 1.0), ("+x",)),
        (DISC, ("disc",)),
        ({**BAR, "name": "bar"}, ("bar",)),
        (polygon((0, 0), (2, 0), (0, 1)), ("side-2",)),
        ({"type": "union", "shapes": [box(1.0, 1.0), box((0.5, 1.55), (0.2, 0.8))]}, ("box-2/+x",)),
    ],
)
def test_patches_that_no_line_lies_on(data: Data, names: tuple[str, ...]) -> None:
    body = outline(shape(**data), 0.1)
    met = plan_layers(body, []).met
    assert tuple(patch.name for patch, on in zip(body.patches, met, strict=True) if not on) == names


class TestJunctions:
    def test_of_an_l(self) -> None:
        body = outline(shape(**polygon((0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1), turned=20.0)), 0.05)
        found = junctions(body)
        assert [(edge.first, edge.second) for edge in found if edge.passes] == [(2, 3)]
        assert len(found) == 6
        points, which = corners(body, found)
        assert len(points) == 6
        known = np.array(polygon((0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1), turned=20.0)["points"])
        assert np.linalg.norm(points[:, None] - known, axis=2).min(1).max() < 1e-14
        assert (2, 3) in which

    def test_of_a_boss_are_concave_below_and_convex_above(self) -> None:
        boss = {"type": "cylinder", "name": "boss", "from": [1.0, 1.0, 0.2], "to": [1.0, 1.0, 1.0], "radius": 0.4}
        body = outline(shape(type="union", shapes=[box(2.0, 2.0, 0.5), boss]), 0.1)
        names = [patch.name for patch in body.patches]
        passes = {frozenset((names[edge.first], names[edge.second])): edge.passes for edge in junctions(body)}
        assert passes[frozenset(("box-1/+z", "boss"))]
        assert not passes[frozenset(("boss/to", "boss"))]
        assert sum(passes.values()) == 1
        assert len(corners(body, junctions(body))[0]) == 8

    def test_of_patches_that_run_into_each_other_pass(self) -> None:
        ends = [{"type": "disc", "center": [x, 0.5], "radius": 0.5} for x in (0.0, 1.0)]
        body = outline(shape(type="union", shapes=[box(1.0, 1.0), *ends]), 0.05)
        found = junctions(body)
        assert len(found) == 4
        assert all(edge.passes and not len(edge.points) for edge in found)


def test_connected_parts_are_numbered_by_their_lowest_node() -> None:
    chain = np.random.default_rng(3).permutation(1000)
    part = connected(chain[:-1], chain[1:], 1002)
    assert (part[:1000] == 0).all()
    assert part[1000:].tolist() == [1, 2]
    assert connected(np.array([3, 1]), np.array([2, 4]), 5).tolist() == [0, 1, 2, 2, 1]


def test_nearest_distances_are_exact_within_reach() -> None:
    rng = np.random.default_rng(4)
    for dim in (2, 3):
        sources, points = rng.uniform(0.0, 1.0, (300, dim)), rng.uniform(-0.5, 1.5, (400, dim))
        exact = np.linalg.norm(points[:, None] - sources, axis=2).min(1)
        found = nearest_distance(sources, points, 0.2)
        assert found[exact <= 0.2] == pytest.approx(exact[exact <= 0.2], abs=1e-14)
        assert np.isinf(found[exact > 0.2]).all()
