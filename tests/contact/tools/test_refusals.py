"""What tools cannot be, said in words: keys, values and the way out, before a kernel compiles."""

from pathlib import Path
from typing import Any

import pytest

import wsph
from tests.contact.tools.test_gaps import write_box
from tests.scenes import Data, body, box, scene

PLANE: Data = {"type": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]}
BALL: Data = {"type": "sphere", "center": [0.5, -0.5], "radius": 0.4}
BOX: Data = {"type": "box", "from": [-1.0, -1.0], "to": [2.0, 0.0]}
BAR: Data = {"type": "cylinder", "from": [0, 0, -1], "to": [0, 0, 1], "radius": 1.0}


def tool(shape: Data = PLANE, **keys: Any) -> Data:
    return {"name": "t", "shape": shape, "against": ["b"], **keys}


def fault(*tools: Data, dim: int = 2) -> str:
    with pytest.raises(wsph.SceneError) as found:
        scene(body(box(*[1.0] * dim), 0.25), tools=list(tools))
    return str(found.value)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (tool(against=["c"]), ["tools.0.against", "no body and no tool is named 'c'", "there is b, t"]),
        (tool(against=["bb"]), ["did you mean 'b'?"]),
        (tool(against=["t"]), ["is the tool itself"]),
        (tool(against=["b", "b"]), ["named twice"]),
        (tool(against=[]), ["tools.0.against"]),
        (tool(name="b"), ["tools.0.name", "names another body already"]),
        (tool(name="../x"), ["tools.0.name"]),
        (tool({**PLANE, "normal": [0, 0]}), ["tools.0.shape.normal", "has no length"]),
        (tool({**PLANE, "normal": [0, 0, 1]}), ["tools.0.shape.normal", "has 3 coordinates in a scene of dim = 2"]),
        (tool(inside=True), ["tools.0.inside", "turn its normal around"]),
        (tool(BAR), ["tools.0.shape.type", "'cylinder' is none of the tools' shapes in 2D: plane, disc, sphere, box"]),
        (tool({**BOX, "to": [-2, 1]}), ["tools.0.shape.from", "must lie below to"]),
        (tool({**BOX, "rotate": [[0, 0, 1], 5]}), ["tools.0.shape.rotate", "a number of degrees in 2D"]),
        (tool({"type": "spher"}), ["'spher' is none of", "did you mean 'sphere'?"]),
        (tool(velocity={"z": 1.0}), ["tools.0.velocity.z", "is none of x, y"]),
        (tool(velocity={"x": "y"}), ["tools.0.velocity.x", "'y' differs from place to place"]),
        (tool(velocity={"x": "1 Pa"}), ["tools.0.velocity.x", "is not in units of m/s"]),
        (tool(velocity=[1.0, 0.0]), ["give its mass", "velocity = { x = 1.0 }"]),
        (tool(BALL, mass=1.0, velocity={"x": 1.0}), ["mass makes the tool free", "velocity prescribes its motion"]),
        (tool(BALL, mass=1.0, turn={"about": [0, 0], "rate": 1.0}), ["turn prescribes its motion"]),
        (tool(BALL, mass=1.0, velocity=[1.0]), ["tools.0.velocity", "has 1 components"]),
        (tool(BALL, spin=1.0), ["spin is of a free tool"]),
        (tool(BALL, mass="1 kg"), ["tools.0.mass", "'1 kg' is not in units of kg/m"]),
        (tool(BALL, mass=0.0), ["tools.0.mass", "is not above zero"]),
        (tool(BALL, mass=1.0, inertia=[1, 1, 1]), ["tools.0.inertia", "a number, or three in 3D"]),
        (tool(BALL, mass=1.0, spin=[0, 0, 1.0]), ["tools.0.spin", "is a number in 2D"]),
        (tool(mass=1.0), ["tools.0.inertia", "a plane without end has none of its own"]),
        (tool(turn={"axis": [0, 0, 1], "about": [0, 0], "rate": 1.0}), ["tools.0.turn.axis", "leave it out"]),
        (tool(turn={"about": [0, 0, 0], "rate": "x"}), ["tools.0.turn.about", "tools.0.turn.rate"]),
        (tool(friction=-1.0), ["tools.0.friction"]),
        (tool(stiffness=0.0), ["tools.0.stiffness"]),
        (tool(frction=0.1), ["tools.0.frction", "did you mean 'friction'?"]),
    ],
)  # fmt: skip
def test_faults_of_a_table_are_told_with_key_value_and_way_out(given: Data, words: list[str]):
    said = fault(given)
    for word in words:
        assert word in said


def test_faults_in_one_and_three_dimensions():
    line: Data = {"type": "plane", "point": [0.0], "normal": [1.0]}
    assert "tools.0.friction: in 1D nothing slides" in fault(tool(line, friction=0.2), dim=1)
    assert "nothing turns in 1D" in fault(tool(line, turn={"about": [0.0], "rate": 1.0}), dim=1)
    assert "tools' shapes in 1D: plane" in fault(tool({"type": "sphere", "center": [0.0], "radius": 1.0}), dim=1)
    turn = {"about": [0, 0, 0], "rate": 1.0}
    assert "tools.0.turn.axis: is missing" in fault(tool(BAR, turn=turn), dim=3)
    assert "is no axis" in fault(tool(BAR, turn=turn | {"axis": [0, 0, 0]}), dim=3)
    assert "is a list of three in 3D" in fault(tool(BAR, mass=1.0, spin=1.0), dim=3)


def test_two_tools_that_cannot_meet():
    floor, wall = (
        tool(BOX, name="floor"),
        tool({**BOX, "from": [2.0, 0.0], "to": [3.0, 1.0]}, name="wall", against=["floor"]),
    )
    assert "neither 'wall' nor 'floor' is free" in fault(floor, wall)
    said = fault(floor, wall | {"mass": 1.0})
    assert "'wall' (box) and 'floor' (box)" in said
    assert "model one of them as a body" in said
    one, other = (
        tool(BALL, name="one", mass=1.0, against=["other"]),
        tool({**BALL, "center": [2.0, 0.0]}, name="other", mass=1.0, against=["one"]),
    )
    assert "'one' names 'other' already; they would push twice" in fault(one, other)


def test_a_surface_of_triangles_with_a_hole(tmp_path: Path):
    path = tmp_path / "open.stl"
    write_box(path, *(3 * [low] for low in (0.0, 1.0)))
    text = path.read_text().split("facet")
    path.write_text("facet".join([*text[:1], *text[3:]]))  # without its first triangle
    said = fault(tool({"type": "stl", "file": str(path)}), dim=3)
    assert "is not closed" in said
    assert "repair it where it was made" in said


def test_a_tool_that_a_body_lies_in_is_refused_with_place_and_depth():
    made = scene(body(box(1.0, 1.0), 0.25), tools=[tool({**PLANE, "point": [0.0, 0.125]})])
    with pytest.raises(
        wsph.Refused, match=r"tool 't': body 'b' lies in it from the start, at \(.*, 0\) m by 0\.125 m: move one"
    ):
        wsph.run(made)
    wsph.run(made.with_(**{"tools.0.shape.point": [0.0, 0.0], "end": 0.1}))  # touching is not lying in it


def test_tools_that_overlap_are_refused():
    floor = tool(BOX, name="floor")
    ball = tool({**BALL, "center": [1.5, 0.3]}, name="ball", mass=1.0, against=["floor"])
    with pytest.raises(
        wsph.Refused, match=r"tools 'ball' and 'floor' overlap from the start, at \(1\.5, 0\.3\) m by 0\.1 m"
    ):
        wsph.run(scene(body(box(1.0, 1.0), 0.25), tools=[floor, ball]))


def test_two_sets_take_no_tools():
    made = scene(
        body(box(1.0), 0.1, state="stress"),
        tools=[tool({"type": "plane", "point": [0.0], "normal": [1.0]})],
        run={"integrator": "tsph"},
    )
    with pytest.raises(
        wsph.Refused, match="body 'b': tool 't' pushes bodies whose particles move: use an integrator of one set"
    ):
        wsph.run(made)


def test_probes_of_what_is_not_there():
    def said(**keys: Any) -> str:
        with pytest.raises(wsph.SceneError) as found:
            wsph.run(scene(body(box(1.0), 0.1, state="stress"), tools=[tool({"type": "plane", "point": [0.0], "normal": [1.0]})],
                           probes=[{"name": "p", "of": "t", "fields": ["force"], **keys}]))  # fmt: skip
        return str(found.value)

    assert "nothing that has numbers is named 'u'; there is t" in said(of="u")
    assert "of 't' fields are force, torque, work: 'stress' is none of" in said(fields=["stress"])
    assert "exactly one of at, line, where and of is needed" in said(at=[[0.5]])
    assert "'t' has no torque in 1D: it has force, work" in said(fields=["torque"])


def test_sliding_that_hums_is_warned_of():
    made = scene(body(box(1.0, 1.0), 0.25), tools=[tool(friction=1.5)], run={"end": 0.01, "cfl": 0.05})
    with pytest.warns(RuntimeWarning, match=r"tool 't': sliding with friction = 1\.5 hums"):
        wsph.run(made)
