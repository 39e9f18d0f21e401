"""Particles that an expression of the reference position selects."""

# pyright: strict

import numpy as np

from wsph.expressions import compile_expression

WHERE_TOLERANCE = 1e-6
"""Points this fraction of a spacing from equality count as equal in `where`."""


def select(text: str, position: np.ndarray, spacing: float) -> np.ndarray:
    """Particles where the expression holds, (n,) bool."""
    return compile_expression(text)(position, tolerance=WHERE_TOLERANCE * spacing) != 0.0
