"""Scenes that do not converge with the spacing: a search says so, and gives no bar."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from coverage_lost import LINKS, SOFTENING, THROWS
from coverage_scenes import _bar, _elastic, _probe

from wsph.accuracy.columns import aims
from wsph.accuracy.envelope import KEEP, boundless, estimate
from wsph.accuracy.limits import Limit
from wsph.accuracy.measures import Record, distances
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import UNLIKE, Found, search, torn

FALLING = {"pulled at 0.015 t", "pulled at 0.03 t", "pulled at 0.05 t"}
"""Of these the differences of five rows fall by chance: what tells is that their links break over ever more area."""


def ended(case) -> Found:
    return search(Rows(case.scene), aims(case.scene, case.tolerances[0]), Limit(None, case.limit * case.work))


def assert_no_convergence(found: Found) -> None:
    assert found.status == "no convergence"
    assert "differences of neighbours" in found.why
    (column,) = found.seen.values()
    assert column.estimate.bar == float("inf")
    assert not column.estimate.converges


@pytest.mark.parametrize("number", range(len(SOFTENING)))
def test_softening_without_a_length(number):
    assert_no_convergence(ended(SOFTENING[number]()))


@pytest.mark.filterwarnings("ignore:.*cracks of links follow the lattice:RuntimeWarning")
@pytest.mark.parametrize("number", range(len(LINKS)))
def test_virtual_links_at_several_rates(number):
    case = LINKS[number]()
    found = ended(case)
    assert_no_convergence(found)
    if case.name.removeprefix("virtual links, ") in FALLING:
        assert "every finer lattice has more area of cracks" in found.why


def test_a_size_that_grows_by_ever_more_has_no_limit():
    h = np.array([1.0, 2.0, 4.0, 16.0 / 3.0])
    assert boundless(h, 1.0 / h)
    assert boundless(h, h**-0.5)
    assert not boundless(h, 3.0 - h**0.5)
    assert not boundless(h, [1.0, 1.0, 1.0, 1.0])
    # One more link in the finest row, and an area that comes and goes.
    assert not boundless(h, [2.0, 1.0, 1.0, 1.0])
    assert not boundless(h, [1.2, 0.9, 0.6, 0.8])
    assert not boundless(h[:3], 1.0 / h[:3])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("threshold", [5e-4, 1e-3, 1.5e-3])
def test_what_follows_an_order_is_believed_where_cracks_have_no_limit(threshold):
    """A bar that breaks at a stretch in the tension of a pulse that comes back from its free end, into as many pieces as its
    ringing has waves: where the pulse is on its way there a column converges all the same."""
    pulse = "2e-3*(min(t, 0.1)/0.1 - min(max(t-0.1, 0), 0.4)/0.4)"
    body = {"links": {"criterion": "stretch", "threshold": threshold}, "viscosity": {"alpha": 0.5, "beta": 0.5}}
    scene = _bar(1.0 / 40, form="total-lagrangian", end=1.6, cfl=0.4, material=_elastic() | {"model": "jaumann"},
                 body=body, boundary=[{"face": "-x", "traction": {"x": pulse}}], probes=_probe([0.25], "velocity_x"))  # fmt: skip
    rows = Rows(scene)
    found = search(rows, aims(scene, 0.05), Limit(None, 1e6))
    assert torn(rows)
    assert found.status != "no convergence"
    assert all(each.estimate.converges for each in found.seen.values())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("number", range(len(THROWS)))
def test_a_block_thrown_into_a_room_with_a_pillar(number):
    """Six throws, half a minute each."""
    assert_no_convergence(ended(THROWS[number]()))


def billiard(angle: float, off: float, end: float) -> Record:
    """Where a point is in x that flies about in a room of side 2 with a pillar of radius 0.45 (Sinai 1970), both `off` by a
    part: every reflexion from the pillar multiplies the difference of two ways by about five."""
    x, v, t, radius = np.array([0.3, 0.3]), 0.2 * np.array([np.cos(angle), np.sin(angle)]), 0.0, 0.45 * (1.0 + off)
    low, high = 0.3 * off, 2.0 - 0.3 * off
    times, places = [t], [x[0]]
    while t < end:
        events = [((high if v[k] > 0.0 else low) - x[k]) / v[k] for k in (0, 1)]
        along, off_centre = (x - 1.0) @ v, (x - 1.0) @ (x - 1.0) - radius**2
        under = along**2 - (v @ v) * off_centre
        touch = (-along - np.sqrt(under)) / (v @ v) if under > 0.0 and along < 0.0 else np.inf
        events.append(touch if touch > 1e-9 else np.inf)
        hit = int(np.argmin(events))
        x, t = x + events[hit] * v, t + events[hit]
        normal = (x - 1.0) / np.linalg.norm(x - 1.0) if hit == 2 else np.eye(2)[hit]
        v = v - 2.0 * (v @ normal) * normal
        times.append(t)
        places.append(x[0])
    spread = np.linspace(0.0, end, 400)
    return Record(spread, np.interp(spread, times, places) - 0.3)


def test_chaotic_rebounds_of_a_point_show_no_convergence_and_few_of_them_do():
    """Forty throws with errors of first order in h: over ten times of flight rows converge as they should; over eighty the
    finest two of five rows are unlike, or the four finest follow no order."""
    h = np.array([0.05, 0.1, 0.2, 0.3, 0.4])
    told = {4.0: 0, 80.0: 0}
    for end in told:
        for angle in np.radians(np.linspace(3.0, 87.0, 40)):
            table = distances([billiard(angle, 0.1 * each, end) for each in h[:KEEP]])
            found = estimate(h[:KEEP], table, 1.0, tolerance=0.01)
            told[end] += not found.converges or found.differences[0] > UNLIKE
    assert told[4.0] <= 2
    assert told[80.0] >= 32
