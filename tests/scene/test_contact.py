"""The table of contacts: what its keys come to, whose they are, and what is said of wrong ones."""

from pathlib import Path
from typing import Any

import pytest

import wsph
from tests import scenes
from wsph.errors import Refused, SceneError
from wsph.formulations.setup import Setup
from wsph.simulation import compose

PAIR: dict[str, Any] = {"between": ["a", "b"]}


def touching(*contacts: dict[str, Any], dim: int = 2, run: dict[str, Any] | None = None) -> wsph.Scene:
    """Two cubes, one beside the other."""
    bodies = [
        scenes.body(scenes.box((x, x + 1.0), *[1.0] * (dim - 1)), 0.25, name) for name, x in (("a", 0.0), ("b", 1.0))
    ]
    return scenes.scene(*bodies, run=run, contact=list(contacts))


@pytest.mark.parametrize(("keys", "name", "stiffness", "damping"), [
    (PAIR, "a-b", "auto", 0.0),
    ({"self": "a", "friction": 0.2}, "a-self", "auto", 1.0),
    ({**PAIR, "friction": 0.8, "name": "brake"}, "brake", "auto", 2.0),
    ({**PAIR, "friction": 0.8, "damping": 0.5, "stiffness": 4}, "a-b", 4.0, 0.5),
    ({**PAIR, "law": "pinball", "friction": 0.8}, "a-b", 1.0, 0.0),
    ({**PAIR, "law": "tie"}, "a-b", "auto", 0.0),
])  # fmt: skip
def test_keys_that_are_left_out(keys: dict[str, Any], name: str, stiffness: object, damping: float) -> None:
    scene = touching(keys)
    found = scene.contact[0]
    assert (found.name, found.stiffness, found.damping) == (name, stiffness, damping)
    assert found.number == (None if stiffness == "auto" else stiffness)
    assert wsph.Scene(**scene.data()) == scene


@pytest.mark.parametrize(("contacts", "text"), [
    ([{**PAIR, "law": "penalty"}], r'contact.0.law: "penalty" .* is replaced by law = "surface"'),
    ([{**PAIR, "law": "surfaces"}], r"contact.0.law: 'surfaces' is none of 'surface', 'pinball' or 'tie'"),
    ([{**PAIR, "radius": 0.5}], r'contact.0.radius: is a key of law = "pinball", not of "surface"'),
    ([{**PAIR, "strength": 1.0}], r'contact.0.strength: is a key of law = "tie", not of "surface"'),
    ([{**PAIR, "law": "tie", "friction": 0.1}], r'friction: is a key of law = "surface" and "pinball", not of "tie"'),
    ([{**PAIR, "law": "pinball", "edges": True}], r'edges: is a key of law = "surface", not of "pinball"'),
    ([{**PAIR, "law": "pinball", "stiffness": "auto"}], "of pinball it is a number"),
    ([{**PAIR, "edges": False}], "contact.0.edges: is for 3D"),
    ([{"self": "a", "law": "tie"}], "contact.0.self: a tie is between two bodies"),
    ([{**PAIR, "strength": "30 m", "law": "tie"}], "contact.0.strength: "),
    ([{**PAIR, "name": "a b"}], "contact.0.name: 'a b': a name has at most 100"),
    ([PAIR, {"self": "a", "name": "A-B"}], "contact.1.name: 'A-B' names contact.0 already; give it another"),
    ([PAIR, {**PAIR, "law": "tie"}], "contact.1.name: 'a-b' names contact.0 already; give it a name"),
    ([PAIR, {"between": ["b", "a"]}], "stand in contact.0 already"),
])  # fmt: skip
def test_what_is_wrong_is_named(contacts: list[dict[str, Any]], text: str) -> None:
    with pytest.raises(SceneError, match=text) as caught:
        touching(*contacts)
    assert len(caught.value.faults) == 1


def test_a_tie_and_another_law_go_together() -> None:
    touching({**PAIR, "law": "tie", "name": "glue"}, PAIR)


@pytest.mark.parametrize("law", ["surface", "pinball", "tie"])
def test_two_sets_are_refused_before_anything_is_made(law: str) -> None:
    scene = touching({**PAIR, "law": law}, run={"integrator": "tsph"})
    with pytest.raises(Refused, match="body 'a': contact pushes bodies whose particles move"):
        compose.compose(scene)


def test_sliding_that_hums_is_warned_of() -> None:
    with pytest.warns(RuntimeWarning, match=r"contact 'a-b': sliding with friction = 1\.2 hums"):
        compose.compose(touching({**PAIR, "friction": 1.2}, run={"cfl": 0.05}))


def test_points_alone_have_no_surface(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("".join(f"{x},{y},0.0625\n" for x in (1.1, 1.35) for y in (0.1, 0.35)))
    scene = touching(PAIR, run={"formulation": "total-lagrangian"})
    data = scene.data()
    data["bodies"][1] = {**data["bodies"][1], "points": {"file": str(tmp_path / "points.csv")}}
    for key in ("shape", "spacing"):
        del data["bodies"][1][key]
    with pytest.raises(Refused, match="body 'b': particles without cells have no surface for contact 'a-b'"):
        compose.compose(wsph.Scene(**data))


@pytest.mark.parametrize(("law", "edges"), [("surface", True), ("tie", True), ("pinball", False)])
def test_only_balls_keep_particles_off_the_faces(law: str, edges: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[bool] = []
    ask = Setup.along_edges.fget
    assert ask is not None
    monkeypatch.setattr(Setup, "along_edges", property(lambda self: seen.append(ask(self)) or seen[-1]))
    scene = touching({**PAIR, "law": law}, run={"formulation": "total-lagrangian"})
    compose._first_system(scene, bounded=False)
    assert set(seen) == {edges}
