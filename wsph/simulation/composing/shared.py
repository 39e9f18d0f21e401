"""What processes cannot share: refused by name, before anything is made or written."""

# pyright: strict

from collections.abc import Iterator

from wsph.errors import Fault, SceneError
from wsph.scene.geometries import is_fitted
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composing.setting import Method

ALONE = "is for one process: start it without mpiexec"


def refuse_shared(scene: Scene, method: Method) -> None:
    """Raise SceneError for all of a scene that several processes cannot share."""
    found = [Fault(0, key, f"{what} {ALONE}") for key, what in _faults(scene, method)]
    if found:
        raise SceneError("scene", found)


def _faults(scene: Scene, method: Method) -> Iterator[tuple[str, str]]:
    traits = method.formulation.traits
    if not (traits.one_set and traits.reference):
        kind = "of two sets" if not traits.one_set else "that follows the motion"
        yield "run.formulation", f"the {method.formulation.name} form {kind}"
    if len(scene.bodies) > 1:
        yield "bodies", "a scene of several bodies"
    if scene.run.correction == "paper":
        yield "run.correction", "the correction of the paper"
    if scene.run.threads > 1:
        yield "run.threads", f"a run of {scene.run.threads} threads"
    for name in ("contact", "tools"):
        if getattr(scene, name):
            yield name, "what acts between bodies"
    if len(scene.bodies) > 1 and scene.sections:
        yield "sections", "a section of one of several bodies"
    if len(scene.bodies) > 1 and scene.relaxes:
        yield "relax", "a relaxation of several bodies"
    for k, body in enumerate(scene.bodies):
        yield from (
            (f"bodies.{k}.{key}" if key else f"bodies.{k}", what) for key, what in _of_body(scene, body, method)
        )


def _of_body(scene: Scene, body: Body, method: Method) -> Iterator[tuple[str, str]]:
    """What of a body: its lattice is cut into slabs, and nothing else."""
    if body.shape is None:
        yield ("mesh" if body.mesh is not None else "points"), "a body from a file"
    elif is_fitted(scene, body, method.formulation):
        yield "surface", 'a fitted surface (surface = "stairs" can be shared)'
