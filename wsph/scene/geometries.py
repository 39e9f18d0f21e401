"""The geometry that a body of a scene asks for: a mesh from a file, or a shape cut by a lattice."""

# pyright: strict

from pathlib import Path

import numpy as np

from wsph.errors import Fault, Refused, SceneError
from wsph.expressions import compile_expression
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, lattice
from wsph.geometry.meshes.files import read_mesh
from wsph.geometry.meshes.meshed import meshed
from wsph.protocols import Traits
from wsph.scene.scene import Scene
from wsph.scene.tables import Body, MeshFile


def geometry_of(scene: Scene, number: int, traits: Traits, formulation: str) -> Geometry:
    """The geometry of a scene's body, the `number`-th, for a formulation with these `traits`. Raises SceneError where the
    shape holds no cell, a crack or a map does not fit it, or a file is no mesh; Refused for what the formulation cannot
    have."""
    body = scene.bodies[number]
    if body.mesh is None:
        return _lattice(body, number, scene.run.seed, traits.splits_cracks)
    if not traits.corners:
        raise Refused(
            f'body {body.name!r}: cells of a mesh are for run.formulation = "stress-points", not for {formulation!r}; give'
            " the body a shape and a spacing"
        )
    if scene.run.support is not None:
        raise Refused(f"body {body.name!r}: points of a mesh see the corners of their own cells: leave out run.support")
    return _meshed(scene.folder, body.mesh, scene.dim, f"bodies.{number}.mesh")


def _meshed(folder: Path, table: MeshFile, dim: int, key: str) -> Geometry:
    try:
        return meshed(read_mesh(folder / table.file, dim, table.scale, table.part))
    except OSError as error:
        raise SceneError("scene", [Fault(0, f"{key}.file", str(error))]) from None
    except ValueError as error:
        raise SceneError("scene", [Fault(0, key, str(error))]) from None


def _lattice(body: Body, number: int, seed: int, split: bool) -> Lattice:
    """The lattice of a body with a shape. `split`: cracks part the particles on them."""
    if body.shape is None or body.spacing is None:
        raise TypeError("a body without a mesh has a shape and a spacing")
    cracks = tuple((crack.start, crack.end) for crack in body.cracks)
    expressions = [compile_expression(text) for text in body.map or ()]

    def mapped(points: np.ndarray) -> np.ndarray:
        return np.stack([expression(points) for expression in expressions], 1)

    try:
        return lattice(body.shape, body.spacing, body.jitter, seed, lattice_rotate=body.lattice_rotate, cracks=cracks,
                       split=split, map=mapped if expressions else None)  # fmt: skip
    except ValueError as error:
        key = "spacing" if "no cell" in str(error) else "map" if "the map" in str(error) else "cracks"
        raise SceneError("scene", [Fault(0, f"bodies.{number}.{key}", str(error))]) from None
