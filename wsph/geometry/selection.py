"""Particles that an expression of the reference position selects."""

# pyright: strict

import numpy as np

from wsph.expressions import compile_expression
from wsph.units import rounded

WHERE_TOLERANCE = 1e-6
"""Points this fraction of a spacing from equality count as equal in `where`."""


def ranges(text: str, position: np.ndarray) -> str:
    """Where particles at `position` (n, dim) [m] are along the axes that an expression uses, in words."""
    expression, axes = compile_expression(text), list(enumerate("xyz"[: position.shape[1]]))
    used = [(k, axis) for k, axis in axes if expression.uses(axis)] or axes
    ends = (rounded([position[:, k].min(), position[:, k].max()]) for k, _ in used)
    return ", ".join(f"{axis} from {low:g} to {high:g} m" for (_, axis), (low, high) in zip(used, ends, strict=True))


def select(text: str, position: np.ndarray, spacing: float) -> np.ndarray:
    """Particles where the expression holds, (n,) bool."""
    return compile_expression(text)(position, tolerance=WHERE_TOLERANCE * spacing) != 0.0
