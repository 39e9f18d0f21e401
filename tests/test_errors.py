"""Errors."""

import copy

import wsph
from wsph.errors import Unstable, is_out_of_memory


def test_errors_survive_copying_and_so_the_way_between_processes() -> None:
    fault = wsph.SceneError("s", [])
    unstable = Unstable("m", step=3, time=1.0, dt=0.1, field="energy", limit=1.0)
    for error in (fault, unstable):
        again = copy.deepcopy(error)  # by the same way as pickling
        assert (str(again), vars(again)) == (str(error), vars(error))


def test_memory_that_ends_is_told_from_other_failures() -> None:
    chained = RuntimeError("Failed to load the shared library 'x.so'")
    chained.__cause__ = OSError("x.so: failed to map segment from shared object")
    ends = [
        MemoryError(),
        RuntimeError("Failed to allocate 8 bytes on device 'cuda:0'"),
        chained,
        OSError(12, "Cannot allocate memory"),
    ]
    others = [
        RuntimeError("Failed to load"),
        ValueError("Failed to allocate"),
        OSError(28, "No space left on device"),
        ImportError("no"),
    ]
    assert all(is_out_of_memory(error) for error in ends)
    assert not any(is_out_of_memory(error) for error in others)
