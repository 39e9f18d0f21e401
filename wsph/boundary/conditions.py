"""Boundary conditions of a body: which components of which particles are prescribed, and by what.

The rule at the faces of a two-set body (Herreros & Mabssout 2011, 3.2.4: essential conditions on the boundary particles):
each face prescribes one of (v_n | sigma_nn) and one of (v_t | sigma_nt) per tangent; a particle on several faces takes the
union, except that among faces in one plane what holds a component of the velocity wins; a face that nothing is said of is
free. Beside a free face a patch that is held in all components is another face: particles on its rim take the union.
Faces by name are those of the outside (`wsph.geometry.faces`): sides of holes and cracks are free unless `where` selects
them. Where
sigma_nn is prescribed the normal strain rate follows from its rate: also at a corner whose other face holds v_n (without
it a cantilever's root grows by 2e-4 a step at nu = 0.499, C <= 0.5).
"""

# pyright: strict

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from wsph.backend.domain import WHOLE, Domain, Split, any_of
from wsph.boundary.loads.acting import Load
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.motion import UNITS, Motion
from wsph.boundary.programs.prescribed import Moved, Prescribed, nonzero
from wsph.boundary.programs.windows import Windowed, holds, outside, over, windows_of, within
from wsph.boundary.slide import Slide
from wsph.boundary.tables import Boundary, Prescribing
from wsph.errors import Fault, SceneError
from wsph.expressions import constant_program
from wsph.geometry.faces import Faces
from wsph.geometry.selection import ranges, select
from wsph.geometry.shapes.stair_patches import StairPatches
from wsph.output.fields import AXES

Owned = tuple[tuple[float, float, int], ...]
"""From when and up to when [s] which boundary, by its number, prescribes a component; none at a time is of two."""


@dataclass
class Conditions:
    """Prescribed components of one body and the faces that do work.

    entries: (field, component) -> {particle: value}; owners: the same with the numbers
    of the boundaries that say so, by the windows of time in which each does.
    free_normals: bit k of (n,) where sigma_kk is prescribed; work_*: rows of (particle, axis, signed area [m^(dim-1)]) on
    faces that move or carry stress. loads: prescribed loads as forces, and inside: those of no face. acting: loads that
    follow the state, by the number of the boundary and the key in it, and where they act. mirrored (n,): how often a
    particle is there with its images across planes of symmetry, 1, 2, 4 or 8: its volume times that is a whole particle's.
    across (n,): bit k where stresses are prescribed in the frame of a face across axis k of the grid, of two-set bodies
    alone. periodic: pairs of particles (k, 2) that are one, by the key of their entry. slides: velocities along faces' own
    normals.
    """

    entries: dict[tuple[str, int], dict[int, Moved]] = field(default_factory=dict[tuple[str, int], dict[int, Moved]])
    owners: dict[tuple[str, int], dict[int, Owned]] = field(default_factory=dict[tuple[str, int], dict[int, Owned]])
    free_normals: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_particle: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_axis: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_area: np.ndarray = field(default_factory=lambda: np.zeros(0))
    loads: list[FaceLoad] = field(default_factory=list[FaceLoad])
    inside: list[FaceLoad] = field(default_factory=list[FaceLoad])
    periodic: list[tuple[str, np.ndarray]] = field(default_factory=list[tuple[str, np.ndarray]])
    slides: list[Slide] = field(default_factory=list[Slide])
    acting: list[tuple[str, Load, LoadedFaces]] = field(default_factory=list[tuple[str, Load, LoadedFaces]])
    mirrored: np.ndarray = field(default_factory=lambda: np.ones(0))
    across: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))

    @property
    def moved(self) -> bool:
        """Whether a value other than zero is prescribed anywhere."""
        slid = any(nonzero(slide.value) for slide in self.slides)
        return slid or any(nonzero(value) for values in self.entries.values() for value in values.values())

    @property
    def resisted(self) -> bool:
        """Whether there are loads that depend on velocities."""
        return any(load.resists for _, load, _ in self.acting)

    def prescribed(self, name: str, components: int, count: int) -> np.ndarray:
        """Which of the components of a field are prescribed, (count, components) bool."""
        mask = np.zeros((count, components), bool)
        for component in range(components):
            mask[list(self.entries.get((name, component), {})), component] = True
        return mask

    def free(self, count: int, dim: int, time: float | None = None) -> np.ndarray:
        """Whether a component of the velocity of a particle is free in some step of the run, or at a `time` [s], or it is
        prescribed, (count dim,) bool."""
        free = np.ones((count, dim), bool)
        for (_, component), values in self.entries.items():
            # Many particles share few values.
            held = {key: holds(value, time) for key, value in {id(value): value for value in values.values()}.items()}
            free[[particle for particle, value in values.items() if held[id(value)]], component] = False
        return free.ravel()

    def put(self, name: str, component: int, particles: np.ndarray, value: Moved, owner: int = -1) -> None:
        """Prescribe a component, by the boundary `owner`; of two values the later holds, in the steps of the run in which it
        does (`wsph.boundary.clashes` refuses what must not be)."""
        known = self.entries.setdefault((name, component), {})
        owned = self.owners.setdefault((name, component), {})
        windows = windows_of(value)
        mine = tuple((start, end, owner) for start, end in windows)
        for particle in particles.tolist():
            owned[particle] = (*mine, *outside(owned.get(particle, ()), windows))
        if not isinstance(value, Windowed):
            known.update(dict.fromkeys(particles.tolist(), value))
            return
        # One value for all particles that had one: programs are told apart by what they are.
        joined: dict[int, Prescribed] = {}
        for particle in particles.tolist():
            before = known.get(particle)
            if isinstance(before, Motion):
                raise ValueError("a motion lasts: what holds in some steps cannot come over it")
            if before is not None and id(before) not in joined:
                joined[id(before)] = over(before, value)
            known[particle] = value if before is None else joined[id(before)]


def face_component(axis: int, tangent: int) -> str:
    """The stress component on a face across `axis`, along `tangent`."""
    return "".join(AXES[k] for k in sorted((axis, tangent)))


def prescribed_velocities(scene: Prescribing, condition: Boundary) -> dict[str, Moved]:
    """The velocity components that a condition prescribes, those held at zero included."""
    held = (*condition.fixed, *([condition.symmetry] if condition.symmetry else []))
    found: dict[str, Moved] = {
        axis: in_steps(scene, condition, scene.value(value, "m/s")) for axis, value in condition.velocity.items()
    }
    for axis, value in condition.displacement.items():
        of = scene.value(value, UNITS["displacement"])
        found[axis] = Motion("displacement", of) if nonzero(of) else of
    for axis, value in condition.acceleration.items():
        found[axis] = Motion("acceleration", scene.value(value, UNITS["acceleration"]))
    return found | dict.fromkeys(held, in_steps(scene, condition, constant_program(0.0)))


def in_steps(scene: Prescribing, condition: Boundary, value: Prescribed) -> Prescribed:
    """A value of a condition in the steps of the run in which that holds."""
    return within(value, scene.windows(condition.steps)) if condition.steps else value


def velocity_key(k: int, condition: Boundary, axis: str) -> str:
    """The key of the entry k by which a component of the velocity is prescribed."""
    for key in UNITS:
        if axis in getattr(condition, key):
            return f"boundary.{k}.{key}.{axis}"
    return f"boundary.{k}.{'fixed' if axis in condition.fixed else 'symmetry'}"


def refuse_jump(value: Moved, places: np.ndarray, key: str) -> None:
    """Refuse a displacement that is not zero at the start, of particles at `places` (n, dim) [m]."""
    start = value.at_start(places) if isinstance(value, Motion) else np.zeros(1)
    if not (start == 0.0).all():
        far = float(start[np.abs(start).argmax()])
        text = f'is {far:g} m at t = 0, where the body is at rest: let it begin at zero, as in "0.001*min(t/1e-3, 1)"'
        raise SceneError("scene", [Fault(0, key, text)])


def _nothing_selected(k: int, condition: Boundary, faces: Faces, position: np.ndarray) -> SceneError:
    text = f"{condition.where!r} selects no particle of {condition.body!r}"
    if condition.where:
        text += f", whose particles have {ranges(condition.where, position)}"
    if condition.face:
        text = f"{condition.face!r} is no face of {condition.body!r}, which has {', '.join(faces.names)}"
    key = "face" if condition.face else "patch" if condition.patch else "where"
    return SceneError("scene", [Fault(0, f"boundary.{k}.{key}", text)])


def _of_patch(k: int, name: str, body: str, faces: Faces, domain: Domain) -> np.ndarray:
    """Rows of the faces of a patch."""
    elsewhere = any_of(domain, name in faces.patches)
    if name not in faces.patches and elsewhere:
        return np.zeros(len(faces.cell), bool)
    if name not in faces.patches:
        there = f"it has {', '.join(faces.patches)}"
        if not faces.patches:
            there = "particles alone have none; select by where"
        if isinstance(faces.patches, StairPatches) and name in (each.name for each in faces.patches.shape.patches()):
            there += "; no side of a cell stands for that one, in steps of this spacing: choose a smaller one"
        raise SceneError("scene", [Fault(0, f"boundary.{k}.patch", f"{body!r} has no patch {name!r}: {there}")])
    return faces.of_patch(name)


def particles_of(on: np.ndarray, count: int, split: Split | None, *, at_nodes: bool) -> np.ndarray:
    """The particles of some faces, of `count`, which are at the nodes or at the points of the body. A copy of one that
    another process owns may be on faces that are there alone: it is taken with its owner."""
    particles = np.unique(on)
    if split is None or split.domain.size == 1:
        return particles
    chosen = np.zeros(count, np.int8)
    chosen[particles] = 1
    split.domain.halo(split.particles(at_nodes=at_nodes)).fill(chosen)
    return np.flatnonzero(chosen)


def selected_conditions(
    scene: Prescribing,
    body: str,
    faces: Faces,
    spacing: float,
    position: np.ndarray,
    on: np.ndarray,
    split: Split | None = None,
) -> Iterator[tuple[int, Boundary, np.ndarray, np.ndarray]]:
    """The conditions of a body: number, condition, the particles that it selects and the rows of its `faces` (m,) bool. `on`
    (m, k) are the particles of each face, `spacing` [m], `split` the part of the body that it is. Raises SceneError where
    one selects nothing in all of it."""
    domain, at_nodes = WHOLE if split is None else split.domain, on is faces.nodes
    for k, condition in enumerate(scene.boundary):
        if condition.body != body:
            continue
        if condition.face:
            rows = faces.named(condition.face)
            particles = particles_of(on[rows], len(position), split, at_nodes=at_nodes)
        elif condition.patch:
            rows = _of_patch(k, condition.patch, body, faces, domain)
            particles = particles_of(on[rows], len(position), split, at_nodes=at_nodes)
        else:
            chosen = select(condition.where or "", position, spacing)
            particles, rows = np.flatnonzero(chosen), np.all(chosen[on], axis=1)
        if not any_of(domain, len(particles) > 0):
            raise _nothing_selected(k, condition, faces, position)
        yield k, condition, particles, rows
