"""The shipped scenes of fracture, plasticity and impact."""

import numpy as np
import pytest

import wsph
from wsph.validation.cases import example
from wsph.validation.measures import crack_angle, crack_offset, first_break

pytestmark = pytest.mark.filterwarnings("ignore:.*follow the lattice")


@pytest.mark.parametrize("turned", [0.0, 30.0])
def test_kalthoff_by_phase_field_at_any_lattice_direction(turned: float) -> None:
    result = wsph.run(example("kalthoff_winkler").with_(**{"bodies.0.lattice_rotate": turned}))
    assert 62.0 <= crack_angle(result) <= 68.0
    assert 23e-6 <= first_break(result) <= 28e-6
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 1e-3 * energy["external_work"]


def test_kalthoff_by_links() -> None:
    result = wsph.run(example("kalthoff_links"))
    assert 64.0 <= crack_angle(result, broken=0.2) <= 72.0
    assert 15e-6 <= first_break(result, broken=0.2) <= 27e-6
    energy = result.summary["energy"]
    assert -0.025 < energy["residual"] / energy["external_work"] < 0.025


@pytest.mark.parametrize("turned", [0.0, 15.0, pytest.param(30.0, marks=pytest.mark.slow)])
def test_a_mode_one_crack_stays_on_its_line(turned: float) -> None:
    result = wsph.run(example("mode_one_strip").with_(**{"bodies.0.lattice_rotate": turned}))
    assert crack_offset(result, start=0.04) < 0.5e-3
    x = result.particles["position"][result.field("damage") > 0.95][:, 0]
    assert x.max() > 0.098
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 0.015 * energy["external_work"]


@pytest.mark.parametrize("notch", [0.154, 0.102])
def test_the_deep_beam_cracks_straight_and_leans_to_the_load(notch: float) -> None:
    cracks = [{"from": [notch, 0.0], "to": [notch, 0.02]}]
    result = wsph.run(example("deep_beam").with_(**{"bodies.0.cracks": cracks}))
    X, damage = result.particles["position"], result.field("damage")
    broken = X[damage > 0.2]
    up = broken[(broken[:, 1] > 0.022) & (broken[:, 1] < 0.038) & (np.abs(broken[:, 0] - notch) < 0.02)]
    assert len(up)
    if notch == 0.154:
        assert abs(up[:, 0].mean() - notch) < 1e-3
    else:
        above = broken[(broken[:, 1] > 0.05) & (broken[:, 1] < 0.07)]
        assert above[:, 0].mean() > notch + 2e-3
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 0.045 * energy["external_work"]


def test_two_rods_touch_for_two_transits_and_part_at_the_ratio_of_their_lengths() -> None:
    result = wsph.run(example("two_rods").with_(**{"output.history": 1}))
    v, body = result.field("velocity_x"), result.field("body")
    # Free ends and a width: what bends and rings in the rods stays there.
    assert v[body == 1].mean() == pytest.approx(0.5, abs=0.02)
    assert v[body == 0].mean() == pytest.approx(0.0, abs=0.02)
    contact, time = result.history["contact"], result.history["time"]
    # The pulse is a rectangle with smeared flanks: from half of the force to half, which is a quarter of the energy.
    touching = time[contact > 0.25 * contact.max()]
    assert touching[-1] - touching[0] == pytest.approx(0.2 / np.sqrt(200e9 / 7850.0), rel=0.02)


def test_the_taylor_bar_is_as_short_as_published() -> None:
    result = wsph.run(example("taylor_bar"))
    X = result.particles["position"]
    x, top = X + result.particles["displacement"], X[:, 2] > X[:, 2].max() - 1e-4
    length = x[top, 2].mean() + 0.324e-3
    assert length == pytest.approx(21.45e-3, rel=0.05)
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    assert energy["hourglass"] < 0.1 * energy["dissipated"]


@pytest.mark.slow
def test_the_rigid_plastic_beam_bends_as_the_formula() -> None:
    probe = wsph.run(example("rigid_plastic_beam")).probes["middle"]
    late = probe["time"] > 0.9e-3
    assert -1e3 * probe["displacement_y"][late].mean() == pytest.approx(5.24, rel=0.05)


@pytest.mark.slow
def test_the_notched_beam_breaks_at_its_notch() -> None:
    result = wsph.run(example("notched_beam"))
    found = result.summary["fracture"]["beam"]
    assert found["broken_links"] >= 4
    X, damage = result.particles["position"], result.field("damage")
    assert np.abs(X[np.nan_to_num(damage) > 0.0][:, 0]).max() < 5e-3
