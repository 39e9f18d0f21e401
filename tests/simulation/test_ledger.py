"""The ledger: still at rest, without an entry of the wrong sign, closed to the order of the method where bodies fall, turn
and bounce."""

import warnings
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes

ENTRIES = ("kinetic", "strain", "dissipated", "hourglass", "contact")
OF_CONTACT = ("contact_stored", "contact_dissipated", "contact_numerical")
FORMS = ("stress-points", "total-lagrangian", "updated-lagrangian")
GRAVITY, STEPS = {"y": -1e-4}, 10_000


def entries(scene: wsph.Scene) -> dict[str, np.ndarray]:
    """Every entry, with the work, from record to record."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*with pairs of a kernel stress is 20")
        result = wsph.run(scene)
    assert result.status == "completed"
    there = [name for name in OF_CONTACT if name in result.history]
    return {name: result.history[name] for name in ("step", *ENTRIES, *there, "external_work", "residual")}


def still(found: dict[str, np.ndarray], names: tuple[str, ...] = (*ENTRIES, "external_work", "residual")) -> None:
    """Assert that no entry moves in the last steps, and that none ever has the wrong sign."""
    largest = max(np.abs(found[name][-1]) for name in (*ENTRIES, "external_work"))
    last = found["step"] >= found["step"][-1] - STEPS
    assert last.sum() > 2
    assert found["step"][-1] > STEPS
    for name in names:
        assert np.ptp(found[name][last]) <= 1e-6 * largest, name
    signs(found)


def signs(found: dict[str, np.ndarray]) -> None:
    """Contact counts what it makes of nothing, too, which may be less than nothing."""
    names = [name for name in (*ENTRIES, *OF_CONTACT[:2]) if name in found and name != "contact"]
    for name in names:
        assert found[name].min() >= 0.0, name
    whole = sum(found[name] for name in OF_CONTACT if name in found)
    assert found["contact"] == pytest.approx(whole, rel=1e-12, abs=1e-12 * found["kinetic"].max())


def floor_and_block(form: str, damped: bool, gap: float, **keys: Any) -> list[dict[str, Any]]:
    """A held floor of three rows and a block of three by four cells above it."""
    damping = {"damping": {"rate": 1.0}} if damped else {}
    floor = scenes.body(scenes.box((-1.0, 3.0), (-1.5, 0.0)), 0.5, "floor")
    return [floor, scenes.body(scenes.box(2.0, (gap, gap + 1.5)), 0.5, **damping, **keys)]


METHODS = [("leapfrog", form) for form in FORMS] + [("rk4", "total-lagrangian")]


@pytest.mark.parametrize(("integrator", "form"), METHODS)
def test_a_damped_body_at_rest_on_another_has_a_ledger_that_stands_still(integrator: str, form: str) -> None:
    bodies = floor_and_block(form, True, 0.0)
    run = {"integrator": integrator, "formulation": form, "end": 3300.0, "cfl": 0.35}
    ground = [{"body": "floor", "where": "y < 9", "fixed": ["x", "y"]}]
    made = scenes.scene(*bodies, run=run, gravity=GRAVITY, boundary=ground, contact=[{"between": ["floor", "b"]}],
                        output={"history": 500})  # fmt: skip
    still(entries(made))


@pytest.mark.parametrize(("integrator", "form"), METHODS)
def test_a_damped_body_that_hangs_has_a_ledger_that_stands_still(integrator: str, form: str) -> None:
    body = scenes.body(scenes.box(2.0, 1.5), 0.5, damping={"rate": 1.0})
    run = {"integrator": integrator, "formulation": form, "end": 3300.0, "cfl": 0.35}
    made = scenes.scene(body, run=run, gravity=GRAVITY, boundary=[scenes.held("-y", 2)], output={"history": 500})
    still(entries(made))


@pytest.mark.parametrize("integrator", ["tsph", "ul-tsph"])
def test_what_gravity_and_damping_do_on_two_sets_stands_still_at_rest(integrator: str) -> None:
    """They act on what the virtual particles see; the real ones keep a motion beside it, which is not damped."""
    body = scenes.body(scenes.box(2.0, 1.5), 0.25, damping={"rate": 1.0})
    run = {"integrator": integrator, "end": 900.0, "cfl": 0.35}
    made = scenes.scene(body, run=run, gravity=GRAVITY, boundary=[scenes.held("-y", 2)], output={"history": 500})
    found = entries(made)
    still(found, ("dissipated",))
    assert abs(found["residual"][-1]) < 0.02 * found["external_work"][-1]


def test_two_damped_blocks_settle_on_each_other() -> None:
    keys = {"material": scenes.material(density=1000.0, youngs_modulus=1e7), "damping": {"rate": 20.0}}
    floor = scenes.body(scenes.box((-0.2, 0.6), (-0.1, 0.0)), 0.05, "f", material=keys["material"])
    one = scenes.body(scenes.box(0.4, (0.0, 0.2)), 0.05, "a", **keys)
    other = scenes.body(scenes.box(0.4, (0.2, 0.4)), 0.05, "b", **keys)
    run = {"formulation": "stress-points", "end": 1.5, "cfl": 0.3}
    found = entries(
        scenes.scene(floor, one, other, run=run, gravity={"y": -10.0}, boundary=[scenes.held("-y", 2, "f")],
                     contact=[{"between": ["f", "a"]}, {"between": ["a", "b"]}], output={"history": 100})
    )  # fmt: skip
    settled = found["step"] > 0.6 * found["step"][-1]
    # The floor itself is not damped: what is left in it goes into the blocks.
    assert np.ptp(found["dissipated"][settled]) < 5e-4 * found["dissipated"][-1]
    assert abs(found["residual"][-1]) < 1.5e-3 * found["external_work"].max()
    signs(found)


@pytest.mark.parametrize("form", FORMS)
def test_a_fall_and_a_bounce_close_to_the_order_of_the_method(form: str) -> None:
    """A block falls on a held floor and bounces: the residual is of second order, and all that contact stored comes back."""
    left = []
    for cfl in (0.3, 0.15):
        bodies = floor_and_block(form, False, 1.0, velocity=[0.0, -0.02])
        ground = [{"body": "floor", "where": "y < 9", "fixed": ["x", "y"]}]
        made = scenes.scene(*bodies, run={"formulation": form, "end": 60.0, "cfl": cfl}, gravity=GRAVITY, boundary=ground,
                            contact=[{"between": ["floor", "b"], "stiffness": 1.0}], output={"history": 1})  # fmt: skip
        found = entries(made)
        signs(found)
        assert found["contact_stored"].max() > 0.05 * found["kinetic"].max()
        assert found["contact_stored"][-1] == 0.0
        # Corners of three cells that open and close inside of steps.
        assert np.abs(found["contact_numerical"]).max() < 0.04 * found["kinetic"].max()
        left.append(np.abs(found["residual"]).max() / found["kinetic"].max())
    assert left[0] < 1e-2
    assert left[1] < 0.4 * left[0]


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4", "lf4", "blanes-moan4"])
def test_the_work_of_gravity_is_that_of_its_potential(integrator: str) -> None:
    """A free fall: m g (g t^2/2) to rounding, whatever the method."""
    made = scenes.scene(
        scenes.body(scenes.box(1.0, 1.0), 0.25), run={"integrator": integrator, "end": 10.0}, gravity={"y": -0.1}
    )
    result = wsph.run(made)
    fallen = 0.05 * result.time**2
    assert result.summary["energy"]["external_work"] == pytest.approx(0.1 * fallen, rel=1e-12)
    assert result.summary["energy"]["kinetic"] == pytest.approx(0.1 * fallen, rel=1e-12)


def shaken(form: str, integrator: str, part: float, **run: Any) -> wsph.Scene:
    """A free block whose velocities differ from particle to particle, at a part of the limit of its step."""
    made = scenes.body(scenes.box(0.6, 0.7), 0.1, velocity=[f"1e-4*sin(997.1*x+{k}+1313.7*y)" for k in (0, 1)])
    keys = {"integrator": integrator, "formulation": form, "end": 1000.0}
    limit = wsph.compose(scenes.scene(made, run=keys | {"cfl": 0.1})).bodies[0].limit
    return scenes.scene(made, run=keys | {"cfl": part * (limit or 0.0), **run}, output={"history": 100})


@pytest.mark.parametrize("form", FORMS)
def test_energy_that_swings_stops_no_run(form: str) -> None:
    """Leapfrog near its limit: the energy of the fastest modes is off by as much as they are resolved too coarsely, and
    stays bounded."""
    with pytest.warns(RuntimeWarning, match="energy swings and does not grow"):
        found = wsph.run(shaken(form, "leapfrog", 0.999)).history
    assert found["step"][-1] > 5000
    total = sum(found[name] for name in ENTRIES) / found["external_work"][0]
    first, last = np.split(total[1:], [len(total) // 2])
    assert 1.1 < total.max() < 2.0
    assert last.max() < 1.2 * first.max()


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_what_lf4_seems_to_lose_near_its_limit_is_no_dissipation(form: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wsph.run(shaken(form, "lf4", 0.999, end=400.0))
    assert not any("dissipation" in str(each.message) for each in caught)


@pytest.mark.filterwarnings("ignore:.*energy was created", "ignore:.*stability limit")
@pytest.mark.parametrize("form", FORMS)
def test_energy_that_grows_stops_a_run_at_once(form: str) -> None:
    """A hundredth beyond the limit: as soon as a tenth has been created, whatever leapfrog's own oscillation is."""
    with pytest.raises(wsph.Unstable, match="energy was created: .* beyond stop.energy = 0.1") as caught:
        wsph.run(shaken(form, "leapfrog", 1.01, guard="off"))
    assert caught.value.step < 300


@pytest.mark.parametrize("form", FORMS)
def test_the_ledger_of_an_undamped_body_does_not_drift(form: str) -> None:
    """A block swings under its weight for ten thousand steps: nothing is dissipated, and the residual stays where it is."""
    body = scenes.body(scenes.box(2.0, 1.5), 0.5)
    run = {"formulation": form, "end": 1600.0, "cfl": 0.35}
    found = entries(
        scenes.scene(body, run=run, gravity=GRAVITY, boundary=[scenes.held("-y", 2)], output={"history": 10})
    )
    assert found["step"][-1] > STEPS
    assert not found["dissipated"].any()
    first, last = np.split(np.abs(found["residual"]) / found["external_work"].max(), [len(found["step"]) // 2])
    assert last.max() < 1.1 * first.max() < 1e-2
    signs(found)
