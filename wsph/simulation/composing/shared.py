"""What processes cannot share: refused by name, before anything is made or written.

A body that has too few particles to be cut stands beside others: then every process has all of it.
"""

# pyright: strict

from collections.abc import Iterator, Sequence

from wsph.errors import Fault, Refused, SceneError
from wsph.scene.scene import Scene
from wsph.simulation.composing.setting import Method

ALONE = "is for one process: start it without mpiexec"


def refuse_shared(scene: Scene, method: Method) -> None:
    """Raise SceneError for what of a scene several processes cannot share."""
    if found := list(_faults(scene, method)):
        raise SceneError("scene", [Fault(0, key, f"{what} {ALONE}") for key, what in found])


def refuse_whole(scene: Scene, cut: Sequence[bool], count: int) -> None:
    """Raise Refused where none of the bodies is `cut` among so many processes, or one that breaks and is in contact is."""
    if not any(cut):
        names = ", ".join(repr(body.name) for body in scene.bodies)
        raise Refused(f"bodies {names}: each has too few particles for {count} processes: start fewer")
    touched = {name for part in scene.contact if part.law != "pinball" for name in part.names}
    touched |= {name for tool in scene.tools for name in tool.against}
    for body, among in zip(scene.bodies, cut, strict=True):
        breaks = any(part.breaks and part.acts for part in body.parts.values())
        if among and breaks and body.name in touched:
            raise Refused(f"body {body.name!r}: contact, a tie or a tool on a surface that can break {ALONE}")


def _faults(scene: Scene, method: Method) -> Iterator[tuple[str, str]]:
    if scene.run.correction == "paper":
        yield "run.correction", "the correction of the paper"
