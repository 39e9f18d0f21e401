"""What a two-set body says of its own answers: where its stress is not what its law and its motion ask for."""

# pyright: strict

import numpy as np

from wsph.backend.domain import Domain

FALSE_STRAIN, FALSE_PART = 1e-3, 0.25
"""The strain of a rotation that small strain takes for a stretch, and its part of the largest strain, beyond which both are
warned of."""


def turned(name: str, gradient: np.ndarray, domain: Domain) -> str:
    """The words for a body that has turned beyond small strain; empty where it has not. `gradient` (m, dim, dim) is that of
    the displacements, of a part in each process of a `domain`: half of H^T H is what the symmetric part of H lacks of a strain
    that no rotation changes."""
    back = gradient.transpose(0, 2, 1)
    false, strain = 0.5 * domain.max(np.array([np.abs(back @ gradient).max(), np.abs(gradient + back).max()]))
    if not (false > FALSE_STRAIN and false > FALSE_PART * strain):
        return ""
    return (
        f"body {name!r} has turned or stretched beyond small strain: {false:.2g} of its strain of {strain:.2g} is that of its"
        ' rotation, and gives stress; use "ul-tsph", or an integrator of one set'
    )
