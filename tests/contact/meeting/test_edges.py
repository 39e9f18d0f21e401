"""Edges against edges: which there are, where they cross, what acts."""

import numpy as np
import pytest

from tests.contact.meeting.standins import Standin, advance, box
from tests.contact.meeting.test_touch import meeting
from wsph.contact.meeting.edges import SHARE
from wsph.contact.meeting.meeting import ContactNumbers, Meeting
from wsph.contact.meeting.ridges import ridges


def about(axis: int, angle: float) -> np.ndarray:
    """The rotation about an axis [degrees]."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn[a, a], turn[a, b], turn[b, a], turn[b, b] = c, -s, s, c
    return turn


def test_the_ridges_of_a_box() -> None:
    """Twelve edges of k segments each; ridges end at the corners, where three of them meet."""
    mesh = box((4.0, 3.0, 2.0), 1.0)
    found = ridges(mesh.X, mesh.faces, mesh.N)
    assert len(found.line) == 4 * (4 + 3 + 2)
    ends = mesh.X[found.ends]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) == pytest.approx(1.0)
    normals = mesh.N[found.sides]
    assert np.abs((normals[:, 0] * normals[:, 1]).sum(1)).max() < 1e-14
    before, after = mesh.X[found.line[:, 0]], mesh.X[found.line[:, 3]]
    along = ends[:, 1] - ends[:, 0]
    corner = [(np.abs(np.abs(ends[:, k]) - [2.0, 1.5, 1.0]).max(1) < 1e-9) for k in (0, 1)]
    for at, there, end in ((0, before, ends[:, 0]), (1, after, ends[:, 1])):
        length = np.linalg.norm(there - end, axis=1)
        assert (length[corner[at]] == 0.0).all()
        assert length[~corner[at]] == pytest.approx(1.0)
        assert np.abs(np.cross(there - end, along)).max() < 1e-14


def crossed(shift: float, apart: float, contact: ContactNumbers) -> tuple[Standin, Standin, Meeting]:
    """Two bars on edge, one across the other, the upper edge of the first below the lower edge of the second."""
    across = about(2, 90.0) @ about(0, 45.0)
    high = np.sqrt(2.0)
    one = box((10.0, 2.0, 2.0), 1.0, about(0, 45.0), (0.0, 0.0, -high))
    other = box((10.0, 2.0, 2.0), 1.0, across, (shift, shift, high + apart))
    return meeting(one, other, contact)


def edge_forces(law: Meeting) -> np.ndarray:
    """On the edges of the first surface, (edges, 3)."""
    assert law.crossings is not None
    return law.crossings.record.force.numpy()


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.4, 0.5])
def test_crossed_bars_push_each_other_upright(shift: float) -> None:
    """Pressed by .2 cells: k = K eps h^2/2 along the vertical, in one crossing, wherever it lies between vertices."""
    a, b, law = crossed(shift, 0.02, ContactNumbers(stiffness=2.0))
    law.start()
    for step in range(1, 12):
        advance(law, a, b, np.array([0.0, 0.0, -0.02 * step]))
    force = edge_forces(law)
    assert (np.linalg.norm(force, axis=1) > 0.0).sum() == 1
    # The account of a spring that begins to close inside of a step has no part of that.
    assert force.sum(0) == pytest.approx([0.0, 0.0, -2.0 * SHARE * 0.2], abs=1e-12)
    assert np.abs(a.total + b.total).max() < 1e-15
    moment = np.cross(a.places(), a.force.numpy()).sum(0) + np.cross(b.places(), b.force.numpy()).sum(0)
    assert np.abs(moment).max() < 1e-14


def test_edges_inside_of_faces_do_not_meet() -> None:
    """A box on a plate: the ends of its edges see faces; no edge crosses another from inside."""
    a, b, law = meeting(
        box((6.0, 6.0, 2.0), 1.0), box((3.0, 3.0, 2.0), 1.0, about(2, 20.0), (0.2, 0.1, 2.02)), ContactNumbers()
    )
    law.start()
    for step in range(1, 8):
        advance(law, a, b, np.array([0.0, 0.0, -0.02 * step]))
    assert law.crossings is not None
    assert law.crossings.rows.count > 0
    assert np.abs(edge_forces(law)).max() == 0.0
    assert b.total[2] > 0.0


def test_no_energy_comes_out_of_crossed_bars() -> None:
    """Random moves of one bar over the other: the work put in covers what the accounts hold, and the debts that are left
    where a contact opened inside of a step are a small part of it."""
    a, b, law = crossed(0.3, 0.05, ContactNumbers())
    law.start()
    rng = np.random.default_rng(4)
    work, put_in, place, last = 0.0, 0.0, np.zeros(3), np.zeros(3)
    for _ in range(300):
        step = rng.normal(0.0, 0.05, 3) - 0.05 * (place + np.array([0.0, 0.0, 0.1]))
        place = place + step
        advance(law, a, b, place)
        done = 0.5 * float((b.total + last) @ step)
        work, put_in = work - done, put_in + abs(done)
        last = b.total
    assert put_in > 0.05
    assert work > law.stored - 0.1 * put_in
