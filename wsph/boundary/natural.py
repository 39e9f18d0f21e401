"""Conditions of a one-set body: velocities of particles, and loads as forces; a free face needs nothing."""

import numpy as np

from wsph.boundary.conditions import Conditions, prescribed_velocities, selected_conditions
from wsph.errors import Fault, SceneError
from wsph.geometry.lattice import Lattice
from wsph.output.fields import AXES
from wsph.scene.scene import Scene


def layer_conditions(scene: Scene, body: str, lattice: Lattice) -> Conditions:
    """Conditions of a Lagrangian body whose particles are the cells: a face is its first layer of particles."""
    faces = lattice.faces
    return _natural_conditions(scene, body, lattice, lattice.cells, faces.cell[:, None])


def node_conditions(scene: Scene, body: str, lattice: Lattice) -> Conditions:
    """Conditions of a Lagrangian body whose particles are the nodes, those of the faces included."""
    return _natural_conditions(scene, body, lattice, lattice.nodes, lattice.faces.nodes)


def _natural_conditions(scene: Scene, body: str, lattice: Lattice, position: np.ndarray, on: np.ndarray) -> Conditions:
    """Velocities of particles, and loads as forces: a free face needs nothing. `on` (faces, k): the particles of each face.

    A stress on a face is a nominal one: force per reference area, along the axes of the shape; `traction` is along the
    coordinate axes. Loads keep faces across different axes apart, so that at an edge both act: entry ("load", face's axis *
    dim + direction), a value per unit of area, and the area in `scale`.
    """
    faces, dim = lattice.faces, scene.dim
    result = Conditions()
    result.loads = Conditions()
    for k, condition, particles, rows in selected_conditions(scene, body, lattice, position, on):
        velocities = prescribed_velocities(scene, condition)
        if velocities and len(velocities) < dim and condition.symmetry and not lattice.frame.upright:
            text = (
                f"a turned body prescribes velocities along the coordinate axes; symmetry holds none of its {dim} alone"
            )
            raise SceneError("scene", [Fault(0, f"boundary.{k}.symmetry", text)])
        for axis, value in velocities.items():
            result.put("velocity", AXES.index(axis), particles, value)
            if axis in condition.traction:
                text = f"the velocity {axis} is prescribed too: a load there moves nothing"
                raise SceneError("scene", [Fault(0, f"boundary.{k}.traction.{axis}", text)])
        if condition.stress and lattice.mapped:
            text = "faces of a mapped body turn from place to place: write traction = { x = ... }"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.stress", text)])
        if condition.stress and len(velocities) == dim:
            text = "all velocities are prescribed too: a load there moves nothing"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.stress", text)])
        for key, given in (("stress", condition.stress), ("traction", condition.traction)):
            for label, value in given.items():
                acting = rows & (np.isin(faces.axis, [AXES.index(a) for a in label]) if key == "stress" else True)
                if not acting.any():
                    text = "acts on no face selected here" + (
                        "; it is a stress on a face across one of its axes" * (key == "stress")
                    )
                    raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}.{label}", text)])
                result.loads.load(faces, on, acting, label, key == "traction", scene.value(value, "Pa"), lattice)
    return result
