"""Conditions of a two-set body, whose faces prescribe values."""

# pyright: strict

import numpy as np

from wsph.backend.domain import any_of
from wsph.boundary.clashes import Claims
from wsph.boundary.conditions import (
    Conditions,
    face_component,
    in_steps,
    prescribed_velocities,
    refuse_jump,
    selected_conditions,
    velocity_key,
)
from wsph.boundary.programs.prescribed import Prescribed, nonzero
from wsph.boundary.tables import Prescribing
from wsph.errors import Fault, SceneError
from wsph.expressions import constant_program
from wsph.geometry.faces import Faces
from wsph.geometry.lattice import Lattice
from wsph.output.fields import AXES


def face_conditions(scene: Prescribing, body: str, lattice: Lattice, labels: tuple[str, ...]) -> Conditions:
    """Conditions of a two-set body. `labels` are the kept stress components. Raises SceneError where one selects nothing."""
    faces, dim, n = lattice.faces, scene.dim, len(lattice.nodes)
    result, claims = Conditions(mirrored=np.ones(n)), Claims(lattice, at_nodes=True)
    moved = np.zeros((len(faces.area), dim), bool)
    loaded = np.zeros(faces.nodes.shape, bool)
    loads: list[tuple[str, np.ndarray, np.ndarray, Prescribed, str]] = []
    zero = constant_program(0.0)
    for k, condition, nodes, rows in selected_conditions(
        scene, body, faces, lattice.spacing, lattice.nodes, faces.nodes, lattice.split
    ):
        velocities = prescribed_velocities(scene, condition)
        if velocities and condition.steps:
            text = "two-set bodies hold or move a face in the whole run, or load it: use an integrator of one set"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.steps", text)])
        if condition.symmetry:
            result.mirrored[nodes] *= 2.0
        if velocities and len(velocities) < dim and not lattice.upright:
            text = f"a turned body prescribes all {dim} components of the velocity, or stresses along the axes of its shape"
            raise SceneError("scene", [Fault(0, f"boundary.{k}", text)])
        for axis, value in velocities.items():
            claims.take("velocity", AXES.index(axis), nodes, value, velocity_key(k, condition, axis))
            refuse_jump(value, lattice.nodes[nodes], velocity_key(k, condition, axis))
            result.put("velocity", AXES.index(axis), nodes, value, k)
            moved[rows, AXES.index(axis)] = True
            loaded[rows] |= nonzero(value)
        if condition.normal is not None:
            text = "two-set bodies prescribe velocities along the axes of their shape: use symmetry, or an integrator of one set"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.normal", text)])
        if condition.periodic is not None:
            text = "two-set bodies have no periodic faces: use an integrator of one set"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.periodic", text)])
        for key in condition.acting:
            text = "two-set bodies prescribe stress on their faces: use an integrator of one set"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}", text)])
        for key in (key for key in ("traction", "force") if getattr(condition, key)):
            text = "two-set bodies prescribe stress on their faces: write stress = { xx = ... }"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}", text)])
        for label, given in condition.stress.items():
            value = in_steps(scene, condition, scene.value(given, "Pa"))
            key = f"boundary.{k}.stress.{label}"
            acting = rows & np.isin(faces.axis, [AXES.index(axis) for axis in label])
            if not any_of(lattice.split.domain, bool(acting.any())):
                across = " or ".join(sorted(set(label)))
                text = f"acts on no face selected here: {label} is a stress on a face across {across}"
                raise SceneError("scene", [Fault(0, key, text)])
            claims.take("stress", labels.index(label), np.unique(faces.nodes[acting]), value, key)
            loads.append((label, acting, np.unique(faces.nodes[acting]), value, key))
            if nonzero(value):
                # At an edge of the body the same component acts on the face around the corner too.
                beside = np.isin(faces.axis, [AXES.index(axis) for axis in label])
                loaded |= beside[:, None] & np.isin(faces.nodes, faces.nodes[acting])
    for axis in range(dim):
        rows = faces.axis == axis
        # The tip of a crack lies on both its sides: it belongs to what is whole.
        tips = np.intersect1d(faces.nodes[rows & (faces.sign > 0)], faces.nodes[rows & (faces.sign < 0)])
        # The rim of a patch that is held in every direction is a corner between a held and a free face: the union.
        rim = np.intersect1d(faces.nodes[rows & moved.all(1)], faces.nodes[rows & ~moved.any(1)])
        for tangent in range(dim):
            # Elsewhere, as on the ligament beside a crack, what holds the velocity in the same plane wins.
            held = np.setdiff1d(faces.nodes[rows & moved[:, tangent]], rim)
            free = np.setdiff1d(faces.nodes[rows & ~moved[:, tangent]], np.union1d(held, tips))
            result.put("stress", labels.index(face_component(axis, tangent)), free, zero)
    for label, acting, nodes, value, key in loads:
        for axis in range(dim):
            for tangent in range(dim):
                if face_component(axis, tangent) == label and (acting & (faces.axis == axis) & moved[:, tangent]).any():
                    text = f"the face prescribes the velocity {AXES[tangent]} too; a face prescribes one of v and stress per direction"
                    raise SceneError("scene", [Fault(0, key, text)])
        result.put("stress", labels.index(label), nodes, value)
    result.across = _across(faces, moved, n)
    result.free_normals = np.zeros(n, np.int32)
    for axis in range(dim):
        stressed = np.array(sorted(result.entries.get(("stress", axis), {})), int)
        result.free_normals[stressed] |= 1 << axis
    corners = faces.nodes.shape[1]
    result.work_particle = faces.nodes[loaded].astype(np.int32)
    result.work_axis = np.repeat(faces.axis, corners)[loaded.ravel()].astype(np.int32)
    result.work_area = (faces.sign[:, None] * faces.share).ravel()[loaded.ravel()]
    return result


def _across(faces: Faces, moved: np.ndarray, count: int) -> np.ndarray:
    """Axes of the grid across which the faces lie whose frames particles take, (count,) int32, a bit each. `moved` (m, dim):
    the components of the velocity that each face prescribes.

    Faces that slide in their own plane, where a particle lies on one, because nothing turns them: in a stretched bar between
    two of them modes would grow by 4e-2 a step, in place of 9e-4, were their edges shared with the free faces. Elsewhere
    those whose normal stress is prescribed.
    """
    turning, sliding = np.zeros(count, np.int32), np.zeros(count, np.int32)
    for axis in range(moved.shape[1]):
        rows, held = faces.axis == axis, moved[:, axis]
        for bits, which in ((turning, ~held), (sliding, held & ~moved.all(1))):
            bits[np.unique(faces.nodes[rows & which])] |= 1 << axis
    sliding[sliding == 0] = turning[sliding == 0]
    return sliding
