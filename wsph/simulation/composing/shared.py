"""What processes cannot share: refused by name, before anything is made or written.

A body that cannot be cut stands beside others where it is small: then every process has all of it.
"""

# pyright: strict

from collections.abc import Iterator, Sequence

from wsph.errors import Fault, Refused, SceneError
from wsph.scene.geometries import is_fitted
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composing.setting import Method

ALONE = "is for one process: start it without mpiexec"


def refuse_shared(scene: Scene, method: Method) -> None:
    """Raise SceneError for all of a scene that several processes cannot share, of bodies where there is one alone."""
    found = list(_faults(scene, method))
    if len(scene.bodies) == 1:
        found += _of_body(scene, 0, method)
    _refuse(found)


def uncut(scene: Scene, method: Method) -> list[int]:
    """The numbers of the bodies that cannot be cut."""
    return [k for k in range(len(scene.bodies)) if any(_of_body(scene, k, method))]


def refuse_whole(scene: Scene, method: Method, cut: Sequence[bool], sizes: Sequence[int], count: int) -> None:
    """Raise SceneError for bodies that cannot be cut and have, of `sizes` particles, more than a part of the others that
    are `cut` among so many processes; Refused where none is."""
    part = sum(size for each, size in zip(cut, sizes, strict=True) if each) / count
    large = [k for k in uncut(scene, method) if sizes[k] > part]
    _refuse([fault for k in large for fault in _of_body(scene, k, method)])
    if not any(cut):
        names = ", ".join(repr(body.name) for body in scene.bodies)
        raise Refused(f"bodies {names}: each has too few particles for {count} processes: start fewer")


def _refuse(found: Sequence[tuple[str, str]]) -> None:
    if found:
        raise SceneError("scene", [Fault(0, key, f"{what} {ALONE}") for key, what in found])


def _faults(scene: Scene, method: Method) -> Iterator[tuple[str, str]]:
    traits = method.formulation.traits
    if not traits.one_set:
        yield "run.formulation", f"the {method.formulation.name} form of two sets"
    if scene.run.correction == "paper":
        yield "run.correction", "the correction of the paper"
    if len(scene.bodies) > 1 and scene.sections:
        yield "sections", "a section of one of several bodies"
    if len(scene.bodies) > 1 and scene.relaxes:
        yield "relax", "a relaxation of several bodies"


def _of_body(scene: Scene, number: int, method: Method) -> Iterator[tuple[str, str]]:
    """What of a body keeps it from being cut."""
    body = scene.bodies[number]
    for key, what in _of_table(scene, body, method):
        yield (f"bodies.{number}.{key}" if key else f"bodies.{number}"), what


def _of_table(scene: Scene, body: Body, method: Method) -> Iterator[tuple[str, str]]:
    """What of a body: parts that want cells that are alike."""
    for key in (key for key, part in body.parts.items() if part.acts and part.alike):
        if body.mesh is not None:
            yield key, f"{key} in the cells of a mesh"
        elif body.shape is not None and is_fitted(scene, body, method.formulation):
            yield key, f'{key} in the cells of a fitted surface (surface = "stairs" can be shared)'
