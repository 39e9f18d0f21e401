"""Driven walls: where they are, in the state of a body."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, State, fields_struct
from wsph.boundary.conditions import Conditions
from wsph.boundary.values import BoundaryValues
from wsph.boundary.walls import Wall
from wsph.formulations.updated.images import Kind, flip_of
from wsph.sph.images import images_struct
from wsph.units import Scales

PLACE, SPEED = "wall", "wall_velocity"
"""Fields of the state: displacements and velocities of the driven walls."""


def wall_fields(space: Space) -> tuple[Field, Field]:
    """The fields of driven walls, the velocity first."""
    return Field(SPEED, space.dim, "m/s", leads=True, hidden=True), Field(PLACE, space.dim, "m", hidden=True)


def wall_values(
    space: Space, walls: list[Wall], state: State, position: np.ndarray, scales: Scales, device: str
) -> BoundaryValues:
    """The prescribed velocities of driven walls; `position` of the particles [m]."""
    conditions = Conditions()
    for k, wall in enumerate(walls):
        for component, value in wall.velocity.items():
            conditions.entries.setdefault((SPEED, component), {})[k] = value
    units = {SPEED: scales.velocity}
    return BoundaryValues(space, conditions, state, position, units, scales.time, device, (SPEED, PLACE))


@cache
def walls_struct(space: Space) -> type:
    """Struct of the walls that make every kind of image, dim slots a kind: the number of the driven wall or -1, its normal
    and its S (the identity in an empty slot); and where the images stand while no wall has moved."""
    annotations = {
        "number": wp.array(dtype=wp.int32),
        "normal": wp.array(dtype=space.vec),
        "flip": wp.array(dtype=space.mat),
        "rest": wp.array(dtype=space.vec),
    }
    return wp.struct(type("Walls", (), {"__annotations__": annotations, "__module__": __name__}))


def walls_of(space: Space, kinds: list[Kind], walls: list[Wall], rest: np.ndarray, arrays: Arrays) -> object:
    """The walls of kinds of images on the device; `rest` (kinds, dim) as in the struct."""
    dim, driven = space.dim, [wall for wall in walls if wall.driven]
    number, normal = np.full((len(kinds), dim), -1, np.int32), np.zeros((len(kinds), dim, dim))
    flip = np.tile(np.eye(dim), (len(kinds), dim, 1, 1))
    for row, kind in enumerate(kinds):
        for slot, k in enumerate(kind.walls):
            flip[row, slot] = flip_of(walls[k])
            if walls[k].driven:
                number[row, slot] = next(n for n, wall in enumerate(driven) if wall is walls[k])
                normal[row, slot] = walls[k].normal
    made = walls_struct(space)()
    made.number = arrays.of("number", number.ravel(), wp.int32)
    made.normal = arrays.of("normal", normal.reshape(-1, dim), space.vec)
    made.flip = arrays.of("flip", flip.reshape(-1, dim, dim), space.mat)
    made.rest = arrays.of("rest", rest, space.vec)
    return made


@cache
def place_images_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Where every kind of image stands and goes, and the part of its velocity that is the walls', from a state."""
    real, vec, dim, Fields = space.scalar, space.vec, space.dim, fields_struct(space, layout)
    Walls, Images = walls_struct(space), images_struct(space)

    @kernel()
    def place_images(walls: Walls, fields: Fields, images_out: Images):
        kind = wp.tid()
        shift = walls.rest[kind]
        going = vec()
        drive = vec()
        for slot in range(wp.static(dim)):
            row = kind * dim + slot
            k = walls.number[row]
            drive = walls.flip[row] * drive
            if k >= 0:
                n = walls.normal[row]
                v = fields.wall_velocity[k]
                shift += real(2.0) * wp.dot(fields.wall[k], n) * n
                going += real(2.0) * wp.dot(v, n) * n
                drive += v - walls.flip[row] * v
        images_out.shift[kind] = shift
        images_out.going[kind] = going
        images_out.drive[kind] = drive

    return place_images


@cache
def drift_walls_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Rates of the places of driven walls."""
    Fields = fields_struct(space, layout)

    @kernel()
    def drift_walls(fields: Fields, rate_out: Fields):
        rate_out.wall[wp.tid()] = fields.wall_velocity[wp.tid()]

    return drift_walls
