"""A load that follows the state is one file, `spring.py`, and one line of `wsph.boundary.loads.table.LOADS`."""

from collections.abc import Iterator

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.extensions.spring import Spring
from wsph.boundary.tables import add_load, remove_load
from wsph.errors import SceneError
from wsph.scene.scene import Scene
from wsph.scene.tables import SceneTables

KAPPA = 0.8
"""Of the first mode, whose stiffness of the spring follows: k/E = kappa tan kappa."""


@pytest.fixture(autouse=True)
def known() -> Iterator[None]:
    """The line of the table."""
    add_load(Spring, SceneTables, Scene)
    yield
    remove_load(Spring, SceneTables, Scene)


def bar(cells: int = 40, stiffness: float = KAPPA * np.tan(KAPPA), **run: object) -> wsph.Scene:
    """A bar of length, wave speed and density 1 on a spring at x = 0, started in its first mode."""
    body = scenes.body(
        scenes.box(1.0),
        1.0 / cells,
        velocity=[f"1e-4*cos({KAPPA}*(1 - x))"],
        material=scenes.material(poisson_ratio=0.0),
    )
    held = [{"body": body["name"], "face": "-x", "foundation": {"stiffness": stiffness}}]
    keys = {"integrator": "leapfrog", "end": 2.0 * np.pi / KAPPA, "cfl": 0.5}
    return scenes.scene(body, run={**keys, **run}, boundary=held, output={"history": 1})


def test_a_bar_on_a_spring_has_the_frequency_of_its_closed_form() -> None:
    """u = cos(kappa (1 - x)), kappa tan kappa = k/E, omega = kappa c: after a period it is as at the start, and
    a spacing half as long brings it closer."""
    errors = []
    for cells in (10, 20):
        result = wsph.run(bar(cells))
        x, v = result.particles["position"][:, 0], result.particles["velocity"][:, 0]
        exact = 1e-4 * np.cos(KAPPA * (1.0 - x)) * np.cos(KAPPA * result.time)
        errors.append(np.abs(v - exact).max() / 1e-4)
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] > 2.5


@pytest.mark.parametrize("turned", [0.0, 30.0])
@pytest.mark.parametrize("formulation", ["total-lagrangian", "stress-points", "updated-lagrangian"])
def test_a_block_on_soft_springs_swings_as_a_rigid_body(formulation: str, turned: float) -> None:
    """In plane stress, on springs along its lower face: omega^2 = k/(rho L), to the order of k L/E = 0.001. After a quarter
    of a period it is still, however the body is turned."""
    stiffness, up = 1e-3, np.array([-np.sin(np.radians(turned)), np.cos(np.radians(turned))])
    body = scenes.body({**scenes.box(1.0, 1.0), "rotate": turned}, 1.0 / 8.0, state="stress", velocity=list(1e-6 * up))
    held = [{"body": body["name"], "face": "-y", "foundation": {"stiffness": stiffness}}]
    run = {"integrator": "rk4", "formulation": formulation, "end": 0.5 * np.pi / np.sqrt(stiffness), "cfl": 0.4}
    result = wsph.run(scenes.scene(body, run=run, boundary=held, output={"history": 1}))
    velocity = result.particles["velocity"] @ up
    assert abs(velocity.mean()) < 1e-3 * 1e-6
    assert np.abs(result.history["residual"]).max() < 1e-8 * result.history["kinetic"][0]


def test_its_energy_is_on_the_ledger() -> None:
    result = wsph.run(bar(end=0.5 * np.pi / KAPPA))
    assert result.history["strain"].max() > 0.9 * result.history["kinetic"][0]
    assert np.abs(result.history["residual"]).max() < 1e-3 * result.history["kinetic"][0]


def test_a_stiff_one_lowers_the_limit_of_the_time_step() -> None:
    limits = [wsph.compose(bar(stiffness=k, cfl=0.04)).bodies[0].limit for k in (1.0, 4e4)]
    assert limits[1] < 0.5 * limits[0]
    with pytest.raises(wsph.Refused, match="is beyond its stability limit"):
        wsph.compose(bar(stiffness=4e4, cfl=1.02 * limits[1]))


def test_two_sets_are_refused_by_name() -> None:
    with pytest.raises(SceneError, match="boundary.0.foundation: two-set bodies prescribe stress"):
        wsph.compose(bar(integrator="tsph"))


def test_without_its_line_nothing_knows_it() -> None:
    remove_load(Spring, SceneTables, Scene)
    with pytest.raises(SceneError, match="unknown key"):
        bar()
    add_load(Spring, SceneTables, Scene)
