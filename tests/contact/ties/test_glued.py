"""Glued bodies in scenes: waves pass, stresses are those of one body, what turns keeps its energy, and bonds break."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Refused
from wsph.simulation.compose import compose

FORMS = ("stress-points", "total-lagrangian")
SPEED = 1e-4
SOFT = scenes.material(poisson_ratio=0.0)


def bar(name: str, start: float, end: float, spacing: float, dim: int = 2, **keys: Any) -> dict[str, Any]:
    """A strip of unit wave speed, or in 1D a bar."""
    state = {"state": "stress"} if dim == 1 else {}
    sides = [4.0] * (dim - 1)
    return scenes.body(scenes.box((start, end), *sides), spacing, name, **{"material": SOFT, **state, **keys})


def tie(**keys: Any) -> list[dict[str, Any]]:
    return [{"between": ["a", "b"], "law": "tie", **keys}]


def pulse(form: str, dim: int, finer: float | None, cfl: float | str = 0.3) -> tuple[np.ndarray, np.ndarray]:
    """Velocities at the coarser spacings of a bar of 80, over the largest of a pulse 20 long that came from the left end and
    has met, or not (None), a joint with a bar of finer cells; and where."""
    bodies = [bar("a", 0.0, 140.0, 1.0, dim)] if finer is None else []
    bodies = bodies or [bar("a", 0.0, 80.0, 1.0, dim), bar("b", 80.0, 140.0, 1.0 / finer, dim)]
    shape = f"{SPEED}*sin(pi*min(t, 20.0)/20.0)**2"
    drive = [{"body": "a", "face": "-x", "velocity": {"x": shape}}]
    made = scenes.scene(*bodies, run={"formulation": form, "end": 115.0, "cfl": cfl}, boundary=drive,
                        contact=tie() if finer else [])  # fmt: skip
    result = wsph.run(made)
    x, mine = result.particles["position"][:, 0], result.field("body") == 0
    before = mine & (x < 75.0)
    return result.field("velocity_x")[before] / SPEED, x[before]


@pytest.mark.parametrize("finer", [2.0, 4.0])
@pytest.mark.parametrize(("form", "dim"), [*((form, 2) for form in FORMS), ("stress-points", 1)])
def test_a_joint_reflects_less_than_two_percent_of_a_pulse_of_twenty_points(form: str, dim: int, finer: float) -> None:
    """Beside what the bar itself leaves behind a pulse, by dispersion."""
    through, x = pulse(form, dim, None)
    met, same = pulse(form, dim, finer)
    assert (x == same).all()
    assert np.abs(met - through).max() < 0.01


def test_a_joint_is_as_good_where_the_step_is_left_open() -> None:
    assert np.abs(pulse("stress-points", 2, 2.0, "auto")[0] - pulse("stress-points", 2, None, "auto")[0]).max() < 0.02


def test_a_soft_tie_reflects_what_its_spring_does() -> None:
    """A spring of s per area between bars of impedance Z reflects i k Z c/(2 s) of a wave: of a pulse its slope."""
    h = (1.0, 0.5)
    bodies = [bar("a", 0.0, 80.0, h[0], 1), bar("b", 80.0, 140.0, h[1], 1)]
    drive = [{"body": "a", "face": "-x", "velocity": {"x": f"{SPEED}*sin(pi*min(t, 20.0)/20.0)**2"}}]
    result = wsph.run(scenes.scene(*bodies, run={"end": 115.0, "cfl": 0.2}, boundary=drive, contact=tie(stiffness=1.0)))
    x, mine = result.particles["position"][:, 0], result.field("body") == 0
    give = 0.5 * sum(h)
    slope = np.pi / 20.0
    assert result.field("velocity_x")[mine & (x < 75.0)].max() / SPEED == pytest.approx(0.5 * give * slope, rel=0.1)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("softer", "finer"), [(1.0, 2.0), (0.1, 2.0), (0.1, 0.5)])
def test_two_materials_have_the_same_stress_and_each_its_strain(form: str, softer: float, finer: float) -> None:
    """Pulled to rest. What the joint itself gives way is that of its springs."""
    bodies = [
        scenes.body(scenes.box((lo, lo + 1.0), 0.5), h, name, damping={"rate": 0.5},
                    material=scenes.material(youngs_modulus=E, poisson_ratio=0.0))
        for name, lo, h, E in (("a", 0.0, 0.125, 1.0), ("b", 1.0, 0.125 / finer, softer))
    ]  # fmt: skip
    held = [{"body": "a", "face": "-x", "normal": 0.0}, *({"body": n, "face": "-y", "normal": 0.0} for n in "ab")]
    load = {"body": "b", "face": "+x", "traction": {"x": 1e-5}}
    result = wsph.run(scenes.scene(*bodies, run={"formulation": form, "end": 50.0 if softer == 1.0 else 90.0, "cfl": 0.2},
                                   boundary=[*held, load], contact=tie(stiffness=4.0),
                                   output={"fields": ["stress", "displacement"]}))  # fmt: skip
    stress, body, x = result.field("stress_xx") / 1e-5, result.field("body"), result.particles["position"][:, 0]
    for k in (0, 1):
        assert stress[body == k] == pytest.approx(1.0, abs=2e-3)
    end = result.field("displacement_x")[x > 2.0 - 0.26 * 0.125 / finer].mean() / 1e-5
    give = (0.5 * 0.125 + 0.5 * 0.125 / finer / softer) / 4.0
    assert end == pytest.approx(1.0 + 1.0 / softer + give, rel=5e-3)


def turned(dim: int, gap: float, precision: str = "f64", **run: Any) -> tuple[float, float, float]:
    """The largest changes of momentum, angular momentum and energy of a glued pair that turns, a third of a turn in 2D; gap
    between its faces."""
    rest = [1.0] * (dim - 1)
    spin = ["-0.03*(y - 0.5) + 0.002*sin(3*x)", "0.03*(x - 1.0)", "0.01*(y - 0.5)"][:dim]
    bodies = [
        scenes.body(scenes.box((lo, lo + 1.0), *rest), h, name, velocity=spin, material=scenes.material("neo-hookean"))
        for name, lo, h in (("a", 0.0, 0.25), ("b", 1.0 + gap, 0.125))
    ]
    made = compose(scenes.scene(*bodies, run={"end": 1e9, "cfl": 0.15, "precision": precision, **run}, contact=tie()))
    assert made.joint is not None
    made.joint.start()
    (coupling,) = made.joint.couplings

    def sums() -> tuple[np.ndarray, np.ndarray, float]:
        made.publish()
        momentum, spin, energy = np.zeros(dim), np.zeros((dim, dim)), sum(e.value() for e in coupling.ledger[:1])
        for each in made.bodies:
            system = each.system
            mass, v = system.volume * system.density, system.state.read("velocity")
            x = system.position / made.scales.length + system.state.read("displacement")
            momentum, spin = momentum + mass @ v, spin + (mass[:, None] * x).T @ v - (mass[:, None] * v).T @ x
            found = each.diagnostics.measure(system.state)
            energy += found.kinetic + found.strain + system.held_energy()
        return momentum, spin, energy

    first, worst = sums(), [0.0, 0.0, 0.0]
    size = [abs(first[0]).max() + 0.03, abs(first[1]).max(), first[2]]
    for _ in range(5):
        made.program.run(400)
        gaps = [float(np.abs(a - b).max()) / s for a, b, s in zip(sums(), first, size, strict=True)]
        worst = [max(a, b) for a, b in zip(worst, gaps, strict=True)]
    return worst[0], worst[1], worst[2]


@pytest.mark.parametrize("gap", [0.0, 0.06])
@pytest.mark.parametrize(("dim", "form"), [(2, "stress-points"), (2, "total-lagrangian"), (3, "stress-points")])
def test_a_glued_pair_that_turns_keeps_momentum_and_energy(dim: int, form: str, gap: float) -> None:
    momentum, angular, energy = turned(dim, gap, formulation=form)
    assert momentum < 1e-12
    assert angular < 1e-12
    assert energy < 1e-5


@pytest.mark.parametrize(("precision", "run", "gates"), [
    ("f64", {"integrator": "rk4"}, (1e-12, 1e-10, 1e-5)), ("f32", {}, (1e-4, 1e-5, 1e-4)),
])  # fmt: skip
def test_so_do_other_methods_and_single_precision(precision: str, run: dict, gates: tuple[float, ...]) -> None:
    found = turned(2, 0.06, precision, **run)
    assert all(gap < gate for gap, gate in zip(found, gates, strict=True)), found


def test_an_inclusion_is_part_of_the_plate() -> None:
    """A disc in a hole that its cells do not meet, of the same material: the stress is uniform."""
    disc = {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}
    plate = {"type": "difference", "shapes": [scenes.box((-1.0, 1.0), (-1.0, 1.0)), disc]}
    bodies = [scenes.body(s, h, n, damping={"rate": 0.6}) for n, s, h in (("a", plate, 0.125), ("b", disc, 0.0625))]
    load = [{"body": "a", "face": "-x", "normal": 0.0}, {"body": "a", "face": "-y", "normal": 0.0},
            {"body": "a", "face": "+x", "traction": {"x": 1e-4}}]  # fmt: skip
    result = wsph.run(scenes.scene(*bodies, run={"end": 60.0, "cfl": 0.15}, boundary=load, contact=tie()))
    stress, body = result.field("stress_xx") / 1e-4, result.field("body")
    for k in (0, 1):
        mine = stress[(body == k) & np.isfinite(stress)]
        assert mine.mean() == pytest.approx(1.0, abs=0.01)
        assert mine.std() < 0.02
    assert result.summary["energy"]["contact_numerical"] < 1e-6 * result.summary["energy"]["external_work"]


def torn(strength: float | None, *further: dict[str, Any], **run: Any) -> wsph.Scene:
    """A bar of two that is pulled at its left end for a time, and then pushed back."""
    bodies = [scenes.body(scenes.box((lo, lo + 1.0), 0.25), h, name, material=SOFT)
              for name, lo, h in (("a", 0.0, 0.0625), ("b", 1.0, 0.03125))]  # fmt: skip
    glue = tie(name="glue", **({} if strength is None else {"strength": strength}))
    drive = [{"body": "a", "face": "-x", "velocity": {"x": "1e-3*((t >= 1.5) - (t < 1.5))"}}]
    return scenes.scene(*bodies, run={"end": 6.0, "cfl": 0.2, **run}, boundary=drive, contact=[*glue, *further],
                        output={"history": 10})  # fmt: skip


def of_b(result: wsph.Result) -> np.ndarray:
    return result.field("velocity_x")[result.field("body") == 1]


@pytest.mark.parametrize("form", FORMS)
def test_what_is_pulled_harder_than_its_strength_breaks(form: str) -> None:
    """The wave that arrives has a stress of 1e-3."""
    whole, broken = (wsph.run(torn(strength, formulation=form)) for strength in (2.5e-3, 0.5e-3))
    assert whole.summary["energy"]["contact_dissipated"] == 0.0
    assert of_b(whole).mean() > 0.5e-3
    energy, history = broken.summary["energy"], broken.history
    assert energy["contact_stored"] == 0.0
    # The broken joint is a free end: the body leaves with the impulse that it had by then, leftwards.
    assert of_b(broken).mean() < 0.0
    assert 0.0 < energy["contact_dissipated"] < 1e-3 * energy["external_work"]
    since = history["time"][history["contact_dissipated"] > 0.0][0]
    assert since == pytest.approx(1.05, abs=0.1)
    assert np.ptp(history["contact_dissipated"][history["time"] > since + 0.2]) == 0.0
    assert np.abs(history["residual"]).max() < 2e-3 * energy["external_work"]


def test_what_has_broken_meets_where_a_contact_is_named() -> None:
    apart = wsph.run(torn(0.5e-3), throw=False)
    pushed = wsph.run(torn(0.5e-3, {"between": ["a", "b"]}))
    assert of_b(apart).mean() < 0.0 < of_b(pushed).mean()
    assert pushed.history["contact_stored"][-1] < 1e-3 * pushed.history["contact_stored"].max()
    assert pushed.summary["energy"]["contact_dissipated"] == pytest.approx(
        apart.summary["energy"]["contact_dissipated"], rel=0.2
    )


def test_what_is_broken_stays_so_when_a_run_goes_on(tmp_path: Path) -> None:
    scene = torn(0.5e-3, {"between": ["a", "b"]})
    straight = wsph.run(scene, tmp_path / "straight")
    assert straight.history["contact_dissipated"][-1] > 0.0
    wsph.run(scene.with_(end=2.0, checkpoint={"every": 50}), tmp_path / "resumed")
    resumed = wsph.run(scene, tmp_path / "resumed", resume=True)
    for name, column in straight.history.items():
        assert (column == resumed.history[name]).all(), name
    assert np.array_equal(straight.particles["velocity"], resumed.particles["velocity"])


def test_threads_do_not_show() -> None:
    one, two = (wsph.run(torn(0.5e-3, end=1.5, threads=n)) for n in (1, 2))
    assert np.array_equal(one.particles["velocity"], two.particles["velocity"])


def test_a_stiffness_is_what_the_step_leaves() -> None:
    def stiffness(**run: Any) -> float:
        made = compose(torn(None, **run))
        assert made.joint is not None
        (law,) = made.joint.couplings[0].laws  # pyright: ignore[reportAttributeAccessIssue]
        return law.stiffness * (0.5 * 0.0625 + 0.5 * 0.03125) / 0.03125

    found = [stiffness(cfl=cfl) for cfl in (0.45, 0.4, 0.05)]
    assert found[0] < found[1] < found[2]
    assert found[2] == pytest.approx(10.0)
    with pytest.raises(Refused, match="would have less than 0.5 of the stiffness"):
        stiffness(cfl=0.9)


def test_what_does_not_touch_is_refused() -> None:
    bodies = [bar("a", 0.0, 8.0, 1.0), bar("b", 9.0, 17.0, 1.0)]
    with pytest.raises(
        Refused, match="contact 'a-b': no vertex of body 'a' is within half a spacing of the surface of 'b'"
    ):
        compose(scenes.scene(*bodies, contact=tie()))
