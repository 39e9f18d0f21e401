"""The order in the spacing that errors of a scene can fall with, and why: 2 for smooth motions of bodies whose surface is
met, on a grid or by fitted cells, 1 for all else. An order seen is never taken to be above it."""

# pyright: strict

from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

from wsph.accuracy.planning import jumps
from wsph.plugins import traits
from wsph.protocols import Material
from wsph.scene.geometries import is_fitted
from wsph.scene.scene import Scene
from wsph.simulation.compose import stairs as stairs_of
from wsph.simulation.composing.setting import materials_of, method_of


@dataclass(frozen=True)
class Formal:
    """The formal `order`, the reasons for which it is not 2, in words, and of bodies whose surface is in steps of a cell
    why it is (`stairs`, by name); whether cells are fitted to the surface of any (`fitted`)."""

    order: float
    why: tuple[str, ...]
    stairs: dict[str, str]
    fitted: bool = False

    def __str__(self) -> str:
        if self.order == 2.0:
            return "2: the motion is smooth, and cells meet all surfaces"
        return f"{self.order:g}: {'; '.join(self.why)}"


def formal_order(scene: Scene) -> Formal:
    """The formal order of a scene. Raises what materials and formulations raise that cannot be built."""
    stairs = stairs_of(scene)
    why = (*_reasons(scene), *(f"the surface of {name!r} is {said}" for name, said in stairs.items()))
    form = method_of(scene).formulation
    return Formal(1.0 if why else 2.0, why, stairs, any(is_fitted(scene, body, form) for body in scene.bodies))


def _reasons(scene: Scene) -> Iterator[str]:
    for contact in scene.contact:
        yield f"contact {contact.name!r}"
    for tool in scene.tools:
        yield f"tool {tool.name!r} touches"
    for number, (body, material) in enumerate(zip(scene.bodies, materials_of(scene), strict=True)):
        if flows(material):
            yield f"bodies.{number} can flow ({body.material.model})"
        for part in body.parts.values():
            if part.formal < 2 and part.acts:
                yield f"bodies.{number}.{part.key}"
        for key in ("cracks", "jitter"):
            if getattr(body, key):
                yield f"bodies.{number}.{key}"
    yield from jumps.of_loads(scene)
    yield from jumps.of_motions(scene)


def flows(material: Material) -> bool:
    """Whether a law yields, or relaxes."""
    return traits.dissipates(cast(object, material))
