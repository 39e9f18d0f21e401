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
    """Raise Refused where none of the bodies is `cut` among so many processes."""
    if not any(cut):
        names = ", ".join(repr(body.name) for body in scene.bodies)
        raise Refused(f"bodies {names}: each has too few particles for {count} processes: start fewer")


def _faults(scene: Scene, method: Method) -> Iterator[tuple[str, str]]:
    if scene.run.correction == "paper":
        yield "run.correction", "the correction of the paper"
