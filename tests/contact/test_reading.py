"""Numbers of contacts: the force on the first body, and the work on both, in history.csv and in probes."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import FORMS, body, box, held, scene


def pressed(form: str, dim: int, law: dict[str, Any], load: float, names: tuple[str, str]) -> wsph.Result:
    """Two blocks side by side, the first held at its left, the second loaded at its right, damped until they rest."""
    sides = [0.5] * (dim - 1)
    damped = {"damping": {"rate": 1.5}}
    one, two = body(box(1.0, *sides), 0.25, name="a", **damped), body(box((1.0, 2.0), *sides), 0.25, name="c", **damped)
    entries = [held("-x", dim, "a"), {"body": "c", "face": "+x", "traction": {"x": load}}]
    probes = [{"name": "p", "of": "meet", "fields": ["force", "work"], "every": 1}]
    run = {"end": 60.0, "cfl": 0.3, "formulation": form}
    contact = [{"between": list(names), "name": "meet", **law}]
    return wsph.run(scene(one, two, run=run, boundary=entries, contact=contact, probes=probes))


@pytest.mark.parametrize(("form", "dim"), [(FORMS[0], 1), (FORMS[0], 2), (FORMS[1], 2), (FORMS[0], 3)])
def test_at_rest_a_contact_hands_on_the_load_and_its_work_is_what_it_has_taken(form: str, dim: int) -> None:
    for law, load in (({"law": "surface"}, -1e-3), ({"law": "tie"}, 1e-3)):
        result = pressed(form, dim, law, load, ("a", "c"))
        history, whole = result.history, load * 0.5 ** (dim - 1)
        assert history["contact_meet_x"][-1] == pytest.approx(whole, rel=1e-6)
        assert history["reaction_a-1_x"][-1] == pytest.approx(-whole, rel=1e-6)
        taken = history["contact_stored"] + history["contact_dissipated"]
        assert np.abs(history["contact_meet_work"] + taken).max() < 1e-12 * taken.max()
        assert result.probes["p"]["force_x"][-1] == history["contact_meet_x"][-1]
        assert result.summary["units"]["history"]["contact_meet_x"] == ("N/m2", "N/m", "N")[dim - 1]


def test_it_is_the_force_on_the_first_of_the_two() -> None:
    for law, load in (({"law": "surface"}, -1e-3), ({"law": "tie"}, 1e-3)):
        one, other = (pressed(FORMS[0], 2, law, load, names).history for names in (("a", "c"), ("c", "a")))
        assert one["contact_meet_x"][-1] == pytest.approx(-other["contact_meet_x"][-1], rel=1e-9)


def test_of_a_body_with_itself_there_is_a_work_alone() -> None:
    made = scene(body(box(1.0, 0.5), 0.25), contact=[{"self": "b", "name": "own"}], run={"end": 0.2, "cfl": 0.3})
    names = [name for name in wsph.run(made).history if name.startswith("contact_own")]
    assert names == ["contact_own_work"]
