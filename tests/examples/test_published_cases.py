"""Every published case in its short form meets what is asked of it; the full form is slow."""

import json
from pathlib import Path

import numpy as np
import pytest

from wsph import Scene
from wsph.errors import WsphError
from wsph.validation import CASES, oracles, validate
from wsph.validation.case import example
from wsph.validation.measures import stress_intensity


@pytest.mark.filterwarnings("ignore:.*spurious modes")  # 5 % in the deep beam's crack
@pytest.mark.filterwarnings("ignore:.*beyond small strain")  # as the paper has its cantilever
@pytest.mark.parametrize("name", list(CASES))
def test_the_short_form_meets_what_is_asked(name: str) -> None:
    (outcome,) = validate([name])
    missed = [f"{row.figure}: {row.reached:.4g} {row.unit}, asked {row.asked}" for row in outcome.rows if not row.meets]
    assert not missed
    assert any(row.asked != "reported" for row in outcome.rows)


KNOWN_MISSES = {
    "shear-band": ["81 columns: width"],
    "crack-dsif": ["whole plate, ul-tsph, 201 columns: L2 of the stress intensity factor"],
}
"""Figures of the full forms that do not come out as asked: 0.141 m, where 0.14 is asked; 2.5 %, where 2 % is."""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*spurious modes", "ignore:.*beyond small strain")
@pytest.mark.parametrize("name", list(CASES))
def test_the_full_form_misses_only_what_is_known(name: str) -> None:
    (outcome,) = validate([name], full=True)
    assert [row.figure for row in outcome.rows if not row.meets] == KNOWN_MISSES.get(name, [])


def test_the_struck_beam_of_finite_elements_is_the_one_that_was_computed() -> None:
    table = json.loads((Path(__file__).resolve().parents[1] / "references" / "struck_beam.json").read_text())
    for speed, found in oracles.STRUCK_BEAM.items():
        assert round(list(table[f"{speed:g} m/s"].values())[-1], 2) == found


def test_the_clamped_block_of_finite_elements_is_the_one_that_was_computed() -> None:
    table = json.loads((Path(__file__).resolve().parents[1] / "references" / "beam_modes.json").read_text())
    assert table["block, 10 x 1 x 1"]["omega"] == pytest.approx(oracles.BLOCK_FREQUENCY, rel=1e-6)


def test_a_name_that_is_none() -> None:
    with pytest.raises(WsphError, match="no case is named 'shockbar'; did you mean 'shock-bar'"):
        list(validate(["shockbar"]))


def test_half_a_cracked_plate_and_its_mirror_image_are_the_whole() -> None:
    """The symmetric half has the operators of the whole, at the tip too: the same stress intensity factor at every step."""
    whole = example("crack_dsif").with_(end="0.7 ms")
    half = whole.data()
    half["bodies"][0] |= {"shape": {"type": "box", "min": [0.0, 0.0], "max": [10.0, 2.0]}, "cracks": []}
    half["boundary"] = [b for b in half["boundary"] if b.get("face") != "-y"]
    half["boundary"].append({"body": "plate", "where": "y <= 0 and x >= 5", "symmetry": "y"})
    (_, a), (_, b) = stress_intensity(whole), stress_intensity(Scene(**half))
    assert np.abs(a - b).max() < 1e-9 * np.abs(a).max()
