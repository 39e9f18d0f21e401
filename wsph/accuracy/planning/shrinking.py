"""Whether the steps of a run get shorter as it goes, so that it takes more of them than the step that it begins with says.

A Taylor bar takes 3 times as many, and on stress points 9 to 40 times; by how much nobody knows before a row was run.
"""

# pyright: strict

from collections.abc import Iterator

from wsph.accuracy.planning.formal import flows
from wsph.simulation.composing.composition import Composition
from wsph.simulation.composing.setting import materials_of


def shrinks(made: Composition) -> str:
    """Why, in words; empty where the time step is fixed, or nothing flows or touches: then bodies hardly deform, or their
    steps are those that were asked."""
    run = made.scene.run
    if run.cfl is None or run.guard == "off" or not any(each.stability.adapts for each in made.bodies):
        return ""
    return ", ".join(_reasons(made))


def _reasons(made: Composition) -> Iterator[str]:
    scene = made.scene
    for body, material in zip(scene.bodies, materials_of(scene), strict=True):
        if flows(material):
            yield f"{body.name!r} can flow"
    if scene.contact:
        yield "bodies touch"
    if scene.tools:
        yield "tools touch"
