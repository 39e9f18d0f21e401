"""Scenes that do not converge with the spacing: a search says so, and gives no bar."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import coverage_scenes

from wsph.accuracy.columns import aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import search


@pytest.mark.filterwarnings("ignore:.*cracks of links follow the lattice:RuntimeWarning")
@pytest.mark.parametrize("make", coverage_scenes.LOST, ids=lambda make: make.__name__.strip("_"))
def test_no_convergence_is_observed(make):
    case = make()
    found = search(Rows(case.scene), aims(case.scene, case.tolerances[0]), Limit(None, case.limit * case.work))
    assert found.status == "no convergence"
    assert "differences of neighbours" in found.why
    (column,) = found.seen.values()
    assert column.estimate.bar == float("inf")
