"""Vertices against faces: nearest points, gaps, forces, what they keep and what they take."""

import numpy as np
import pytest
import warp as wp

from tests.contact.meeting.standins import PlainMesh, Standin, advance, box, circle, polygon, square
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.contact.meeting.closest import on_triangle
from wsph.contact.meeting.meeting import ContactNumbers, Meeting

DT = 0.1


def meeting(
    one: PlainMesh, other: PlainMesh, contact: ContactNumbers, spacing: float = 1.0, dt: float = DT
) -> tuple[Standin, Standin, Meeting]:
    """Two surfaces of meshes, and the law of their meeting, with candidates."""
    space, clock = Space(one.X.shape[1]), Clock(dt, "cpu")
    a, b = (Standin(name, mesh, spacing, space, clock) for name, mesh in (("a", one), ("b", other)))
    law = Meeting("contact", a, b, contact, space, clock)
    law.find({"a": a.places(), "b": b.places()}, 2.0 * spacing)
    return a, b, law


def test_the_nearest_point_of_a_triangle() -> None:
    """Against the best of a fine grid of its points, from places all around it."""
    space = Space(3)
    triangle = on_triangle(space)

    @kernel()
    def nearest(p: wp.array(dtype=space.vec), t: wp.array(dtype=space.vec), out_out: wp.array(dtype=space.point)):
        i = wp.tid()
        out_out[i] = triangle(p[i], t[0], t[1], t[2])

    rng = np.random.default_rng(1)
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.3, 0.8, -0.1]])
    places = rng.uniform(-1.0, 2.0, (200, 3))
    weights = wp.zeros(200, dtype=space.point, device="cpu")
    p, t = (wp.array(each, dtype=space.vec, device="cpu") for each in (places, corners))
    wp.launch(nearest, 200, inputs=[p, t], outputs=[weights], device="cpu")
    b = weights.numpy()
    assert np.abs(b.sum(1) - 1.0).max() < 1e-14
    assert b.min() >= 0.0
    found = np.linalg.norm(places - b @ corners, axis=1)
    s, q = np.meshgrid(np.linspace(0.0, 1.0, 201), np.linspace(0.0, 1.0, 201))
    grid = np.stack([1.0 - s, s * (1.0 - q), s * q], axis=-1).reshape(-1, 3) @ corners
    best = np.linalg.norm(places[:, None] - grid, axis=2).min(1)
    assert (found <= best + 1e-12).all()
    assert np.abs(found - best).max() < 4e-3  # the grid's own step is 5e-3


def test_a_pressed_face_bears_its_area() -> None:
    """Two unit cells of side 10 pressed by .1: K eps = 1/(1/2 + 1/2), once from each side, over the side that faces."""
    one, other = square(10.0, 1.0), square(10.0, 1.0, (10.2, 0.0))
    a, b, law = meeting(one, other, ContactNumbers())
    law.start()
    for step in range(1, 4):
        advance(law, a, b, np.array([-0.1 * step, 0.0]))
    assert a.total[0] == pytest.approx(-0.1 * 10.0, rel=1e-12)
    assert law.stored == pytest.approx(0.5 * 0.1**2 * 10.0, rel=1e-12)
    assert np.abs(a.total + b.total).max() < 1e-15
    assert law.force(a) == pytest.approx(a.total, abs=1e-15)


def test_a_chord_s_error_cancels_on_circles() -> None:
    """Circles pressed by .04 R: the depth of a vertex is that in the circle. That from the chord is less by up to the
    sagitta, h^2/8R = .0055 R, that from the tangents more by as much."""
    radius, count = 1.0, 30
    spacing = 2.0 * np.pi * radius / count
    for turn in np.linspace(0.0, 0.8 * spacing, 5):
        one = circle(radius, count, first=np.pi / count)
        other = circle(radius, count, (2.0 * radius, 0.0), np.pi + turn)
        a, b, law = meeting(one, other, ContactNumbers(), spacing)
        for s in np.linspace(0.005, 0.04, 8):
            advance(law, a, b, np.array([-s, 0.0]))
        way = law.ways[1]
        force = np.linalg.norm(way.record.force.numpy(), axis=1)
        x = b.places()
        true = radius - np.linalg.norm(x, axis=1)
        deep = true > 0.005
        assert deep.any()
        # Half of the stiffness each way, over the area that faces the other: a segment, nearly.
        depth = force[deep] / (0.5 * law._numbers.stiffness * 2.0 * radius * np.sin(np.pi / count))
        assert np.abs(depth - true[deep]).max() < 0.03 * 0.04


@pytest.mark.parametrize("dim", [2, 3])
def test_vertices_over_vertices_share(dim: int) -> None:
    """A vertex over a vertex of a dented surface has several nearest faces: mirror symmetry stays."""
    if dim == 2:
        flat = polygon(np.array([[-3.0, -2.0], [3.0, -2.0], [3.0, 0.0], [-3.0, 0.0]]), 1.0)
        tip = polygon(np.array([[-1.0, 1.0], [0.0, 0.05], [1.0, 1.0]]), 0.7)
    else:
        flat = box((6.0, 6.0, 2.0), 1.0, centre=(0.0, 0.0, -1.0))
        tip = box((4.0, 4.0, 1.0), 1.0, centre=(0.0, 0.0, 0.55))
    a, b, law = meeting(flat, tip, ContactNumbers())
    law.start()
    dent = np.zeros_like(flat.X)
    dent[np.linalg.norm(flat.X, axis=1) < 1e-9, dim - 1] = -0.02
    down = np.zeros(dim)
    for step in range(1, 5):
        down[dim - 1] = -0.05 * step
        advance(law, a, b, down, dent)
    total = b.total
    assert total[dim - 1] > 0.01
    assert np.abs(total[: dim - 1]).max() < 1e-15
    # The reaction is symmetric vertex by vertex: in 3D, where triangles lie askew, by half a turn.
    force = {tuple(np.round(x, 9) + 0.0): f for x, f in zip(flat.X, a.force.numpy(), strict=True)}
    sign = np.array([*[-1.0] * (dim - 1), 1.0])
    for x, f in force.items():
        assert np.abs(sign * f - force[tuple(sign * np.array(x) + 0.0)]).max() < 1e-15


@pytest.mark.parametrize("dim", [2, 3])
def test_action_is_reaction(dim: int) -> None:
    """Forces of bodies that meet askew, with friction and damping, to rounding; their moments too where flat faces meet
    without friction, whose couple is the depth times it."""
    turn = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], [0.0, 0.6, 0.8]]
    )
    one = square(6.0, 1.0, turn=0.1) if dim == 2 else box((6.0, 6.0, 6.0), 1.0)
    other = square(4.0, 0.8, (5.3, 0.2), 0.3) if dim == 2 else box((4.0, 4.0, 4.0), 0.8, turn, (6.0, 0.3, 0.1))
    flat = square(4.0, 0.8, (5.1, 0.2)) if dim == 2 else box((4.0, 4.0, 4.0), 0.8, None, (5.1, 0.3, 0.1))
    turned = square(6.0, 1.0) if dim == 2 else one
    for body, against, jiggle, friction in ((one, other, 0.02, 0.0), (one, other, 0.02, 0.4), (turned, flat, 0.0, 0.0)):
        a, b, law = meeting(body, against, ContactNumbers(friction=friction, damping=friction))
        law.start()
        rng = np.random.default_rng(2)
        shaken = [rng.uniform(-jiggle, jiggle, side.mesh.X.shape) for side in (a, b)]
        into = np.zeros(dim)
        for step in range(1, 6):
            into[:2] = -0.1 * step, 0.03 * step
            advance(law, a, b, into + shaken[1] * step, shaken[0] * step)
        f, g = a.force.numpy(), b.force.numpy()
        size = np.abs(f).sum()
        assert size > 0.05
        assert np.abs(f.sum(0) + g.sum(0)).max() < 1e-14 * size
        assert np.abs(law.force(a) - f.sum(0)).max() < 1e-14 * size
        if not jiggle:
            assert np.abs(_moment(a.places(), f) + _moment(b.places(), g)).max() < 1e-13 * size


def _moment(x: np.ndarray, f: np.ndarray) -> np.ndarray:
    padded = [np.pad(each, ((0, 0), (0, 3 - each.shape[1]))) for each in (x, f)]
    return np.cross(*padded).sum(0)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_no_path_takes_energy_out_of_a_contact(dim: int, damping: float) -> None:
    """Random moves of a square at another's corner, where nearest faces flip. The work of a step is the mean of the forces
    at its ends times the way. What the bodies have put in, less what damping took, is never less than what all accounts
    hold. Below zero is an account only where a contact opened inside of a step, which gave back too much; it pays that when
    it closes again."""
    rng = np.random.default_rng(5)
    for _ in range(6):
        one = square(4.0, 1.0) if dim == 2 else box((4.0, 4.0, 4.0), 1.0)
        at = rng.uniform(2.7, 4.2, dim)
        other = square(4.0, 1.0, tuple(at), 0.2) if dim == 2 else box((4.0, 4.0, 4.0), 1.0, None, tuple(at))
        a, b, law = meeting(one, other, ContactNumbers(damping=damping, edges=False))
        work, put_in, place, last = 0.0, 0.0, np.zeros(dim), np.zeros(dim)
        account: list[np.ndarray] = []
        for _ in range(150):
            step = rng.normal(0.0, 0.08, dim) - 0.05 * place
            place = place + step
            advance(law, a, b, place)
            done = 0.5 * float((b.total + last) @ step)
            work -= done
            put_in += abs(done)
            last = b.total
            account = [way.memory["account"].numpy() for way in law.ways]
            assert work - law.dissipated >= sum(each.sum() for each in account) - 1e-13
        assert put_in > 0.004
        debt = -sum(np.minimum(each, 0.0).sum() for each in account)
        assert work >= law.stored - debt - 1e-13
        assert debt < 0.1 * put_in


def test_the_account_is_exact_on_a_spring() -> None:
    """In and out along one way, in uneven steps: what comes out is what went in."""
    one, other = square(6.0, 1.0), square(6.0, 1.0, (6.05, 0.0))
    a, b, law = meeting(one, other, ContactNumbers(stiffness=2.0))
    law.start()
    rng = np.random.default_rng(3)
    ways = rng.uniform(0.01, 0.06, 12)
    path = np.concatenate([np.cumsum(ways), np.cumsum(ways)[::-1][1:], [0.0, 0.0]])
    last, before, work = np.zeros(2), 0.0, 0.0
    for s in path:
        advance(law, a, b, np.array([-s, 0.0]))
        work -= 0.5 * float((b.total + last)[0]) * -(s - before)
        depth = max(s - 0.05, 0.0)
        assert b.total[0] == pytest.approx(2.0 * 6.0 * depth, abs=1e-12)
        last, before = b.total, s
    assert law.stored == 0.0
    assert abs(work) < 1e-13 + 2.0 * 6.0 * 0.05 * 0.06  # opening and closing inside of a step


def test_stages_that_are_tried_leave_no_trace() -> None:
    """Evaluations elsewhere between two closes change nothing, to the bit."""
    results = []
    for stages in (0, 3):
        a, b, law = meeting(
            square(6.0, 1.0), square(6.0, 1.0, (6.05, 0.1), 0.05), ContactNumbers(friction=0.3, damping=1.0)
        )
        law.start()
        for step in range(1, 8):
            target = np.array([-0.05 * step, 0.04 * step])
            for k in range(stages):
                a.place()
                b.place(target * (0.3 + 0.4 * k))
                law.act()
            advance(law, a, b, target)
        results.append((b.force.numpy().copy(), law.stored, law.dissipated))
    assert (results[0][0] == results[1][0]).all()
    assert results[0][1:] == results[1][1:]


def test_an_overlap_at_the_start_is_none() -> None:
    a, b, law = meeting(square(6.0, 1.0), square(6.0, 1.0, (5.9, 0.0)), ContactNumbers())
    law.start()
    advance(law, a, b, 0.0)
    assert np.abs(b.force.numpy()).max() == 0.0
    for s in (0.05, 0.1):
        advance(law, a, b, np.array([-s, 0.0]))
    assert b.total[0] == pytest.approx(0.1 * 6.0, rel=1e-6)
    # Once it was clear of the other, nothing is eased any more.
    for s in (0.09, 0.05, 0.0, -0.05, -0.1, -0.3, -0.1, -0.05, 0.0):
        advance(law, a, b, np.array([-s, 0.0]))
    assert b.total[0] == pytest.approx(0.1 * 6.0, rel=1e-6)
