"""Reductions of device arrays to numbers on the host: the one room for them.

Kernels sum up blocks of BLOCK rows, a thread each, and the host the blocks, in their order: so a sum has the same bits for
any number of threads. The numbers of all parts of a scene are then put together by its `wsph.backend.domain.Domain`.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import numpy as np

from wsph.backend.domain import WHOLE, Domain
from wsph.backend.space import Array

BLOCK = 1024
"""Rows that one thread sums up."""


def blocks(n: int) -> int:
    """Blocks of `n` rows."""
    return -(-n // BLOCK)


def total(values: Array, domain: Domain = WHOLE) -> float:
    """The sum of an array (n,), in double precision."""
    return float(domain.sum(np.asarray(values.numpy().sum(dtype=np.float64))))


def totals(values: Array, domain: Domain = WHOLE) -> np.ndarray:
    """The sums over the rows of an array (n, k), (k,), in double precision."""
    return domain.sum(np.array([column.sum(dtype=np.float64) for column in values.numpy().T]))


def largest(values: Array, domain: Domain = WHOLE) -> float:
    """The largest element of an array (n,); NaN where any is."""
    return float(domain.max(np.asarray(values.numpy().max())))
