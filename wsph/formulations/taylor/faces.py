"""Prescribed components of the real particles, as kernels take them."""

from functools import cache

import warp as wp

from wsph.backend.space import Space


@cache
def faces_struct(space: Space) -> type:
    """Struct of the prescribed components where faces keep their directions, n particles.

    held  # (n,) int32, a bit for every prescribed component: velocity first, then stress
    free  # (n,) int32, bit k where the normal stress kk is prescribed, and the normal strain rate is not known
    axes  # dim x dim, rows are the axes of the faces
    """
    annotations = {"held": wp.array(dtype=wp.int32), "free": wp.array(dtype=wp.int32), "axes": space.mat}
    return wp.struct(type("Faces", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def turning_faces_struct(space: Space) -> type:
    """Struct of the prescribed components where faces turn with the body, n particles.

    held    # as of faces that stay
    free    # as of faces that stay
    slot    # (n,) int32, which of the frames a particle has, -1 inside
    frames  # (particles on faces,) dim x dim, rows are the axes of each particle's face
    """
    annotations = dict.fromkeys(("held", "free", "slot"), wp.array(dtype=wp.int32))
    annotations["frames"] = wp.array(dtype=space.mat)
    return wp.struct(type("TurningFaces", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def replacing(space: Space, width: int) -> wp.Function:
    """Warp function (values, given, bits) -> the values, with those of `given` whose bit is set."""
    vector = space.vector(width)

    @wp.func
    def replaced(values: vector, given: vector, bits: int) -> vector:
        result = values
        for c in range(wp.static(width)):
            if (bits >> c) & 1 == 1:
                result[c] = given[c]
        return result

    return replaced
