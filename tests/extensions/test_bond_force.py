"""A formulation is one file, `bond_force.py`, and one line of `wsph.plugins.formulations.FORMULATIONS`."""

from collections.abc import Iterator

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.extensions.untouched import knowing
from wsph.errors import Refused, SceneError
from wsph.plugins.formulations import FORMULATIONS, Formulation
from wsph.protocols import Traits

BOND_FORCE = Formulation(
    "bond-force", 1, Traits(one_set=True, pairwise=True, measures=True), "tests.extensions.bond_force:build",
    as_="total-lagrangian",
)  # fmt: skip


@pytest.fixture(autouse=True)
def known() -> Iterator[None]:
    """The line of the table."""
    FORMULATIONS.append(BOND_FORCE)
    yield
    FORMULATIONS.remove(BOND_FORCE)


def bar(cells: int, **run: object) -> wsph.Scene:
    """A free bar of length, wave speed and density 1, started in its first mode."""
    soft = scenes.material(poisson_ratio=0.0)
    body = scenes.body(scenes.box(1.0), 1.0 / cells, velocity=["1e-4*cos(pi*x)"], material=soft)
    keys = {"integrator": "leapfrog", "formulation": "bond-force", "end": 2.0, "cfl": 0.3}
    return scenes.scene(body, run={**keys, **run}, output={"history": 1})


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
def test_a_bar_of_bonds_vibrates_as_the_material_says(integrator: str) -> None:
    """After a period the mode is as at the start. A bond ends some spacings inside of where a wave does: first order."""
    gaps = []
    for cells in (40, 80):
        result = wsph.run(bar(cells, integrator=integrator))
        gaps.append(np.abs(result.particles["velocity"][:, 0] - 1e-4 * np.cos(np.pi * result.particles["position"][:, 0])).max() / 1e-4)  # fmt: skip
        history = result.history
        assert np.abs(history["momentum_x"]).max() < 1e-17
        assert np.abs(history["residual"]).max() < 2e-3 * history["kinetic"][0]
        assert history["strain"].max() == pytest.approx(history["kinetic"][0], rel=2e-3)
    assert gaps[1] < 0.6 * gaps[0] < 0.05


def test_its_limit_is_that_of_its_own_right_hand_sides() -> None:
    limit = wsph.compose(bar(20)).bodies[0].limit
    assert wsph.run(bar(20, cfl=0.98 * limit, end=20.0)).stable
    with pytest.raises(Refused, match="is beyond its stability limit"):
        wsph.compose(bar(20, cfl=1.1 * limit))


def test_what_it_cannot_do_is_refused_by_name() -> None:
    with pytest.raises(Refused, match="bond forces are for bars"):
        wsph.compose(scenes.block(2, 4, run={"formulation": "bond-force"}))
    with pytest.raises(Refused, match="hourglass is a part of .*, not of 'bond-force'"):
        wsph.compose(scenes.block(2, 4, run={"formulation": "bond-force"}, hourglass={"coefficient": 0.1}))


def test_nothing_else_knows_it() -> None:
    assert not knowing("bond-force")
    FORMULATIONS.remove(BOND_FORCE)
    with pytest.raises(SceneError, match="run.formulation: 'bond-force' is none of 'small-strain'"):
        bar(4)
    FORMULATIONS.append(BOND_FORCE)
