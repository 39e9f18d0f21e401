"""What a two-set body says of its own answers: where its stress is not what its law and its motion ask for."""

# pyright: strict

import numpy as np

from wsph.boundary.conditions import Conditions
from wsph.constitutive.constitutive import Constitutive

FALSE_STRAIN, FALSE_PART = 1e-3, 0.25
"""The strain of a rotation that small strain takes for a stretch, and its part of the largest strain, beyond which both are
warned of."""


def face_warnings(name: str, dim: int, constitutive: Constitutive, conditions: Conditions) -> tuple[str, ...]:
    """The warning of a body whose stress returns to a yield surface at particles a normal of which is prescribed: the strain
    along that normal is the elastic one, and what the return leaves there is set to the prescribed stress."""
    returns = constitutive.laws.project is not None and not constitutive.state.free and dim > 1
    if not returns or not conditions.free_normals.any():
        return ()
    return (
        f"body {name!r}: where it yields beside free and loaded faces, stresses of a law that returns to a yield surface come"
        ' out up to 30 % off in two-set forms; use a law whose flow is a rate ("perzyna"), or "stress-points"',
    )


def turned(name: str, gradient: np.ndarray) -> str:
    """The words for a body that has turned beyond small strain; empty where it has not. `gradient` (m, dim, dim) is that of
    the displacements: half of H^T H is what the symmetric part of H lacks of a strain that no rotation changes."""
    false = 0.5 * np.abs(gradient.transpose(0, 2, 1) @ gradient).max()
    strain = 0.5 * np.abs(gradient + gradient.transpose(0, 2, 1)).max()
    if not (false > FALSE_STRAIN and false > FALSE_PART * strain):
        return ""
    return (
        f"body {name!r} has turned or stretched beyond small strain: {false:.2g} of its strain of {strain:.2g} is that of its"
        ' rotation, and gives stress; use "ul-tsph", or an integrator of one set'
    )
