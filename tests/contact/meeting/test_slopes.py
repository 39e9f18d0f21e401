"""Blocks on slopes: what slides does so with g (sin a - mu cos a), what sticks stays, and neither hums.

Coulomb friction that follows the normal force at once is ill-posed between elastic bodies: undamped, or without a memory,
blocks hop down slopes that should hold them.
"""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes

TAN30 = float(np.tan(np.radians(30.0)))


def slope(friction: float, degrees: float = 30.0, spacing: float = 0.01, form: str = "stress-points", end: float = 0.15,
          cfl: float = 0.25, **keys: Any) -> wsph.Scene:  # fmt: skip
    """A flat block, 10 cm by 2 cm, on a held floor of cells of 1 cm, which gravity of 10 m/s2 is turned against."""
    rubber = scenes.material(density=1000.0, youngs_modulus=10e6)
    floor = scenes.body(scenes.box((0.0, 0.5), (-0.04, 0.0)), 0.01, "floor", material=rubber)
    block = scenes.body(scenes.box((0.1, 0.2), (0.0, 0.02)), spacing, "block", material=rubber, **keys)
    angle = np.radians(degrees)
    gravity = {"x": 10.0 * np.sin(angle), "y": -10.0 * np.cos(angle)}
    probe = {"name": "block", "body": "block", "where": "y > 0", "reduce": "mean", "every": "1 ms"}
    return scenes.scene(
        floor, block, run={"formulation": form, "end": end, "cfl": cfl}, gravity=gravity,
        boundary=[{"body": "floor", "where": "x > -1", "fixed": ["x", "y"]}],
        contact=[{"between": ["floor", "block"], "friction": friction}],
        probes=[probe | {"fields": ["velocity_x", "velocity_y"]}],
    )  # fmt: skip


def accelerations(run: Any) -> tuple[float, float, float]:
    """Along the slope over the later half, how fast it goes up and down there, and how fast along it at the end."""
    probe = run.probes["block"]
    late = probe["time"] > 0.5 * probe["time"][-1]
    along = np.polyfit(probe["time"][late], probe["velocity_x"][late], 1)[0]
    return float(along), float(probe["velocity_y"][late].std()), float(probe["velocity_x"][-1])


def slow(*values: Any) -> Any:
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("friction", "degrees", "changes"),
    [
        (0.0, 30.0, {}),
        (0.5, 30.0, {"spacing": 0.005}),
        slow(0.2, 30.0, {}),
        slow(0.5, 30.0, {}),
        slow(0.57, 30.0, {"spacing": 0.005}),
        slow(0.5, 30.0, {"spacing": 0.005, "form": "total-lagrangian"}),
        slow(0.5, 30.0, {"lattice_rotate": 17.0, "cfl": 0.05}),
        slow(0.8, 40.0, {"spacing": 0.005, "cfl": 0.15}),
    ],
)
def test_what_slides_does_as_coulomb_says(friction: float, degrees: float, changes: dict[str, Any]) -> None:
    run = wsph.run(slope(friction, degrees, **changes))
    along, humming, _ = accelerations(run)
    right = 10.0 * (np.sin(np.radians(degrees)) - friction * np.cos(np.radians(degrees)))
    assert along == pytest.approx(right, rel=2e-3, abs=2e-3)
    assert humming < (1e-3 if friction == 0.0 else 2e-4)
    history = run.history
    assert abs(history["contact_numerical"][-1]) < 1e-4 * history["external_work"][-1]


@pytest.mark.parametrize(("friction", "cfl"), [(0.8, 0.15), slow(0.58, 0.25)])
def test_what_sticks_stays(friction: float, cfl: float) -> None:
    """Above tan 30 degrees = .577."""
    assert friction > TAN30
    along, _, left = accelerations(wsph.run(slope(friction, cfl=cfl)))
    assert abs(left) < 1e-4
    assert abs(along) < 1e-2


def test_heat_is_the_work_of_friction() -> None:
    """mu N times the way, where the block slides all the time."""
    run = wsph.run(slope(0.2, end=0.1))
    weight = 1000.0 * 0.1 * 0.02 * 10.0
    probe = run.probes["block"]
    time, speed = probe["time"], probe["velocity_x"]
    way = float((0.5 * (speed[1:] + speed[:-1]) * np.diff(time)).sum())
    heat = 0.2 * weight * np.cos(np.radians(30.0)) * way
    assert run.history["contact_dissipated"][-1] == pytest.approx(heat, rel=5e-3)
