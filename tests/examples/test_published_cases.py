"""Every published case in its short form meets what is asked of it; the full form is slow."""

import numpy as np
import pytest

from wsph import Scene
from wsph.errors import WsphError
from wsph.validation import CASES, validate
from wsph.validation.cases import example
from wsph.validation.measures import stress_intensity


@pytest.mark.parametrize("name", list(CASES))
def test_the_short_form_meets_what_is_asked(name: str) -> None:
    (outcome,) = validate([name])
    missed = [f"{row.figure}: {row.reached:.4g} {row.unit}, asked {row.asked}" for row in outcome.rows if not row.meets]
    assert not missed
    assert any(row.asked != "reported" for row in outcome.rows)


KNOWN_MISSES = {
    "shear-band": ["81 columns: width"],
    "crack-dsif": ["whole plate, ul-tsph, 201 columns: L2 of the stress intensity factor"],
    "bar-stability": [f"beam, alpha = 2.5 on all pairs, rkc {stages}: largest Courant number" for stages in (5, 10)],
    "rigid-plastic-beam": [f"{rows} rows, 20 m/s: mean deflection" for rows in (7, 14)],
}
"""Figures of the full forms that do not come out as asked: .141 m, where .14 is asked; 2.5 %, where 2 % is; Courant numbers
3.5 and 3.9, where 4.3 and 4.9 are; deflections 2.5 and 2.6 % below those of another implementation, where 2 % is."""


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_the_full_form_misses_only_what_is_known(name: str) -> None:
    (outcome,) = validate([name], full=True)
    assert [row.figure for row in outcome.rows if not row.meets] == KNOWN_MISSES.get(name, [])


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
