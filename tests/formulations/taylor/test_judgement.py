"""What two-set bodies say of their own answers: turned beyond small strain."""

import warnings

import pytest

import wsph
from tests import scenes


def driven(dim: int, x: str, y: str, end: float) -> wsph.Scene:
    """A block in small strain, every particle of which moves."""
    drive = [{"body": "b", "where": "x > -1", "velocity": {"x": x, "y": y}}]
    tables = {"boundary": drive, "output": {"fields": ["displacement"]}, "stop": {"energy": 1e9}}
    return scenes.block(dim, 2, centred=True, run={"integrator": "tsph", "end": end}, tables=tables)


@pytest.mark.filterwarnings("ignore:.*energy was")
@pytest.mark.parametrize("dim", [2, 3])
def test_a_body_that_turns_in_small_strain_is_named(dim: int) -> None:
    spin = ["-0.1*(x*sin(0.1*t) + y*cos(0.1*t))", "0.1*(x*cos(0.1*t) - y*sin(0.1*t))"]
    with pytest.warns(RuntimeWarning, match="'b' has turned or stretched beyond small strain.*ul-tsph"):
        wsph.run(driven(dim, *spin, end=2.0))


def test_one_that_hardly_does_is_not() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message="unlikely")
        wsph.run(driven(2, "1e-3*x + 1e-3*y", "1e-3*x", end=1.0))
