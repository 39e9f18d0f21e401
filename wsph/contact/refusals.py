"""What contact cannot be between, said before anything is compiled."""

# pyright: strict

from wsph.errors import Refused
from wsph.plugins.formulations import Formulation
from wsph.scene.scene import Scene


def refuse(scene: Scene, formulation: Formulation) -> None:
    """Raise Refused for bodies that contact cannot act on."""
    points = {body.name for body in scene.bodies if body.points is not None}
    for contact in scene.contact:
        if not formulation.traits.pushable:
            raise Refused(
                f"body {contact.names[0]!r}: contact pushes bodies whose particles move: use an integrator of one set, not the two"
                f" sets of {formulation.name!r}"
            )
        for name in (name for name in contact.names if name in points and contact.law != "pinball"):
            raise Refused(
                f"body {name!r}: particles without cells have no surface for contact {contact.name!r}: use contact.law ="
                ' "pinball"'
            )
    bodies = {body.name for body in scene.bodies}
    for tool in scene.tools:
        for name in (name for name in tool.against if name in bodies):
            if not formulation.traits.pushable:
                raise Refused(
                    f"body {name!r}: tool {tool.name!r} pushes bodies whose particles move: use an integrator of one set, not the"
                    f" two sets of {formulation.name!r}"
                )
            if name in points:
                raise Refused(f"body {name!r}: particles without cells have no surface for tool {tool.name!r} to touch")
