"""The kinds of scenes that the table of schemes has: whether bodies meet, yield or break, and whether something jumps."""

# pyright: strict

from wsph.accuracy.planning.formal import flows
from wsph.accuracy.planning.jumps import of_loads, of_motions
from wsph.scene.scene import Scene
from wsph.simulation.composing.setting import materials_of


def kind_of(scene: Scene) -> str:
    """The kind of a scene."""
    if scene.contact or scene.tools:
        return "contact"
    yields = any(flows(material) for material in materials_of(scene))
    breaks = any(part.breaks for body in scene.bodies for part in body.parts.values())
    jumps = any(True for _ in (*of_loads(scene), *of_motions(scene)))
    if scene.dim == 1:
        return "plastic-1d" if yields else "wave-1d" if jumps else "smooth-1d"
    return "plastic" if yields or breaks else "struck" if jumps else "smooth"
