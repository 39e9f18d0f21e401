"""Friction of surfaces: a spring until it slips, heat from then on, and a memory of the normal force."""

import numpy as np
import pytest

from tests.contact.meeting.standins import Standin, advance, square
from tests.contact.meeting.test_touch import DT, meeting
from wsph.contact.meeting.meeting import ContactNumbers, Meeting
from wsph.contact.meeting.ways import TANGENT

DEPTH, SIDE = 0.1, 4.0


def pressed(contact: ContactNumbers) -> tuple[Standin, Standin, Meeting]:
    """A square of side 4 on one of side 10, of unit cells, pressed by a tenth of one. K eps = K."""
    a, b, law = meeting(square(10.0, 1.0), square(SIDE, 1.0, (7.05, 0.0)), contact)
    law.start()
    for s in np.linspace(0.0, 0.05 + DEPTH, 7)[1:]:
        step(a, b, law, (-s, 0.0))
    return a, b, law


def step(a: Standin, b: Standin, law: Meeting, place: tuple[float, float]) -> None:
    advance(law, a, b, np.array(place))


def normal(law: Meeting, a: Standin) -> float:
    """The vertices of the second push with half of the stiffness over its side; those of the first that it covers push with
    theirs: here as many."""
    return -float(law.force(a)[0])


def test_sticking_is_a_spring() -> None:
    """k_t = .7 of the stiffness of depth, for every vertex in contact, and no heat."""
    a, b, law = pressed(ContactNumbers(friction=0.8, memory=0.0, damping=0.0))
    push = normal(law, a)
    for s in (0.01, 0.03, 0.02, 0.05):
        step(a, b, law, (-0.05 - DEPTH, s))
        assert law.force(b)[1] == pytest.approx(-TANGENT * push / DEPTH * s, rel=1e-12)
        assert law.dissipated == pytest.approx(0.0, abs=1e-16)


def test_slipping_is_coulomb_s_and_its_heat_is_the_work() -> None:
    a, b, law = pressed(ContactNumbers(friction=0.2, memory=0.0, damping=0.0))
    push, before = normal(law, a), law.stored
    way, steps = 1.0, 200
    work, last = 0.0, 0.0
    for s in np.linspace(0.0, way, steps + 1)[1:]:
        step(a, b, law, (-0.05 - DEPTH, s))
        work -= 0.5 * (law.force(b)[1] + last) * way / steps
        last = law.force(b)[1]
    assert last == pytest.approx(-0.2 * normal(law, a), rel=1e-9)
    # Vertices that slide over others' edges change the area by a little.
    assert normal(law, a) == pytest.approx(push, rel=0.15)
    held = law.stored - before
    # What a spring holds whose vertex slides over an edge of the other goes with its area, and is nobody's.
    assert law.dissipated == pytest.approx(work - held, rel=0.05)


def test_what_slips_does_not_spring_back_further_than_it_was_held() -> None:
    a, b, law = pressed(ContactNumbers(friction=0.2, memory=0.0, damping=0.0))
    held = 0.2 * DEPTH / TANGENT
    for s in np.linspace(0.0, 0.3, 31)[1:]:
        step(a, b, law, (-0.05 - DEPTH, s))
    for s in np.linspace(0.3, 0.3 - held, 21)[1:]:
        step(a, b, law, (-0.05 - DEPTH, s))
    assert abs(law.force(b)[1]) < 1e-3 * normal(law, a)


def test_friction_follows_the_normal_force_with_its_memory() -> None:
    """A step of the normal force, long after it began: mu P approaches it as 1 - exp(-t/tau), tau = 20 cells of waves."""
    tau = 20.0
    a, b, law = pressed(ContactNumbers(friction=0.3, memory=tau, damping=0.0))
    side, place = 0.0, 0.05 + DEPTH
    for _ in range(int(6.0 * tau / DT)):
        step(a, b, law, (-place, side))
    before = normal(law, a)
    times, bounds = [], []
    for k in range(400):
        # Slipping all the time, back and forth over a tenth of a cell.
        side += 0.05 if (k // 4) % 2 == 0 else -0.05
        step(a, b, law, (-place - 0.1, side))
        times.append((k + 1) * DT)
        bounds.append(abs(law.force(b)[1]))
    after = normal(law, a)
    assert after == pytest.approx(2.0 * before, rel=0.05)
    pressing = sum(way.memory["pressing"].numpy().sum() for way in law.ways)
    expected = after + (before - after) * np.exp(-times[-1] / tau)
    assert pressing == pytest.approx(expected, rel=3e-3)  # in steps of tau/200
    # Slipping, friction is that bound, less where a vertex has just turned back.
    assert bounds[3] == pytest.approx(0.3 * (after + (before - after) * np.exp(-times[3] / tau)), rel=0.05)


def test_a_young_contact_has_friction_at_once() -> None:
    """A memory of tau alone would know of a tenth of a normal force that has lasted for 2 of 20; the running mean of its
    whole life knows it all."""
    a, b, law = pressed(ContactNumbers(friction=0.3, memory=20.0, damping=0.0))
    for k in range(20):
        step(a, b, law, (-0.05 - DEPTH, 0.05 * (k + 1)))
    assert law.force(b)[1] == pytest.approx(-0.3 * normal(law, a), rel=0.1)


def test_damping_takes_what_it_takes() -> None:
    """A normal approach at a constant speed: the damper adds zeta Z v A to the push; what it takes is its work."""
    speed, zeta = 0.1, 0.7
    contact = ContactNumbers(damping=zeta, soft=False)
    a, b, law = meeting(square(10.0, 1.0), square(SIDE, 1.0, (7.05, 0.0)), contact)
    law.start()
    for k in range(1, 16):
        step(a, b, law, (-speed * DT * k, 0.0))
    depth, spring = speed * DT * 15 - 0.05, float(law._numbers.stiffness)
    push = normal(law, a)
    area = push / (spring * depth + zeta * speed)
    assert area == pytest.approx(4.0, rel=0.26)  # of the first's vertices five are covered, of the second's side 4
    assert law.stored == pytest.approx(0.5 * spring * area * depth**2, rel=1e-9)
    taken = zeta * area * speed * (depth - 0.5 * speed * DT)
    assert law.dissipated == pytest.approx(taken, rel=0.05)
