"""Bodies that overlap, run into each other or pass through each other: refused, warned of once, or stopped by name."""

import re
import warnings
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.errors import Refused, SceneError, Unstable
from wsph.simulation.compose import compose

METHODS = [
    ("leapfrog", "stress-points"),
    ("leapfrog", "total-lagrangian"),
    ("leapfrog", "updated-lagrangian"),
    ("ul-tsph", "updated-lagrangian"),
    ("tsph", "small-strain"),
]
WORDS = r"step \d+, t = .* s: bodies 'a' and 'b' run into each other at \(.*\) m and pass through each other.*\[\[contact\]\]"


def two(dim: int, gap: float, speed: float, *, rotate: float = 0.0, run: dict[str, Any] | None = None,
        contact: list[dict[str, Any]] | None = None, **tables: Any) -> wsph.Scene:  # fmt: skip
    """Two cubes of side 1 and four cells, a gap apart, that go for each other; `rotate` [degrees] turns the second."""
    turn = {"rotate": rotate} if rotate else {}
    bodies = [
        scenes.body(scenes.box((x, x + 1.0), *[(0.0, 1.0)] * (dim - 1)) | (turn if name == "b" else {}), 0.25, name,
                    velocity=[v, *[0.0] * (dim - 1)], **({"state": "stress"} if dim == 1 else {}))
        for name, x, v in (("a", 0.0, speed), ("b", 1.0 + gap, -speed))
    ]  # fmt: skip
    return scenes.scene(*bodies, run=run, contact=contact or [], **tables)


@pytest.mark.parametrize(("integrator", "form"), METHODS)
@pytest.mark.parametrize(("dim", "rotate"), [(1, 0.0), (2, 0.0), (2, 30.0), (3, 0.0)])
def test_bodies_that_nothing_keeps_apart_are_named_when_they_meet(
    integrator: str, form: str, dim: int, rotate: float
) -> None:
    run = {"integrator": integrator, "formulation": form, "end": 4.0}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert wsph.run(two(dim, 1.0, 0.4, rotate=rotate, run=run), throw=False).status == "completed"
    texts = [str(each.message) for each in caught if "run into each other" in str(each.message)]
    assert len(texts) == 1
    assert re.match(WORDS, texts[0])
    time = float(texts[0].split("t = ")[1].split(" s:")[0])
    # At 0.8 over a gap of 1, less what a turned one reaches out; half a cell is not seen where particles are inside it.
    assert 0.6 < time < 1.25 + 0.25 / 0.8 + 0.3


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian", "updated-lagrangian"])
def test_contact_that_does_not_keep_bodies_apart_stops_the_run(form: str) -> None:
    """At the speed of waves each: they have changed sides in a few steps."""
    contact = [{"between": ["a", "b"], "law": "pinball"}]
    run = {"formulation": form, "end": 4.0, "cfl": 0.1}
    with pytest.raises(Unstable, match="of body '.': it is inside of body '.', which it has passed through") as caught:
        wsph.run(two(2, 0.3, 1.2, run=run, contact=contact))
    assert caught.value.field == "contact"
    assert caught.value.time < 0.5


def test_a_slow_merger_is_stopped_too() -> None:
    """A quarter of the speed of waves each, against pinball contact: they would end inside of each other."""
    run = {"formulation": "total-lagrangian", "end": 7.0, "cfl": 0.1}
    scene = two(2, 0.01, 0.29, run=run, contact=[{"between": ["a", "b"], "law": "pinball"}])
    with pytest.raises(Unstable, match="passed through or merged"):
        wsph.run(scene)


@pytest.mark.parametrize(("integrator", "form"), METHODS)
def test_bodies_that_overlap_at_the_start_are_named(integrator: str, form: str) -> None:
    run = {"integrator": integrator, "formulation": form}
    with pytest.warns(RuntimeWarning, match=r"bodies 'a' and 'b' overlap at \(.*\) m from the start: nothing acts"):
        compose(two(2, -0.1, 0.0, run=run))
    if integrator == "leapfrog":
        with pytest.raises(Refused, match=r"'a' and 'b' overlap at \(.*\) m from the start: contact keeps apart"):
            compose(two(2, -0.1, 0.0, run=run, contact=[{"between": ["b", "a"], "law": "pinball"}]))


@pytest.mark.parametrize(("law", "too_far"), [("surface", 0.3), ("tie", 0.15)])
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
def test_surfaces_may_overlap_a_little(law: str, too_far: float, form: str) -> None:
    """By a spacing, ties by half of one: it counts as none, nothing moves them."""
    run, contact = {"formulation": form, "cfl": 0.1}, [{"between": ["b", "a"], "law": law}]
    result = wsph.run(two(2, -0.1, 0.0, run=run, contact=contact))
    assert abs(result.particles["velocity"]).max() < 1e-12
    with pytest.raises(Refused, match=r"'a' and 'b' overlap at \(.*\) m from the start: contact keeps apart"):
        compose(two(2, -too_far, 0.0, run=run, contact=contact))


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_what_touches_or_lies_in_a_hole_does_not_overlap(dim: int) -> None:
    compose(two(dim, 0.0, 0.0))
    if dim == 2:
        ring = scenes.body({"type": "ring", "center": [0.0, 0.0], "inner": 1.0, "outer": 1.5}, 0.1, "ring")
        disc = scenes.body({"type": "disc", "center": [0.0, 0.0], "radius": 0.8}, 0.1, "disc")
        wsph.run(scenes.scene(ring, disc, run={"end": 0.5}))


def test_touching_bodies_that_fly_together_do_not_meet() -> None:
    bodies = [
        scenes.body(scenes.box((x, x + 1.0), 1.0), 0.25, name, velocity=[0.3, 0.1])
        for name, x in (("a", 0.0), ("b", 1.0))
    ]
    wsph.run(scenes.scene(*bodies, run={"end": 3.0}))


@pytest.mark.parametrize("again", [{"between": ["a", "b"]}, {"between": ["b", "a"], "law": "pinball"}])
def test_a_pair_that_is_named_twice_is_refused(again: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match=r"contact.1.between: .* stand in contact.0 already; they would push twice"):
        two(2, 0.5, 0.0, contact=[{"between": ["a", "b"]}, again])


@pytest.mark.parametrize("shape", ["disc", "sphere"])
def test_round_bodies_are_named_where_they_overlap_and_when_they_meet(shape: str) -> None:
    """Their cells are of no grid; that they touch at the start is no overlap."""
    dim = 2 if shape == "disc" else 3
    state = {"state": "strain"} if dim == 2 else {}

    def pair(gap: float, speed: float) -> wsph.Scene:
        bodies = [
            {"name": name, "shape": {"type": shape, "center": [x, *[0.0] * (dim - 1)], "radius": 0.5}, "spacing": 0.125,
             "velocity": [v, *[0.0] * (dim - 1)], "material": scenes.material(), **state}
            for name, x, v in (("a", 0.0, speed), ("b", 1.0 + gap, -speed))
        ]  # fmt: skip
        return wsph.Scene(
            schema=1,
            dim=dim,
            run={"integrator": "leapfrog", "end": 1.0, "cfl": 0.5},
            bodies=bodies,
            stop={"energy": 1e9},
        )

    with pytest.warns(RuntimeWarning, match="bodies 'a' and 'b' overlap at"):
        compose(pair(-0.1, 0.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compose(pair(0.0, 0.0))
    with pytest.warns(RuntimeWarning, match=WORDS):
        wsph.run(pair(0.1, 0.4), throw=False)


@pytest.mark.filterwarnings("ignore")  # how fast it all is
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian", "updated-lagrangian"])
@pytest.mark.parametrize("mach", [0.14, 0.5, 1.0])
@pytest.mark.parametrize("aside", [0.0, 0.21])
def test_no_speed_takes_bodies_through_each_other(form: str, mach: float, aside: float) -> None:
    """Two blocks that fly at each other, each at a part of the wave speed: they part, or the run stops by name."""
    law = scenes.material("jaumann" if form == "updated-lagrangian" else "neo-hookean")
    speed = mach * float(np.sqrt(0.7 / (1.3 * 0.4)))

    def block(name: str, x: float, y: float, v: float) -> dict[str, Any]:
        return scenes.body(scenes.box((x, x + 0.5), (y, y + 0.5)), 0.1, name, velocity=[v, 0.0], material=law)

    made = scenes.scene(
        block("a", 0.0, 0.0, speed),
        block("b", 0.52, aside, -speed),
        run={"formulation": form, "end": 1.5 / speed, "cfl": "auto"},
        contact=[{"between": ["a", "b"]}],
    )
    result = wsph.run(made, throw=False)
    if result.status != "completed":
        assert "contact" in result.reason or "inside out" in result.reason
        return
    moving, body = result.field("velocity_x"), result.particles["body"]
    assert moving[body == 0].mean() < 0.0 < moving[body == 1].mean() or aside > 0.0
    kinetic = result.history["kinetic"][0]
    assert result.history["contact_numerical"].min() > -5e-3 * kinetic


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian", "updated-lagrangian"])
@pytest.mark.parametrize("law", ["surface", "tie", "pinball"])
def test_a_method_that_no_step_is_short_enough_for_is_refused_for_that(law: str, form: str) -> None:
    """And not for a time step of zero."""
    run = {"integrator": {"name": "rkc", "stages": 5}, "formulation": form, "cfl": 0.3, "end": 0.1}
    gap = 0.26 if law == "pinball" else 0.0
    scene = two(2, gap, 0.01, run=run, contact=[{"between": ["a", "b"], "law": law}])
    with pytest.raises(Refused, match="RKC amplifies every undamped wave: give the body viscosity, or use leapfrog"):
        wsph.run(scene)
