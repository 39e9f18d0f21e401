"""Several bodies among processes: what a check tells of them, and what is refused by name."""

from typing import Any

import pytest

import wsph
from tests.ranks.shared_cases import CASES, scene
from wsph.checking import described
from wsph.errors import Refused, SceneError, WsphError


def told(made: wsph.Scene, count: int) -> dict[str, list[str]]:
    rows = described(made, "", count)
    first = [name for name, _ in rows].index("processes")
    found: dict[str, list[str]] = {}
    for name, words in rows[first:]:
        found.setdefault(name.strip(), []).append(words)
    return found


def test_a_check_tells_what_every_process_has_of_several_bodies() -> None:
    made = CASES["bodies"]()
    found = told(made, 4)
    whole = [f"body 's': every process has its {51 * 51} particles", "body 'f': every process has its"]
    assert [words.startswith(each) for words, each in zip(found["whole"], whole, strict=True)] == [True, True]
    low, high = (int(word) for word in found["particles"][0].split()[:3:2])
    assert 4 * low <= 91 * 51 + 71 * 67 <= 4 * high
    assert float(found["work"][0].split()[4]) < 15.0
    assert "contact" not in found


def test_a_check_says_that_contact_is_dealt_out() -> None:
    found = told(CASES["contact"](), 3)
    assert found["contact"] == ["dealt out, as many vertices each; the surfaces every process has whole"]
    alone, together = (float(each["efficiency"][0].split()[0]) for each in (told(scene(), 2), told(scene(), 4)))
    assert 0.0 < together < alone < 100.0


def test_a_check_tells_what_is_shared_where_pairs_follow_the_motion() -> None:
    moving = told(scene(form="updated-lagrangian"), 2)
    assert moving["particles"] == ["2048 to 2452 of its own each"]
    # A layer of 50 for faces, and seven around it for what comes near.
    assert 8 * 50 <= int(moving["copies"][0].split()[2]) <= 9 * 50
    # Particles see two layers of each other, and those two more: of these accelerations are told.
    assert 2 * 8 * 4 * 50 / 1024 <= float(moving["messages"][0].split()[0]) < 2 * 8 * 5 * 50 / 1024
    parts, alone = told(scene(form="updated-lagrangian"), 4), told(scene(form="updated-lagrangian"), 2)
    memory, more = (float(found["memory"][0].split()[0]) for found in (parts, alone))
    # The last of four has others on one side, as the last of two.
    own = 4500 - 3 * 1024
    assert parts["particles"] == [f"1024 to {own} of its own each"]
    assert memory / more == pytest.approx((own + 8 * 50) / (2452 + 8 * 50), rel=0.05)


def test_a_check_tells_of_two_sets_that_states_are_sent() -> None:
    found = told(CASES["two sets"](), 2)
    assert found["particles"] == ["2048 to 2593 of its own each"]
    # Two layers and more of 51: v, sigma and u, 2 + 4 + 2 numbers of each.
    copies = int(found["copies"][0].split()[2])
    assert 2 * 51 <= copies < 4 * 51
    assert found["messages"] == [f"{copies * 8 * 8 / 1024:.4g} kB a right-hand side, 1 of these a step"]


SMALL = {"shape": {"type": "box", "min": [0.0, 0.0], "max": [9.0, 5.0]}}
TINY = ("s", [20.0, 0.0], [30.0, 5.0], {})
ROUND = {"shape": {"type": "disc", "center": [45.0, 25.0], "radius": 46.0}}
LARGE = {"shape": {"type": "disc", "center": [35.0, 135.0], "radius": 40.0}}


def test_a_check_tells_what_every_process_has_of_fitted_surfaces() -> None:
    made = scene(body=ROUND, more=[("c", [], [], LARGE)])
    found, composition = told(made, 3), wsph.compose(made)
    low, high = (int(word) for word in found["particles"][0].split()[:3:2])
    assert 3 * low <= composition.particles <= 3 * high
    assert "whole" not in found


@pytest.mark.parametrize(
    ("changes", "kind", "words"),
    [
        ({"body": SMALL, "more": [TINY], "probes": []}, Refused, "bodies 'b', 's': each has too few particles"),
        ({"body": SMALL, "probes": []}, Refused, "body 'b': 60 particles in blocks of 1024 are too few"),
        (
            {"dim": 1, "form": "total-lagrangian", "run": {"correction": "paper"}},
            SceneError,
            "run.correction: the correction of the paper is for one process",
        ),
    ],
)
def test_what_of_bodies_cannot_be_shared_is_refused_by_name(
    changes: dict[str, Any], kind: type[WsphError], words: str
) -> None:
    with pytest.raises(kind) as caught:
        described(scene(**changes), "", 2)
    assert words in str(caught.value)
