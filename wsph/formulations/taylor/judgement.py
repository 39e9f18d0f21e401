"""What a two-set body says of its own answers: where its stress is not what its law and its motion ask for."""

# pyright: strict

import numpy as np

from wsph.backend.domain import Domain

FALSE_STRAIN, FALSE_PART = 1e-3, 0.25
"""The strain of a rotation that small strain takes for a stretch, and its part of the largest strain, beyond which both are
warned of."""


CLOSED = 0.1
"""Overlap of a crack's sides, in parts of the range of the displacements, from which it counts as closed: that of one that
is pressed comes to several tenths, what the front of a sudden pull leaves in extrapolated displacements to .05."""


def closed(apart: np.ndarray, places: np.ndarray, moved: np.ndarray, length: float, domain: Domain) -> str:
    """The words for cracks whose sides, `apart` (p,) by their displacements at `places` (p, dim) [m], have closed in a body
    whose particles have `moved` (n, dim), nondimensional, a part of each in every process of a `domain`; empty where none
    have. `length` [m] is the unit."""
    widest = float((domain.max(moved.max(0)) - domain.min(moved.min(0))).max())
    apart, places = domain.joined(apart), domain.joined(places)
    if apart.min() >= -CLOSED * widest:
        return ""
    where = ", ".join(f"{x:g}" for x in places[apart.argmin()])
    return (
        f"a crack closes at ({where}) m, its sides overlap by {-apart.min() * length:.3g} m: cracks of"
        " two-set bodies can only open; use two bodies with [[contact]] and an integrator of one set"
    )


def turned(name: str, gradient: np.ndarray, domain: Domain) -> str:
    """The words for a body that has turned beyond small strain; empty where it has not. `gradient` (m, dim, dim) is that of
    the displacements, a part of it in each process of a `domain`: half of H^T H is what the symmetric part of H lacks of a
    strain that no rotation changes."""
    back = gradient.transpose(0, 2, 1)
    false, strain = 0.5 * domain.max(np.array([np.abs(back @ gradient).max(), np.abs(gradient + back).max()]))
    if not (false > FALSE_STRAIN and false > FALSE_PART * strain):
        return ""
    return (
        f"body {name!r} has turned or stretched beyond small strain: {false:.2g} of its strain of {strain:.2g} is that of its"
        ' rotation, and gives stress; use "ul-tsph", or an integrator of one set'
    )
