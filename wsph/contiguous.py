"""Elements of contiguous arrays, for the loops over pairs.

Indexing an array takes its stride as it comes at run time and wraps indices below zero. In a loop over pairs this hides from
the compiler that a row's indices and weights lie side by side, so that it gathers them, and adds arithmetic to every gather
of a neighbour: the two loops of a step in 3D took a third longer so. Nothing checks the index or the stride here: it is for
pairs that `wsph.neighbours` made, and for arrays that were allocated whole.
"""

from functools import cache
from typing import Any

import warp as wp


@cache
def element(*dtypes: Any) -> wp.Function:
    """Warp function (contiguous array of one of `dtypes`, index) -> its element."""
    for dtype in dict.fromkeys(dtypes):

        @wp.func_native("return a.data[k];")
        def element(a: wp.array(dtype=dtype), k: int) -> dtype: ...

    return element  # pyright: ignore[reportPossiblyUnboundVariable]


@cache
def placed(dtype: Any) -> wp.Function:
    """Warp function (contiguous array of `dtype`, index, value): sets an element."""

    @wp.func_native("a.data[k] = value;")
    def placed(a: wp.array(dtype=dtype), k: int, value: dtype): ...

    return placed
