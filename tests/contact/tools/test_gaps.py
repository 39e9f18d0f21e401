"""Gaps and normals of rigid shapes, against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp
from pydantic import TypeAdapter

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.contact.tools.forms import Form, form_of
from wsph.contact.tools.moving import pose_struct
from wsph.contact.tools.touching import gaps_kernel
from wsph.scene.touch.tools import Tool


def tool(**shape: Any) -> Tool:
    keys = {"inside": shape.pop("inside", False)}
    return TypeAdapter(Tool).validate_python({"name": "t", "against": ["b"], "shape": shape, **keys})


def gaps(form: Form, points: np.ndarray, precision: str = "f64", spacing: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Gaps and normals at points, of a tool that has not moved."""
    space, clock = Space(form.dim, precision), Clock(1.0, "cpu")
    placed = form.on_device(np.zeros(form.dim), spacing, 1.0, space, "cpu")
    pose: Any = pose_struct(space)()
    for name in ("place", "shift", "velocity"):
        setattr(pose, name, wp.zeros(1, dtype=space.vec, device="cpu"))
    pose.axes = wp.array(np.eye(form.dim)[None], dtype=space.mat, device="cpu")
    pose.about = pose.spin = wp.zeros(1, dtype=space.point, device="cpu")
    x = wp.array(points, dtype=space.vec, device="cpu")
    gap = wp.zeros(len(points), dtype=space.scalar, device="cpu")
    normal = wp.zeros(len(points), dtype=space.vec, device="cpu")
    clock.launch(gaps_kernel(space, form.kind), len(points), [placed.struct, pose, x], [gap, normal])
    return gap.numpy().astype(float), normal.numpy().reshape(len(points), form.dim).astype(float)


def points(dim: int, reach: float = 2.0, n: int = 500) -> np.ndarray:
    return np.random.default_rng(0).uniform(-reach, reach, (n, dim))


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_plane(dim: int):
    at, way = np.array([0.3, -0.2, 0.5])[:dim], np.array([1.0, 2.0, -2.0])[:dim]
    x = points(dim)
    gap, normal = gaps(form_of(tool(type="plane", point=at.tolist(), normal=way.tolist()), dim), x)
    unit = way / np.linalg.norm(way)
    np.testing.assert_allclose(gap, (x - at) @ unit, atol=1e-15)
    np.testing.assert_allclose(normal, np.tile(unit, (len(x), 1)), atol=1e-15)


@pytest.mark.parametrize(("dim", "inside"), [(2, False), (3, False), (3, True)])
def test_a_ball_and_a_hole(dim: int, inside: bool):
    at, x = np.array([0.3, -0.2, 0.5])[:dim], points(dim)
    gap, normal = gaps(form_of(tool(type="sphere", center=at.tolist(), radius=0.7, inside=inside), dim), x)
    way, sign = x - at, -1.0 if inside else 1.0
    length = np.linalg.norm(way, axis=1)
    np.testing.assert_allclose(gap, sign * (length - 0.7), atol=1e-15)
    np.testing.assert_allclose(normal, sign * way / length[:, None], atol=1e-14)


def test_a_cylinder_has_no_ends():
    start, end = np.array([0.0, 0.1, 0.0]), np.array([0.2, 0.3, 0.4])
    x, axis = points(3), (end - start) / np.linalg.norm(end - start)
    gap, normal = gaps(form_of(tool(type="cylinder", radius=0.3, **{"from": start.tolist(), "to": end.tolist()}), 3), x)
    way = (x - start) - np.outer((x - start) @ axis, axis)
    np.testing.assert_allclose(gap, np.linalg.norm(way, axis=1) - 0.3, atol=1e-14)
    np.testing.assert_allclose(normal, way / np.linalg.norm(way, axis=1)[:, None], atol=1e-13)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turned_box_is_round_about_its_edges(dim: int):
    half = np.array([0.8, 0.5, 0.4])[:dim]
    middle = np.array([0.1, 0.2, -0.1])[:dim]
    turn = 30.0 if dim == 2 else [[0, 0, 1], 30.0]
    low, high = (middle - half).tolist(), (middle + half).tolist()
    x = points(dim)
    gap, normal = gaps(form_of(tool(type="box", rotate=turn, **{"from": low, "to": high}), dim), x)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    axes = np.eye(dim)
    axes[:2, :2] = [[c, -s], [s, c]]
    q = (x - middle) @ axes
    over = np.abs(q) - half
    right = np.linalg.norm(np.maximum(over, 0.0), axis=1) + np.minimum(over.max(1), 0.0)
    np.testing.assert_allclose(gap, right, atol=1e-14)
    # The normal is the slope of the gap, wherever that has one.
    e = 1e-6
    slope = np.stack(
        [
            (gaps(form_of(tool(type="box", rotate=turn, **{"from": low, "to": high}), dim), x + e * d)[0] - gap) / e
            for d in np.eye(dim)
        ],
        1,
    )
    smooth = np.abs(np.linalg.norm(slope, axis=1) - 1.0) < 1e-4
    assert smooth.mean() > 0.98
    np.testing.assert_allclose(normal[smooth], slope[smooth], atol=1e-4)
    assert (gap[(over < 0.0).all(1)] < 0.0).all()
    assert (gap > 0.0).any()


def write_box(path: Path, low: np.ndarray, high: np.ndarray) -> None:
    """A box as an STL file of twelve triangles."""
    corners = np.array([[low[0] if i == 0 else high[0], low[1] if j == 0 else high[1], low[2] if k == 0 else high[2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # fmt: skip
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["solid box"]
    for a, b, c, d in quads:
        for face in ((a, b, c), (a, c, d)):
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {' '.join(repr(float(x)) for x in corners[v])}" for v in face]
            lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid"]))


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_a_box_of_triangles_is_the_box(tmp_path: Path, precision: str):
    """Faces, edges, corners, inside and out, in the precision of the run though the tree is of single precision."""
    low, high = np.array([-0.7, -0.5, -0.3]), np.array([0.7, 0.5, 0.3])
    write_box(tmp_path / "box.stl", low, high)
    x = points(3, 1.0, 2000)
    form = form_of(tool(type="stl", file=str(tmp_path / "box.stl")), 3)
    gap, normal = gaps(form, x, precision)
    box_gap, box_normal = gaps(form_of(tool(type="box", **{"from": low.tolist(), "to": high.tolist()}), 3), x)
    rounding = 1e-13 if precision == "f64" else 1e-6
    np.testing.assert_allclose(gap, box_gap, atol=rounding)
    # Inside, on the planes between two faces that are equally near, either will do.
    tied = np.sort(np.abs(np.abs(x) - high), axis=1)
    clear = (tied[:, 1] - tied[:, 0] > 1e-5) | (box_gap > 0.0)
    np.testing.assert_allclose(normal[clear], box_normal[clear], atol=1e-9 if precision == "f64" else 2e-4)
    np.testing.assert_allclose(form.middle, 0.0, atol=1e-7)
    sides = (high - low) ** 2 / 12.0
    np.testing.assert_allclose(form.gyration, np.diag(sides.sum() - sides), atol=1e-7)


def test_inertia_of_a_ball_a_box_and_a_bar():
    ball = form_of(tool(type="sphere", center=[1.0, 0.0, 0.0], radius=2.0), 3)
    np.testing.assert_allclose(ball.gyration, 0.4 * 4.0 * np.eye(3))
    disc = form_of(tool(type="disc", center=[1.0, 0.0], radius=2.0), 2)
    np.testing.assert_allclose(disc.gyration, np.diag([0.0, 0.0, 2.0]))
    bar = form_of(tool(type="cylinder", radius=1.0, **{"from": [0, 0, 0], "to": [0, 3.0, 0]}), 3)
    np.testing.assert_allclose(bar.gyration, np.diag([1.0, 0.5, 1.0]), atol=1e-15)
    box = form_of(tool(type="box", rotate=[[0, 0, 1], 90.0], **{"from": [0, 0, 0], "to": [1.0, 2.0, 3.0]}), 3)
    np.testing.assert_allclose(box.gyration, np.diag([1 + 9, 4 + 9, 1 + 4]) / 12.0, atol=1e-15)
