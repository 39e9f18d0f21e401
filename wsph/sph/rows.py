"""Rows of pairs as kernels take them."""

# pyright: strict

from functools import cache
from typing import Any

import warp as wp

from wsph.backend.space import Array, Space
from wsph.sph.pairs import Pairs


@cache
def rows_struct(space: Space, vectors: bool = False) -> type:
    """Struct of the pairs of every target and a weight for each: row i is what stands at `offsets[i]` to `offsets[i + 1]`.

    offsets  # (targets + 1,) int32
    indices  # sources, (pairs,) int32
    weight   # (pairs,) scalar, or vec where `vectors`
    """
    annotations: dict[str, Any] = {
        "offsets": wp.array(dtype=wp.int32),
        "indices": wp.array(dtype=wp.int32),
        "weight": wp.array(dtype=space.vec if vectors else space.scalar),
    }
    made: Any = wp.struct(type("Rows", (), {"__annotations__": annotations, "__module__": __name__}))
    return made


def rows_of(space: Space, pairs: Pairs, weight: Array | None = None) -> object:
    """The rows of `pairs` with `weight` (pairs,), scalars or vectors; without one where a kernel takes the pairs alone."""
    vectors = weight is not None and weight.dtype is space.vec
    rows = rows_struct(space, vectors)()
    rows.offsets, rows.indices = pairs.offsets, pairs.indices
    if weight is not None:
        rows.weight = weight
    return rows
