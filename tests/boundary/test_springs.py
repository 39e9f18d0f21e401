"""Springs and dashpots to the ground against closed forms: in every form, along every direction, on the ledger and in the
limit of the time step."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import bar, body, box, material, scene
from wsph.simulation.compose import compose

FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"}, {"formulation": "total-lagrangian"},
    {"formulation": "total-lagrangian", "support": 2.6}, {"formulation": "updated-lagrangian"},
]  # fmt: skip
STIFFNESS, RATIO = 1e-4, 0.2
OMEGA = np.sqrt(STIFFNESS)
"""Of a block of unit mass per area on the spring, which it does not feel the elasticity of."""
SPEED = 1e-6


def block(spring: dict[str, Any], way: list[float], *, rotate: float = 0.0, **run: Any) -> wsph.Scene:
    """A block of 1 by 1 on springs along its lower side, flying along `way` at the start, about a period long."""
    shape = {**box((-0.5, 0.5), (-0.5, 0.5)), "rotate": rotate}
    made = body(shape, 0.25, state="stress", velocity=[SPEED * each for each in way])
    keys = {"end": 2.0 / OMEGA, "cfl": 0.25, **run}
    sprung = [{"body": "b", "face": "-y", "spring": spring}]
    return scene(made, run=keys, boundary=sprung, output={"fields": ["displacement", "velocity"]})


def swung(time: float, omega: float = OMEGA, ratio: float = RATIO) -> tuple[float, float]:
    """Displacement and velocity of a mass on a spring and a dashpot that begins at SPEED."""
    damped = omega * np.sqrt(1.0 - ratio**2)
    fallen = np.exp(-ratio * omega * time) * SPEED
    turn = damped * time
    return fallen * np.sin(turn) / damped, fallen * (np.cos(turn) - ratio * omega / damped * np.sin(turn))


@pytest.mark.parametrize("form", FORMS, ids=str)
@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
def test_a_mass_on_a_spring_and_a_dashpot(form: dict[str, Any], integrator: str) -> None:
    spring = {"stiffness": STIFFNESS, "damping": 2.0 * RATIO * OMEGA}
    result = wsph.run(block(spring, [0.0, 1.0], integrator=integrator, **form))
    displacement, velocity = swung(float(result.history["time"][-1]))
    # A block of finite stiffness is softer than its springs by k L/E = 1e-4.
    assert result.particles["displacement"][:, 1].mean() == pytest.approx(displacement, rel=1e-2)
    assert result.particles["velocity"][:, 1].mean() == pytest.approx(velocity, rel=1e-2)
    history = result.history
    lost = history["kinetic"][0] * (1.0 - (velocity**2 + STIFFNESS * displacement**2) / SPEED**2)
    assert history["dissipated"][-1] == pytest.approx(lost, rel=1e-2)
    assert np.abs(history["residual"]).max() < 1e-4 * history["kinetic"][0]


DIRECTED: list[tuple[dict[str, Any], list[float], float, float]] = [
    ({"stiffness": {"normal": STIFFNESS, "tangential": 4.0 * STIFFNESS}}, [0.0, 1.0], 0.0, 1.0),
    ({"stiffness": {"normal": STIFFNESS}, "damping": {"normal": 2.0 * RATIO * OMEGA}}, [0.0, 1.0], 30.0, 1.0),
    ({"stiffness": {"y": STIFFNESS, "x": 9.0}, "damping": {"y": 2.0 * RATIO * OMEGA}}, [0.0, 1.0], 0.0, 1.0),
    ({"stiffness": {"normal": 1.0}}, [1.0, 0.0], 0.0, 0.0),
    ({"stiffness": {"normal": 1.0}, "damping": {"normal": 1.0}}, [1.0, 0.0], 30.0, 0.0),
    ({"stiffness": {"y": 1.0}}, [1.0, 0.0], 0.0, 0.0),
]


@pytest.mark.parametrize(("spring", "way", "rotate", "held"), DIRECTED, ids=str)
def test_springs_and_dashpots_have_directions(
    spring: dict[str, Any], way: list[float], rotate: float, held: float
) -> None:
    """Along what they hold the block swings, along what they leave free it goes on as it flew."""
    c, s = np.cos(np.radians(rotate)), np.sin(np.radians(rotate))
    along = np.array([[c, -s], [s, c]]) @ way
    # A block on one side alone turns where what holds it does not pass through its middle.
    result = wsph.run(block(spring, along.tolist(), rotate=rotate))
    time = float(result.history["time"][-1])
    ratio = RATIO if "damping" in spring else 0.0
    exact = swung(time, OMEGA, ratio)[0] if held else SPEED * time
    assert (result.particles["displacement"] @ along).mean() == pytest.approx(exact, rel=1e-2)


def test_a_dashpot_lowers_the_limit_of_the_time_step() -> None:
    """Of a bar's end, of half a cell's mass, c/(m/2) adds to the damping: at 0.98 of the limit nothing grows."""

    def damped(damping: float, **run: Any) -> wsph.Scene:
        end = {"body": "b", "face": "-x", "spring": {"damping": damping}}
        return bar(20, velocity=["1e-4*sin(7*pi*x)"], run={"guard": "off", **run}, tables={"boundary": [end]})

    limits = [float(compose(damped(c)).bodies[0].limit or 0.0) for c in (0.01, 1.0, 10.0)]
    assert limits[0] > limits[1] > 3.0 * limits[2]
    for damping, limit in zip((1.0, 10.0), limits[1:], strict=True):
        result = wsph.run(damped(damping, cfl=limit, end=20.0))
        assert result.history["kinetic"][-1] < 1.001 * result.history["kinetic"][0]
    with pytest.raises(wsph.Refused, match="is beyond its stability limit"):
        compose(damped(10.0, guard="refuse", cfl=1.02 * limits[2]))
    with pytest.raises(wsph.SceneError, match="blanes-moan4: a splitting of force and motion takes no damping"):
        compose(damped(1.0, integrator="blanes-moan4"))


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4", "kg4-8"])
@pytest.mark.parametrize("viscosity", [None, {"alpha": 1.0}])
def test_what_a_dashpot_takes_is_dissipated(integrator: str, viscosity: dict[str, Any] | None) -> None:
    """Near the limit of the step, beside viscosity and without."""
    keys = {} if viscosity is None else {"viscosity": viscosity}
    end = {"body": "b", "face": "-x", "spring": {"damping": 3.0}}
    given = bar(
        20,
        velocity=["1e-4*sin(2*pi*x)"],
        run={"integrator": integrator, "cfl": "auto", "end": 1.0},
        tables={"boundary": [end], "output": {"history": 1}},
        **keys,
    )
    history = wsph.run(given).history
    assert history["dissipated"][-1] > 0.1 * history["kinetic"][0]
    assert np.abs(history["residual"]).max() < 2e-2 * history["kinetic"][0]
    assert abs(history["residual"][-1]) < 5e-3 * history["kinetic"][0]


def test_a_beam_on_springs_is_winkler_s() -> None:
    """Hetenyi 1946: P/2 at the end of half an infinite beam that does not turn there, w = P b/(2 k) exp(-b x) (cos b x +
    sin b x), b = (k/(4 E I))^(1/4); shear adds b^2 E I/(kappa G A) = 0.3 % at the load."""
    height, b, load = 1.0, 0.1, 1e-9
    stiffness = 4.0 * b**4 * height**3 / 12.0
    rate = 2.0 * np.sqrt(stiffness / height)
    beam = body(
        box((0.0, 60.0), (0.0, height)),
        [0.5, 0.25],
        state="stress",
        material=material(poisson_ratio=0.0),
        damping={"rate": rate},
    )
    entries = [
        {"body": "b", "face": "-x", "symmetry": "x", "traction": {"y": -load / 2.0 / height}},
        {"body": "b", "face": "-y", "spring": {"stiffness": {"normal": stiffness}}},
    ]
    run = {"end": 20.0 / rate, "cfl": 0.6}
    result = wsph.run(scene(beam, run=run, boundary=entries, output={"fields": ["displacement"]}))
    x, y = result.particles["position"].T[:2]
    middle = np.isclose(y, 0.5)
    exact = load * b / (2.0 * stiffness) * np.exp(-b * x) * (np.cos(b * x) + np.sin(b * x))
    assert -result.particles["displacement"][middle, 1] == pytest.approx(exact[middle], abs=1e-2 * exact.max())


def test_resumed_dashpots_have_the_same_bits(tmp_path: Path) -> None:
    given = block({"stiffness": STIFFNESS, "damping": {"normal": 0.01}}, [0.3, 1.0], end=40.0)
    whole = wsph.run(given)
    kept = given.with_(**{"checkpoint": {"every": 50}, "run.end": 20.0})
    wsph.run(kept, tmp_path / "cut")
    again = wsph.run(given.with_(checkpoint={"every": 50}), tmp_path / "cut", resume=True)
    assert np.array_equal(again.particles["velocity"], whole.particles["velocity"])
    assert again.history["dissipated"][-1] == whole.history["dissipated"][-1]


@pytest.mark.parametrize(
    ("spring", "message"),
    [
        ({}, "boundary.0.spring: needs stiffness, damping or both"),
        ({"stiffness": 0.0}, "boundary.0.spring.stiffness: is a number above zero"),
        ({"stiffness": {"normal": 1.0, "x": 1.0}}, "boundary.0.spring.stiffness: is a number above zero, or such numbers by"),
        ({"stiffness": {"z": 1.0}}, "boundary.0.spring.stiffness: has z, which a scene of dim = 2 does not have"),
        ({"damping": "3 N/m3"}, "boundary.0.spring.damping: '3 N/m3' is not in units of N s/m3"),
        ({"damping": {"across": 1.0}}, "boundary.0.spring.damping"),
        ({"damping": -1.0}, "boundary.0.spring.damping"),
    ],
)  # fmt: skip
def test_what_is_no_spring_is_refused_by_name(spring: dict[str, Any], message: str) -> None:
    with pytest.raises(wsph.SceneError, match=message):
        block(spring, [0.0, 1.0])


def test_a_bar_has_no_tangential_part() -> None:
    entry = {"body": "b", "face": "-x", "spring": {"damping": {"tangential": 1.0}}}
    with pytest.raises(wsph.SceneError, match="boundary.0.spring.damping: has a tangential part, which a bar"):
        bar(10, tables={"boundary": [entry]})


def test_units_are_read() -> None:
    spring = block({"stiffness": "2 kN/m3", "damping": {"normal": "3 kPa s/m"}}, [0.0, 1.0]).boundary[0].spring
    assert (spring.stiffness.every, spring.damping.normal) == (2000.0, 3000.0)
    again = block({"stiffness": "2 kN/m3"}, [0.0, 1.0]).with_(**{"run.end": 2.0})
    assert again.boundary[0].spring.stiffness.every == 2000.0
