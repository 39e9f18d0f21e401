"""What acts on bodies from outside is one file, `rigid_plane.py`, and one line of `wsph.contact.table.INTERACTIONS`."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.extensions.rigid_plane import rigid_plane
from tests.extensions.untouched import knowing
from wsph.contact.table import INTERACTIONS
from wsph.errors import Refused

SPEED = 0.01


@contextmanager
def plane(**numbers: Any) -> Iterator[None]:
    """The line of the table: the plane y = 0, and nothing below it."""
    line = partial(rigid_plane, **{"point": [0.5, 0.0], "normal": [0.0, 1.0], **numbers})
    INTERACTIONS.append(line)
    yield
    INTERACTIONS.remove(line)


def thrown(**run: Any) -> wsph.Scene:
    """A block of side and wave speed 1 that flies at the plane from 0.05 above it, and along it."""
    soft = scenes.material(poisson_ratio=0.0)
    block = scenes.body(scenes.box(1.0, (0.05, 1.05)), 0.1, velocity=[0.3 * SPEED, -SPEED], material=soft)
    return scenes.scene(block, run={"end": 8.0, **run}, output={"history": 1})


@pytest.mark.parametrize("point", [[0.5, 0.0], [7.0, 0.0]])
def test_a_block_bounces(point: list[float]) -> None:
    """Without lateral strain it is a bar: it meets the plane at t = 5, a wave goes through it and back, and it leaves at
    t = 7 with the velocity turned round, to two spacings of 0.1. Which of its points names the plane is all the same."""
    with plane(point=point):
        result = wsph.run(thrown())
    history, energy = result.history, result.summary["energy"]
    meeting = history["time"][history["contact"] > 0.05 * history["contact"].max()]
    assert meeting[[0, -1]] == pytest.approx([5.0, 7.0], abs=0.2)
    assert history["momentum_y"][0] == pytest.approx(-SPEED)
    assert history["momentum_y"][-1] == pytest.approx(SPEED, rel=0.02)
    # No friction.
    assert np.ptp(history["momentum_x"]) < 1e-14 * SPEED
    # Half of its energy stands still against the plane; in the end the block has it again.
    assert energy["kinetic"] + energy["strain"] == pytest.approx(history["kinetic"][0], rel=0.01)
    assert np.abs(history["residual"]).max() < 0.01 * history["kinetic"][0]
    assert abs(energy["residual"]) < 1e-3 * history["kinetic"][0]


def test_it_lowers_the_limit_of_the_time_step() -> None:
    """K/m of a node at a corner, a quarter of a cell, is 4 M h^0/(rho h^2); squares of frequencies add."""
    bare = wsph.compose(thrown()).bodies[0]
    for stiffness in (1.0, 9.0):
        with plane(stiffness=stiffness):
            limit = wsph.compose(thrown()).bodies[0].limit
            assert limit == pytest.approx(bare.limit / np.sqrt(1.0 + 4.0 * stiffness / bare.system.frequency**2))
            with pytest.raises(Refused, match=r"beyond its stability limit .*, and its contacts"):
                wsph.compose(thrown(cfl=1.01 * limit))


@pytest.mark.parametrize("run", [{"integrator": "lf4"}, {"integrator": "tsph", "cfl": 0.9}])
def test_what_it_cannot_push_is_refused(run: dict) -> None:
    with plane(), pytest.raises(Refused, match="body 'b': a rigid plane changes velocities between steps: use"):
        wsph.compose(thrown(**run))


def test_without_its_line_nothing_knows_it() -> None:
    assert len(wsph.compose(thrown()).interactions) == 0
    assert not knowing("rigid_plane")
    assert not knowing("RigidPlane")
