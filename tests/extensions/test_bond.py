"""Forces between bodies are one file, `bond.py`, and one line of `wsph.contact.table.COUPLINGS`: they are right under every
integrator, whose order they keep."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.extensions.bond import bond
from wsph.contact.table import COUPLINGS
from wsph.errors import Refused
from wsph.simulation.compose import compose

SOFT = scenes.material(poisson_ratio=0.0)


@pytest.fixture(autouse=True)
def spring(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    line = partial(bond, stiffness=0.5)
    COUPLINGS.append(line)
    yield
    COUPLINGS.remove(line)


def bars(integrator: str, cfl: float | str, form: str = "stress-points", **tables: Any) -> wsph.Scene:
    """Two bars of unlike spacing, one behind the other with a spring between them; the first moves on."""
    shape = {"state": "stress", "material": SOFT}
    one = scenes.body(scenes.box((0.0, 1.0)), 0.1, "a", velocity=["1e-3*sin(pi*x)^4"], **shape)
    two = scenes.body(scenes.box((1.5, 2.5)), 0.125, "b", velocity=[0.0], **shape)
    run = {"integrator": integrator, "cfl": cfl, "end": 4.0, "formulation": form}
    return scenes.scene(one, two, run=run, **{"output": {"history": 1}, **tables})


def motion(*args: Any, **keys: Any) -> np.ndarray:
    result = wsph.run(bars(*args, **keys))
    assert result.status == "completed"
    assert np.ptp(result.history["momentum_x"]) < 1e-15
    return result.field("velocity_x")


@pytest.fixture(scope="module")
def converged() -> np.ndarray:
    line = partial(bond, stiffness=0.5)
    COUPLINGS.append(line)
    result = wsph.run(bars("rk4", 0.01))
    COUPLINGS.remove(line)
    return result.field("velocity_x")


@pytest.mark.filterwarnings("ignore:.*energy was")
@pytest.mark.parametrize(
    ("integrator", "order"), [("leapfrog", 2), ("rk4", 4), ("blanes-moan4", 4), ("rk2", 2), ("euler", 1)]
)
def test_every_method_keeps_its_order(integrator: str, order: int, converged: np.ndarray) -> None:
    steps = (0.4, 0.2) if order > 1 else (0.01, 0.005)
    tables = {"stop": {"energy": 1e9}}
    guard = {"run.guard": "off"} if integrator in ("euler", "rk2") else {}
    found = []
    for cfl in steps:
        scene = bars(integrator, cfl, **tables)
        result = wsph.run(scene.with_(**guard) if guard else scene)
        assert np.ptp(result.history["momentum_x"]) < 1e-14
        found.append(float(np.abs(result.field("velocity_x") - converged).max()))
    assert np.log2(found[0] / found[1]) > order - 0.3


@pytest.mark.parametrize("form", ["total-lagrangian", "updated-lagrangian"])
def test_energy_is_kept_and_momentum_to_rounding(form: str) -> None:
    result = wsph.run(bars("leapfrog", 0.25, form))
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    assert np.ptp(result.history["momentum_x"]) < 1e-15
    assert np.abs(result.field("velocity_x")[result.field("body") == 1]).max() > 1e-4


def test_the_limit_of_both_bodies_counts_what_is_between_them() -> None:
    composition = compose(bars("leapfrog", "auto"))
    one, two = (run.limit for run in composition.bodies)
    assert composition.bodies[0].integrator is composition.bodies[1].integrator
    # The same step, in the Courant numbers of two spacings.
    assert one is not None
    assert two == pytest.approx(0.8 * one)
    assert composition.bodies[0].courant == pytest.approx(0.7 * one)
    with pytest.raises(Refused, match="what acts between bodies"):
        compose(bars("leapfrog", 1.01 * one))


def test_what_cannot_be_coupled_is_refused() -> None:
    with pytest.raises(Refused, match="use an integrator of one set, such as leapfrog, not the two sets of tsph"):
        compose(bars("tsph", 0.5, "small-strain"))
    with pytest.raises(Refused, match="lf4 keeps variables of its own"):
        compose(bars("lf4", 0.2))
