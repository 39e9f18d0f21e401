"""Mirror images of particles as kernels take them."""

# pyright: strict

from functools import cache
from typing import Any

import warp as wp

from wsph.backend.space import Space


@cache
def images_struct(space: Space) -> type:
    """Struct of the images: pairs of particles and images in rows, the particle and the kind of every image, and of every
    kind the matrices Q and S, the place 2 (a . n) n and its rate, and the part of its velocity that is the walls'."""
    vec, mat, integer = space.vec, space.mat, wp.int32
    annotations: dict[str, Any] = {
        "offsets": wp.array(dtype=integer),
        "indices": wp.array(dtype=integer),
        "parent": wp.array(dtype=integer),
        "kind": wp.array(dtype=integer),
        "turn": wp.array(dtype=mat),
        "flip": wp.array(dtype=mat),
        "shift": wp.array(dtype=vec),
        "going": wp.array(dtype=vec),
        "drive": wp.array(dtype=vec),
    }
    made: Any = wp.struct(type("Images", (), {"__annotations__": annotations, "__module__": __name__}))
    return made
