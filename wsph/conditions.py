"""Boundary conditions of a body: which components of which particles are prescribed, and by what.

The rule at the faces of a two-set body (Herreros & Mabssout 2011, 3.2.4: essential conditions on the boundary particles):
each face prescribes one of (v_n | sigma_nn) and one of (v_t | sigma_nt) per tangent; a particle on several faces takes the
union, except that among faces in one plane what holds the velocity wins; a face that nothing is said of is free. The faces
of a box by name are those of its outside: sides of holes and cracks are free unless `where` selects them. Where sigma_nn is
prescribed the normal strain rate follows from its rate: also at a corner whose other face holds v_n (without it a
cantilever's root grows by 2e-4 a step at nu = .499, C <= .5).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from wsph.errors import Fault, SceneError
from wsph.expressions import Expression, compile_expression, constant_program
from wsph.fields import AXES
from wsph.particles import Faces, Lattice
from wsph.scene import Boundary, Function, Scene

Prescribed = Expression | Function
WHERE_TOLERANCE = 1e-6
"""Points this fraction of a spacing from equality count as equal in `where`."""


@dataclass
class Conditions:
    """Prescribed components of one body and the faces that do work.

    entries: (field, component) -> {particle: value}; free_normals: bit k of (n,) where sigma_kk is prescribed; work_*: rows
    of (particle, axis, signed area [m^(dim-1)]) on faces that move or carry stress. mirrored (n,): how often a particle is
    there with its images across planes of symmetry, 1, 2, 4 or 8: its volume times that is a whole particle's.
    """

    entries: dict[tuple[str, int], dict[int, Prescribed]] = field(default_factory=dict)
    free_normals: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_particle: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_axis: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_area: np.ndarray = field(default_factory=lambda: np.zeros(0))
    loads: "Conditions | None" = None
    mirrored: np.ndarray = field(default_factory=lambda: np.ones(0))
    scales: dict[tuple[str, int], dict[int, float]] = field(default_factory=dict)

    def put(self, name: str, component: int, particles: np.ndarray, value: Prescribed) -> None:
        """Prescribe a component; what was said later holds."""
        self.entries.setdefault((name, component), {}).update(dict.fromkeys(particles.tolist(), value))

    def load(self, faces: Faces, on: np.ndarray, acting: np.ndarray, label: str, traction: bool, value: Prescribed,
             lattice: Lattice) -> None:  # fmt: skip
        """A stress component, or a traction along a coordinate axis, on the faces `acting`, as forces on their particles."""
        dim, axes = lattice.frame.axes.shape[0], lattice.frame.axes
        for axis in range(dim):
            rows = acting & (faces.axis == axis)
            if not rows.any():
                continue
            if traction:
                pushes = [(AXES.index(label), 1.0)]
            else:
                i, j = (AXES.index(a) for a in label)
                along = j if axis == i else i
                pushes = [(k, float(axes[k, along])) for k in range(dim) if axes[k, along] != 0.0]
            share = faces.area[rows] / on.shape[1] * (1.0 if traction else faces.sign[rows])
            for direction, cosine in pushes:
                key = ("load", axis * dim + direction)
                area = np.bincount(on[rows].ravel(), np.repeat(share, on.shape[1]))
                particles = np.flatnonzero(area)
                self.put(*key, particles, value)
                self.scales.setdefault(key, {}).update(
                    dict(zip(particles.tolist(), (area[particles] * cosine).tolist(), strict=True))
                )


def select(text: str, position: np.ndarray, spacing: float) -> np.ndarray:
    """Particles where the expression holds, (n,) bool."""
    return compile_expression(text)(position, tolerance=WHERE_TOLERANCE * spacing) != 0.0


def nonzero(value: Prescribed) -> bool:
    """Whether a prescribed value is anything but the constant zero."""
    return not (isinstance(value, Expression) and value.program == constant_program(0.0).program)


def _label(axis: int, tangent: int) -> str:
    """The stress component on a face across `axis`, along `tangent`."""
    return "".join(AXES[k] for k in sorted((axis, tangent)))


def _velocities(scene: Scene, condition: Boundary) -> dict[str, Prescribed]:
    """The velocity components that a condition prescribes, those held at zero included."""
    held = (*condition.fixed, *([condition.symmetry] if condition.symmetry else []))
    moved = {axis: scene.value(value, "m/s") for axis, value in condition.velocity.items()}
    return moved | dict.fromkeys(held, constant_program(0.0))


def _nothing_selected(k: int, condition: Boundary) -> SceneError:
    key, text = ("where", condition.where) if condition.where else ("face", condition.face)
    return SceneError("scene", [Fault(0, f"boundary.{k}.{key}", f"{text!r} selects no particle of {condition.body!r}")])


def _selected(
    scene: Scene, body: str, lattice: Lattice, position: np.ndarray, on: np.ndarray
) -> Iterator[tuple[int, Boundary, np.ndarray, np.ndarray]]:
    """The conditions of a body: number, condition, the particles that it selects and the rows of the faces (m,) bool. `on`
    (m, k) are the particles of each face. Raises SceneError where one selects nothing."""
    for k, condition in enumerate(scene.boundary):
        if condition.body != body:
            continue
        if condition.face:
            rows = lattice.faces.named(condition.face)
            particles = np.unique(on[rows])
        else:
            chosen = select(condition.where or "", position, lattice.spacing)
            particles, rows = np.flatnonzero(chosen), chosen[on].all(1)
        if not len(particles):
            raise _nothing_selected(k, condition)
        yield k, condition, particles, rows


def face_conditions(scene: Scene, body: str, lattice: Lattice, labels: tuple[str, ...]) -> Conditions:
    """Conditions of a two-set body. `labels` are the kept stress components. Raises SceneError where one selects nothing."""
    faces, dim, n = lattice.faces, scene.dim, len(lattice.nodes)
    result = Conditions(mirrored=np.ones(n))
    moved = np.zeros((len(faces.area), dim), bool)
    loaded = np.zeros(faces.nodes.shape, bool)
    loads: list[tuple[str, np.ndarray, np.ndarray, Prescribed, str]] = []
    zero = constant_program(0.0)
    for k, condition, nodes, rows in _selected(scene, body, lattice, lattice.nodes, faces.nodes):
        velocities = _velocities(scene, condition)
        if condition.symmetry:
            result.mirrored[nodes] *= 2.0
        if velocities and len(velocities) < dim and not lattice.frame.upright:
            text = f"a turned body prescribes all {dim} components of the velocity, or stresses along the axes of its shape"
            raise SceneError("scene", [Fault(0, f"boundary.{k}", text)])
        for axis, value in velocities.items():
            result.put("velocity", AXES.index(axis), nodes, value)
            moved[rows, AXES.index(axis)] = True
            loaded[rows] |= nonzero(value)
        if condition.traction:
            text = "two-set bodies prescribe stress on their faces: write stress = { xx = ... }"
            raise SceneError("scene", [Fault(0, f"boundary.{k}.traction", text)])
        for label, given in condition.stress.items():
            value, key = scene.value(given, "Pa"), f"boundary.{k}.stress.{label}"
            acting = rows & np.isin(faces.axis, [AXES.index(axis) for axis in label])
            if not acting.any():
                across = " or ".join(sorted(set(label)))
                text = f"acts on no face selected here: {label} is a stress on a face across {across}"
                raise SceneError("scene", [Fault(0, key, text)])
            loads.append((label, acting, np.unique(faces.nodes[acting]), value, key))
            if nonzero(value):
                # At an edge of the body the same component acts on the face around the corner too.
                beside = np.isin(faces.axis, [AXES.index(axis) for axis in label])
                loaded |= beside[:, None] & np.isin(faces.nodes, faces.nodes[acting])
    for axis in range(dim):
        rows = faces.axis == axis
        # The tip of a crack lies on both its sides: it belongs to what is whole.
        tips = np.intersect1d(faces.nodes[rows & (faces.sign > 0)], faces.nodes[rows & (faces.sign < 0)])
        for tangent in range(dim):
            # Where a face in the same plane holds the velocity, as on the ligament beside a crack, that wins.
            held = faces.nodes[rows & moved[:, tangent]]
            free = np.setdiff1d(faces.nodes[rows & ~moved[:, tangent]], np.union1d(held, tips))
            result.put("stress", labels.index(_label(axis, tangent)), free, zero)
    for label, acting, nodes, value, key in loads:
        for axis in range(dim):
            for tangent in range(dim):
                if _label(axis, tangent) == label and (acting & (faces.axis == axis) & moved[:, tangent]).any():
                    text = f"the face prescribes the velocity {AXES[tangent]} too; a face prescribes one of v and stress per direction"
                    raise SceneError("scene", [Fault(0, key, text)])
        result.put("stress", labels.index(label), nodes, value)
    result.free_normals = np.zeros(n, np.int32)
    for axis in range(dim):
        stressed = np.array(sorted(result.entries.get(("stress", axis), {})), int)
        result.free_normals[stressed] |= 1 << axis
    corners = faces.nodes.shape[1]
    result.work_particle = faces.nodes[loaded].astype(np.int32)
    result.work_axis = np.repeat(faces.axis, corners)[loaded.ravel()].astype(np.int32)
    result.work_area = np.repeat(faces.sign * faces.area / corners, corners)[loaded.ravel()]
    return result


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
    for k, condition, particles, rows in _selected(scene, body, lattice, position, on):
        velocities = _velocities(scene, condition)
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
