"""Periodic faces: a strip that closes on itself carries waves round, and does not know where its seam is."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import body, box, held, material, scene
from wsph.simulation.compose import compose

NU = 0.25
SPEEDS = {"P": float(np.sqrt((1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)))), "S": float(np.sqrt(0.5 / (1.0 + NU)))}
CELLS = 60


def seams(dim: int) -> list[dict[str, Any]]:
    """Entries by which all faces of a block are periodic."""
    return [{"body": "b", "face": f"+{axis}", "periodic": f"-{axis}"} for axis in "xyz"[:dim]]


def strip(wave: str, dim: int, form: dict[str, Any], place: float = 0.5, **keys: Any) -> wsph.Scene:
    """A strip of four cells' width, periodic in every direction, with a smooth pulse at a `place` of it, for as long as its
    halves take to come round."""
    velocity: list[float | str] = [0.0] * dim
    velocity["PS".index(wave)] = f"1e-4*exp(3*(cos(2*pi*(x/{CELLS} - {place})) - 1))"
    shape = box(float(CELLS), *[4.0] * (dim - 1))
    state = {"state": "strain"} if dim < 3 else {}
    made = body(shape, 1.0, velocity=velocity, material=material(poisson_ratio=NU), **state, **keys)
    run = {"end": CELLS / SPEEDS[wave], "cfl": 0.3, **form}
    return scene(made, run=run, boundary=seams(dim))


def along(result: Any, component: int) -> np.ndarray:
    """A component of the velocity at the CELLS nodes along the strip, which is the same across it."""
    position, velocity = result.particles["position"], result.particles["velocity"][:, component]
    column = np.rint(position[:, 0]).astype(int)
    order = np.argsort(column, kind="stable")
    columns = np.split(velocity[order], np.cumsum(np.bincount(column))[:-1])
    assert max(np.ptp(each) for each in columns) < 1e-9 * 1e-4
    values = np.array([each.mean() for each in columns])
    assert values[0] == values[-1]
    return values[:-1]


CASES = [("P", 1), ("P", 2), ("S", 2), ("P", 3)]


@pytest.mark.parametrize(("wave", "dim"), CASES)
@pytest.mark.parametrize(("form", "apart", "lost"), [
    ({"formulation": "stress-points"}, 1e-12, 2e-2), ({"formulation": "total-lagrangian"}, 4e-3, 0.13),
    ({"formulation": "stress-points", "integrator": "rk4"}, 1e-12, 2e-2),
], ids=str)  # fmt: skip
def test_a_strip_carries_a_wave_round_and_does_not_know_its_seam(
    form: dict[str, Any], apart: float, lost: float, wave: str, dim: int
) -> None:
    """Both halves of the pulse have met again: it is where and what it was, but for the dispersion of the lattice; and a
    pulse that begins elsewhere, which has crossed the seam at another time, is the same but shifted: to rounding where cells
    see their own corners alone. Along edges a particle at the seam takes gradients of either side by itself."""
    component = "PS".index(wave)
    found = [along(wsph.run(strip(wave, dim, form, place)), component) for place in (0.5, 0.25)]
    assert found[0].argmax() == CELLS // 2
    assert found[0].max() == pytest.approx(1e-4, rel=lost)
    assert np.roll(found[0], -CELLS // 4) == pytest.approx(found[1], abs=apart * 1e-4)


def test_energy_and_momentum_are_kept() -> None:
    history = wsph.run(strip("P", 2, {"formulation": "stress-points", "cfl": 0.05})).history
    assert np.abs(history["residual"]).max() < 1e-4 * history["kinetic"][0]
    assert np.ptp(history["momentum_x"]) < 1e-13 * history["momentum_x"][0]


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_a_seam_takes_no_time_step(form: str) -> None:
    """What is one particle has the mass of both: the limit is not below that of the body without."""
    whole = strip("P", 2, {"formulation": form})
    open_ = wsph.Scene(**{**whole.data(), "boundary": []})
    limits = [float(compose(each).bodies[0].limit or 0.0) for each in (whole, open_)]
    assert limits[1] * 0.99 < limits[0] < limits[1] * 1.2


@pytest.mark.parametrize("extra", [{"viscosity": {"alpha": 0.5}}, {"material": material("jaumann")}, {"material": material("mises", yield_stress=2e-5)}], ids=str)  # fmt: skip
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_a_block_that_is_sheared_for_ever_is_uniform(form: str, extra: dict[str, Any]) -> None:
    """A shear flow between two plates, periodic along them: nothing depends on x."""
    block = body(box(8.0, 8.0), 1.0, velocity=["1e-4*y/8", 0.0], **extra)
    entries = [seams(1)[0], held("-y", 2), {"body": "b", "face": "+y", "velocity": {"x": 1e-4, "y": 0.0}}]
    result = wsph.run(scene(block, run={"end": 8.0, "formulation": form}, boundary=entries))
    position, velocity = result.particles["position"], result.particles["velocity"]
    for row in range(9):
        at = np.rint(position[:, 1]) == row
        assert np.ptp(velocity[at], axis=0).max() < 1e-8 * 1e-4


def test_seams_that_meet_join_four() -> None:
    made = compose(strip("P", 2, {}))
    system = made.bodies[0].system
    for _ in range(10):
        made.program.step()
    at = system.position
    corners = np.isin(at[:, 0], (0.0, float(CELLS))) & np.isin(at[:, 1], (0.0, 4.0))
    velocity = system.state.read("velocity")[corners]
    assert len(velocity) == 4
    assert np.ptp(velocity, axis=0).max() == 0.0


@pytest.mark.parametrize(
    ("entries", "keys", "message"),
    [
        ([{"face": "+x", "periodic": "+x"}], {}, "boundary.0.periodic: a face is not its own partner"),
        ([{"face": "+x", "periodic": "-y"}], {}, "boundary.0.periodic: the particles of '-y' do not stand opposite"),
        ([{"face": "+x", "periodic": "-x"}], {"jitter": 0.2}, "boundary.0.periodic: .*jitter moves their particles"),
        ([{"face": "+x", "periodic": "-x", "fixed": ["x"]}], {}, "periodic goes with face alone"),
        ([{"where": "x > 7.9", "periodic": "-x"}], {}, "periodic goes with face alone"),
        ([{"face": "+x", "periodic": "-x"}, {"face": "-x", "fixed": ["x"]}], {}, "boundary.0.periodic: the velocity x is prescribed"),
        ([{"face": "+x", "periodic": "-x"}, {"face": "-y", "velocity": {"x": "x"}}], {}, "not alike at the other"),
        ([{"face": "+x", "periodic": "-x"}, {"where": "y < 0.1 and x < 4", "normal": 0.0}], {}, "along normals is prescribed at one side"),
        ([{"face": "+x", "periodic": "-x"}], {"run": {"support": 1.6}}, "boundary.0.periodic: body 'b' has pairs of a kernel"),
        ([{"face": "+x", "periodic": "-x"}], {"run": {"formulation": "updated-lagrangian"}}, "needs particles on the faces"),
        ([{"face": "+x", "periodic": "-x"}], {"run": {"formulation": "updated-lagrangian"}, "placement": "nodes"}, "has pairs of a kernel"),
        ([{"face": "+x", "periodic": "-x"}], {"run": {"integrator": "tsph"}}, "two-set bodies have no periodic faces"),
        ([{"face": "+x", "periodic": "-x"}], {"phase_field": {"fracture_energy": 1.0, "length": 2.5}}, "can break"),
    ],
)  # fmt: skip
def test_what_cannot_be_periodic_is_refused_by_name(
    entries: list[dict[str, Any]], keys: dict[str, Any], message: str
) -> None:
    run = keys.pop("run", {}) if "run" in keys else {}
    block = body(box(8.0, 8.0), 1.0, **keys)
    with pytest.raises(wsph.SceneError, match=message):
        compose(scene(block, run=run, boundary=[{"body": "b", **each} for each in entries]))


def test_contact_does_not_see_through_a_seam() -> None:
    blocks = [body(box((low, low + 1.0), (0.0, 1.0)), 0.25, name) for low, name in ((0.0, "b"), (2.0, "c"))]
    with pytest.raises(wsph.SceneError, match="boundary.0.periodic: body 'b' is in contact"):
        compose(scene(*blocks, boundary=[seams(2)[1]], contact=[{"between": ["b", "c"]}]))
