"""The surface of a body as kernels take it."""

# pyright: strict
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from functools import cache
from typing import Protocol, cast

import warp as wp

from wsph.backend.space import Array, Space


class SurfaceArrays(Protocol):
    """What kernels take of a surface, as `surface_struct` has it."""

    x: Array
    moved: Array
    speed: Array
    faces: Array
    area: Array
    size: Array
    normal: Array
    starts: Array
    around: Array
    sharp: Array


@cache
def surface_struct(space: Space) -> type:
    """Struct of a surface of n vertices and m faces, which are points in 1D, segments in 2D and triangles in 3D. All are
    nondimensional.

    x       # places now, about an origin that all bodies share, (n,) vec
    moved   # ways since the end of the last step, (n,) vec
    speed   # velocities that damping sees, (n,) vec
    faces   # vertices of the faces, outward by their order, (m, dim) int32
    area    # outward area vectors now, in 1D of length 1, (m,) vec
    size    # areas in the reference configuration, (m,) scalar
    normal  # at every corner of a face, the unit normal of the faces that meet it there smoothly, now, (m dim,) vec
    starts  # (n + 1,) int32, where the faces around each vertex begin in
    around  # (m dim,) int32
    sharp   # 1 where the faces around a vertex do not all meet smoothly, else 0, (n,) int32
    """
    vecs = dict.fromkeys(("x", "moved", "speed", "area", "normal"), wp.array(dtype=space.vec))
    ints = dict.fromkeys(("starts", "around", "sharp"), wp.array(dtype=wp.int32))
    annotations: dict[str, object] = {**vecs, **ints}
    annotations["faces"] = wp.array2d(dtype=wp.int32)
    annotations["size"] = wp.array(dtype=space.scalar)
    return cast(type, wp.struct(type("Surface", (), {"__annotations__": annotations, "__module__": __name__})))
