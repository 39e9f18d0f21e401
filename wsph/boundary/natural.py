"""Conditions of a one-set body: velocities of particles, and loads as forces; a free face needs nothing."""

# pyright: strict

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from wsph.backend.domain import Split, any_of
from wsph.boundary.clashes import Claims
from wsph.boundary.conditions import (
    Conditions,
    in_steps,
    prescribed_velocities,
    refuse_jump,
    selected_conditions,
    velocity_key,
)
from wsph.boundary.loads.acting import Load
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.boundary.loads.rows import FORCE, FaceLoad, stress_load, total_load, traction_load
from wsph.boundary.periodic import partners
from wsph.boundary.programs.prescribed import Prescribed
from wsph.boundary.slide import Slide
from wsph.boundary.tables import Boundary, Prescribing
from wsph.boundary.walls import Wall, Walls
from wsph.errors import Fault, SceneError
from wsph.geometry.faces import Faces
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice
from wsph.output.fields import AXES


def layer_conditions(scene: Prescribing, body: str, lattice: Geometry) -> Conditions:
    """Conditions of a Lagrangian body whose particles are the cells: a face is its first layer of particles."""
    faces = lattice.faces
    return _natural_conditions(scene, body, lattice, lattice.cells, faces.cell[:, None])


def wall_conditions(scene: Prescribing, body: str, lattice: Lattice) -> tuple[Conditions, list[Wall]]:
    """Conditions of a body whose particles are the cells and have images behind its walls, and the walls: their velocities
    are prescribed to no particle."""
    walls, on, taken = Walls(lattice, body), lattice.faces.cell[:, None], set[int]()
    chosen = list(selected_conditions(scene, body, lattice.sides, lattice.spacing, lattice.cells, on, lattice.split))
    for k, condition, particles, rows in chosen:
        velocity = {AXES.index(axis): value for axis, value in prescribed_velocities(scene, condition).items()}
        if velocity and not condition.steps and walls.take(k, condition, particles, rows, velocity):
            taken.add(k)
    for k, condition, particles, rows in chosen:
        velocity = {AXES.index(axis): value for axis, value in prescribed_velocities(scene, condition).items()}
        axes = set(lattice.split.domain.joined(np.unique(lattice.faces.axis[rows])).tolist())
        on_faces = len(axes) == 1 and walls.across(particles, rows) == list(axes)
        if velocity and not condition.steps and k not in taken and on_faces:
            taken |= {k} if walls.join(k, axes.pop(), rows, velocity) else set()
    return _natural_conditions(scene, body, lattice, lattice.cells, on, taken), walls.found()


def node_conditions(scene: Prescribing, body: str, geometry: Geometry) -> Conditions:
    """Conditions of a Lagrangian body whose particles are the nodes, those of the faces included."""
    return _natural_conditions(scene, body, geometry, geometry.nodes, geometry.faces.nodes)


def _natural_conditions(
    scene: Prescribing,
    body: str,
    geometry: Geometry,
    position: np.ndarray,
    on: np.ndarray,
    walls: Collection[int] = (),
) -> Conditions:
    """Velocities of particles, and loads as forces: a free face needs nothing. `on` (faces, k): the particles of each face.

    A stress on a face is a nominal one: force per reference area, along the axes of the shape; `traction` is along the
    coordinate axes. All loads add. The velocities of the conditions `walls`, by their numbers, are prescribed to no
    particle.
    """
    faces, dim = geometry.sides, scene.dim
    result, claims = Conditions(), Claims(geometry, at_nodes=position is geometry.nodes)
    domain = geometry.split.domain
    chosen = selected_conditions(scene, body, faces, geometry.spacing, position, on, geometry.split)
    for k, condition, particles, rows in chosen:
        velocities = prescribed_velocities(scene, condition)
        _refuse_steps(k, condition)
        if velocities and len(velocities) < dim and condition.symmetry and not geometry.upright:
            text = (
                f"a turned body prescribes velocities along the coordinate axes; symmetry holds none of its {dim} alone"
            )
            raise SceneError("scene", [Fault(0, f"boundary.{k}.symmetry", text)])
        _refuse_oblique(k, condition, faces, rows)
        for axis, value in velocities.items():
            claims.take("velocity", AXES.index(axis), particles, value, velocity_key(k, condition, axis))
            refuse_jump(value, position[particles], velocity_key(k, condition, axis))
            if k not in walls:
                result.put("velocity", AXES.index(axis), particles, value, k)
            for key in (key for key in ("traction", "force") if axis in getattr(condition, key)):
                text = f"the velocity {axis} is prescribed too: a load there moves nothing"
                raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}.{axis}", text)])
        mapped = isinstance(geometry, Lattice) and geometry.mapped
        if condition.stress and (mapped or (faces.axis[rows] < 0).any()):
            text = "faces turn from place to place: write traction = { x = ... } along the coordinate axes, or pressure"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.stress", text)])
        if condition.stress and len(velocities) == dim:
            text = "all velocities are prescribed too: a load there moves nothing"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.stress", text)])
        if condition.periodic is not None:
            key = f"boundary.{k}.periodic"
            if position is not geometry.nodes:
                text = 'needs particles on the faces: use "stress-points", or "total-lagrangian" with pairs along edges'
                raise SceneError("scene", [Fault(0, key, text)])
            pairs = partners(key, condition.periodic, particles, geometry)
            result.periodic.append((key, pairs))
        if condition.normal is not None:
            slid = _slide(f"boundary.{k}.normal", scene.value(condition.normal, "m/s"), geometry, on, rows)
            result.slides.append(replace(slid, owner=k))
        for key, load in condition.acting.items():
            if not any_of(domain, bool(rows.any())):
                raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}", "acts on no face selected here")])
            along = condition.normal is not None and load.by_corners
            if len(velocities) == dim or along:
                held = "all velocities are" if not along else "the velocity along the normals is"
                text = f"{held} prescribed too: a load there moves nothing"
                raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}", text)])
            if (load.by_corners or load.on_faces) and position is not geometry.nodes:
                text = (
                    'needs particles on the faces: use "stress-points", "total-lagrangian" with pairs along edges, or a body'
                    f' with placement = "nodes"{"; or " * bool(load.otherwise)}{load.otherwise}'
                )
                raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}", text)])
            result.acting.append((f"{k}.{key}", load, loaded_faces(scene, condition, load, geometry, on, rows)))
        for key, load in prescribed_loads(scene, condition, geometry, on, rows):
            if not any_of(domain, len(load.particle) > 0):
                text = "acts on no face selected here" + (
                    "; it is a stress on a face across one of its axes" * key.startswith("stress")
                    + "; inside of a body write [bodies.body_force], a force per volume" * key.startswith("force")
                )
                raise SceneError("scene", [Fault(0, f"boundary.{k}.{key}", text)])
            result.loads.append(replace(load, owner=k))
    return result


def _refuse_steps(k: int, condition: Boundary) -> None:
    """Refuse what cannot begin or end with a step of the run: motions that are measured from its start, what slides or is
    one with another face, and loads without a value."""
    moving = [key for key in ("displacement", "acceleration") if getattr(condition, key)]
    lasting = [key for key, load in condition.acting.items() if not load.values]
    lasting += [key for key in ("normal", "periodic") if getattr(condition, key) is not None]
    if condition.steps and (moving or lasting):
        text = f"{(moving or lasting)[0]} holds in the whole run: write it in an entry without steps"
        text += ", or its velocity, which may have them" * bool(moving)
        raise SceneError("scene", [Fault(0, f"boundary.{k}.steps", text)])


def _refuse_oblique(k: int, condition: Boundary, faces: Faces, rows: np.ndarray) -> None:
    """Refuse symmetry on faces that are no planes across an axis: curved and slanted ones."""
    if condition.symmetry and not condition.where and (faces.axis[rows] < 0).any():
        text = (
            f"faces selected here lie across no axis: write normal = 0, which slides along them,"
            f' or fixed = ["{condition.symmetry}"]'
        )
        raise SceneError("scene", [Fault(0, f"boundary.{k}.symmetry", text)])


def _slide(key: str, value: Prescribed, geometry: Geometry, on: np.ndarray, rows: np.ndarray) -> Slide:
    """A velocity along the normals of some faces, by their particles."""
    split, faces = geometry.split, geometry.sides
    if not any_of(split.domain, bool(rows.any())):
        raise SceneError("scene", [Fault(0, key, "acts on no face selected here")])
    vector = _vectors(faces, on, rows)
    particle, where = np.unique(on[rows].ravel(), return_inverse=True)
    dim = vector.shape[2]
    total = np.stack([np.bincount(where.ravel(), vector[..., k].ravel(), len(particle)) for k in range(dim)], 1)
    if split.domain.size > 1:
        particle, total = _as_owned(particle, total, split, at_nodes=on is faces.nodes)
    size = np.linalg.norm(total, axis=1, keepdims=True)
    if not (size > 0.0).all():
        raise SceneError("scene", [Fault(0, key, "selects two sides of one place, which have no normal in common")])
    return Slide(key, value, particle, total / size)


def _as_owned(
    particle: np.ndarray, total: np.ndarray, split: Split, *, at_nodes: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Particles of faces (k,) and sums over these (k, dim), as the owners of the particles have them."""
    share = split.particles(at_nodes=at_nodes)
    every = np.zeros((share.held, 1 + total.shape[1]))
    every[particle, 0], every[particle, 1:] = 1.0, total
    split.domain.halo(share).fill(every)
    chosen = np.flatnonzero(every[:, 0])
    return chosen, every[chosen, 1:]


def prescribed_loads(
    scene: Prescribing, condition: Boundary, geometry: Geometry, on: np.ndarray, rows: np.ndarray
) -> Iterator[tuple[str, FaceLoad]]:
    """The stresses and tractions of a condition on the faces `rows` (m,) bool, by their keys in it. `on` (m, k): the
    particles of each face."""
    faces = geometry.sides
    for label, value in condition.stress.items():
        program = in_steps(scene, condition, scene.value(value, "Pa"))
        yield f"stress.{label}", stress_load(faces, on, rows, label, program, geometry)
    for axis, value in condition.traction.items():
        program = in_steps(scene, condition, scene.value(value, "Pa"))
        yield f"traction.{axis}", traction_load(faces, on, rows, axis, program, scene.dim)
    for axis, value in condition.force.items():
        program = in_steps(scene, condition, scene.value(value, FORCE[scene.dim]))
        yield f"force.{axis}", total_load(geometry, on, rows, axis, program, scene.dim)


def loaded_faces(
    scene: Prescribing,
    condition: Boundary,
    load: Load,
    geometry: Geometry,
    on: np.ndarray,
    rows: np.ndarray,
) -> LoadedFaces:
    """The faces `rows` (m,) bool as a load of a condition that follows the state has them, SI. `on` (m, k): the particles of
    each face, its nodes or its cell."""
    faces, split = geometry.sides, geometry.split
    at_nodes = on is faces.nodes
    position = geometry.nodes if at_nodes else geometry.cells
    n, dim = position.shape
    given = {name: scene.value(getattr(load, name), unit) for name, unit in load.values.items()}
    values = {name: in_steps(scene, condition, value) for name, value in given.items()}
    vector = _vectors(faces, on, rows)
    flat = on[rows].ravel()
    area = np.bincount(flat, faces.shares(on)[rows].ravel(), n).astype(float)  # of none it is of integers
    particle = np.unique(flat)
    mean = np.stack([np.bincount(flat, vector[..., k].ravel(), n) for k in range(dim)], 1)[particle].astype(float)
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    normal = np.divide(mean, size, out=np.zeros_like(mean), where=size > 0.0)
    share = split.particles(at_nodes=at_nodes)
    return LoadedFaces(particle, area[particle], normal, on[rows], vector, position, values, share, split.domain)


def _vectors(faces: Faces, on: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The integrals of N_j n over some faces, by their nodes or, where one particle stands for each, whole."""
    whole = on.shape[1] == faces.vector.shape[1]
    return faces.vector[rows] if whole else faces.vector[rows].sum(1, keepdims=True)
