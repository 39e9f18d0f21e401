"""Errors."""

import copy

import wsph
from wsph.errors import Unstable


def test_errors_survive_copying_and_so_the_way_between_processes() -> None:
    fault = wsph.SceneError("s", [])
    unstable = Unstable("m", step=3, time=1.0, dt=0.1, field="energy", limit=1.0)
    for error in (fault, unstable):
        again = copy.deepcopy(error)  # by the same way as pickling
        assert (str(again), vars(again)) == (str(error), vars(error))
