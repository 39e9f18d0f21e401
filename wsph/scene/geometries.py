"""The geometry that a body of a scene asks for: a mesh from a file, a shape with a fitted surface, or one in stairs."""

# pyright: strict

from pathlib import Path

import numpy as np

from wsph.errors import Fault, Refused, SceneError
from wsph.expressions import compile_expression
from wsph.geometry.fitted.fit import fit
from wsph.geometry.fitted.planning import on_grid_lines
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, lattice
from wsph.geometry.meshes.files import read_mesh
from wsph.geometry.meshes.meshed import meshed
from wsph.geometry.shapes.combined import Shape
from wsph.plugins.formulations import Formulation
from wsph.scene.scene import Scene
from wsph.scene.tables import Body

WAY_OUT = 'choose a smaller spacing, or surface = "stairs", which leaves the surface in steps of a cell'


def geometry_of(scene: Scene, number: int, formulation: Formulation) -> Geometry:
    """The geometry of a scene's body, the `number`-th, for a formulation. Raises SceneError where the shape holds no cell,
    a crack or a map does not fit it, a surface cannot be fitted, or a file is no mesh; Refused for what the formulation
    cannot have."""
    body, key = scene.bodies[number], f"bodies.{number}"
    if body.mesh is not None:
        return _from_file(scene, body, key, formulation)
    if body.shape is None or body.spacing is None:
        raise TypeError("a body without a mesh has a shape and a spacing")
    why = stairs_because(scene, body, formulation)
    if body.surface == "fitted" and why:
        raise Refused(
            f'body {body.name!r}: its surface cannot be fitted: {why}; leave that out, or write surface = "stairs"'
        )
    if not is_fitted(scene, body, formulation):
        return _lattice(body, body.shape, body.spacing, number, scene.run.seed, formulation.traits.splits_cracks)
    try:
        return meshed(fit(body.shape, body.spacing, scene.run.seed), body.shape.axes)
    except ValueError as error:
        raise SceneError("scene", [Fault(0, f"{key}.surface", f"{error}; {WAY_OUT}")]) from None


def is_fitted(scene: Scene, body: Body, formulation: Formulation) -> bool:
    """Whether the surface of a body is fitted: of one with a shape that no grid meets, by default."""
    if body.shape is None or body.surface == "stairs" or stairs_because(scene, body, formulation):
        return False
    return not on_grid_lines(body.shape)


def stairs_because(scene: Scene, body: Body, formulation: Formulation) -> str:
    """The reason for which a body with a shape has cells of a grid alone, however its surface lies; "" where it has none."""
    given = [key for key in ("jitter", "lattice_rotate", "map", "cracks") if getattr(body, key)]
    if given:
        return f"the body has {' and '.join(given)}"
    if not formulation.traits.corners:
        return f'the {formulation.name} form has no points in cells of every kind, as "stress-points" has'
    if scene.run.support is not None:
        return "run.support asks for the pairs of a kernel"
    if any(body.name in contact.names for contact in scene.contact):
        return "contact between balls needs particles of equal size"
    if scene.dim == 1 or np.ptp(np.ravel(body.spacing or 0.0)) > 0.0:
        return "it needs two or three dimensions and one spacing for all axes"
    return ""


def _from_file(scene: Scene, body: Body, key: str, formulation: Formulation) -> Geometry:
    table = body.mesh
    if table is None:
        raise TypeError("this body has no mesh")
    if not formulation.traits.corners:
        raise Refused(
            f'body {body.name!r}: cells of a mesh are for run.formulation = "stress-points", not for {formulation.name!r};'
            " give the body a shape and a spacing"
        )
    if scene.run.support is not None:
        raise Refused(f"body {body.name!r}: points of a mesh see the corners of their own cells: leave out run.support")
    if any(body.name in contact.names for contact in scene.contact):
        raise Refused(f"body {body.name!r}: contact between balls needs particles of equal size, which a mesh has not")
    try:
        return meshed(read_mesh(Path(table.file), scene.dim, table.scale, table.part))
    except OSError as error:
        raise SceneError("scene", [Fault(0, f"{key}.mesh.file", str(error))]) from None
    except ValueError as error:
        raise SceneError("scene", [Fault(0, f"{key}.mesh", str(error))]) from None


def _lattice(
    body: Body, shape: Shape, spacing: float | tuple[float, ...], number: int, seed: int, split: bool
) -> Lattice:
    """The lattice of a body with a shape. `split`: cracks part the particles on them."""
    cracks = tuple((crack.start, crack.end) for crack in body.cracks)
    expressions = [compile_expression(text) for text in body.map or ()]

    def mapped(points: np.ndarray) -> np.ndarray:
        return np.stack([expression(points) for expression in expressions], 1)

    try:
        return lattice(shape, spacing, body.jitter, seed, lattice_rotate=body.lattice_rotate, cracks=cracks,
                       split=split, map=mapped if expressions else None)  # fmt: skip
    except ValueError as error:
        key = "spacing" if "no cell" in str(error) else "map" if "the map" in str(error) else "cracks"
        raise SceneError("scene", [Fault(0, f"bodies.{number}.{key}", str(error))]) from None
