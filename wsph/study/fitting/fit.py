"""The fit itself: least squares of the residuals, their derivatives by runs side by side, and what the data leave open.

Residuals are relative to the root mean square of their column, so that columns of any units weigh the same. The covariance
of the parameters is s^2 (J^T J)^-1 at the solution, s^2 the sum of squares over its degrees of freedom: right where the
residuals are noise. Residuals that follow each other (a model that cannot be right, or a mesh) are told by their first
autocorrelation.

Source: Seber & Wild, Nonlinear Regression (1989), 2.1.2 and 5.1; the least squares are scipy's trust region with bounds
(Branch, Coleman & Li, SIAM J. Sci. Comput. 21 (1999) 1).
"""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingImports=false

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wsph.errors import OutputError
from wsph.scene.scene import Scene
from wsph.study.fitting.curves import Curves, Evaluate, Sample
from wsph.study.fitting.parameters import Parameter, starts
from wsph.study.fitting.problem import Problem

MOST = 40
"""Evaluations of the residuals before a fit gives up, beside those of derivatives."""


@dataclass(frozen=True)
class Fit:
    """A fit at its end: `parts` (p,) of the ways between the bounds, `covariance` (p, p) of those, `model` the curves there
    and `residuals` (columns, n) relative to the columns' sizes; `jacobian` (m, p) of the m residuals that
    there are. `runs` it took; `reason` why it ended, `converged` whether at a minimum."""

    parameters: tuple[Parameter, ...]
    parts: np.ndarray
    covariance: np.ndarray
    model: Sample
    residuals: np.ndarray
    jacobian: np.ndarray
    runs: int
    converged: bool
    reason: str

    @property
    def values(self) -> np.ndarray:
        """The parameters in their units (p,)."""
        return np.array([each.value(part) for each, part in zip(self.parameters, self.parts, strict=True)])

    @property
    def ranges(self) -> np.ndarray:
        """What is between the bounds, in the parameters' units (p,)."""
        return np.array([each.high - each.low for each in self.parameters])

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations of the parameters in their units, by the scatter of the data alone (p,)."""
        return np.sqrt(np.diag(self.covariance)) * self.ranges

    @property
    def correlation(self) -> np.ndarray:
        """Of the parameters (p, p)."""
        one = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(one, one)

    @property
    def scatter(self) -> np.ndarray:
        """Root mean square of the residuals of each column (columns,), relative to its size."""
        return np.sqrt(np.nanmean(self.residuals**2, axis=1))

    @property
    def following(self) -> np.ndarray:
        """The first autocorrelation of each column's residuals (columns,): near zero for noise."""
        return np.array([_autocorrelation(row[np.isfinite(row)]) for row in self.residuals])

    @property
    def at_bounds(self) -> list[str]:
        """Keys of the parameters that ended at a bound: their covariance says nothing."""
        return [
            each.key for each, part in zip(self.parameters, self.parts, strict=True) if not 1e-6 < part < 1.0 - 1e-6
        ]


def fit(scene: Scene, curves: Curves, parameters: Sequence[Parameter], evaluate: Evaluate) -> Fit:
    """Fit parameters of a scene to curves. Raises OutputError without scipy, and what runs raise."""
    try:
        from scipy.optimize import least_squares
    except ImportError:
        raise OutputError('a fit needs scipy: pip install "wsph[calibrate]"') from None
    problem = Problem(scene, curves, tuple(parameters), evaluate)
    begin = np.clip(starts(parameters), 1e-3, 1.0 - 1e-3)
    jac: Any = problem.jacobian  # which scipy's stubs take for a name
    found = least_squares(
        problem.residuals, begin, jac, bounds=(0.0, 1.0), xtol=1e-6, ftol=1e-8, gtol=1e-10, max_nfev=MOST
    )
    parts = np.asarray(found.x, float)
    jacobian, residuals = problem.jacobian(parts), problem.residuals(parts)
    free = max(len(residuals) - len(parts), 1)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * float(residuals @ residuals) / free
    model = problem.curves_at(parts)
    apart = (model.values - curves.values) / curves.sizes[:, None]
    return Fit(
        problem.parameters,
        parts,
        covariance,
        model,
        apart,
        jacobian,
        problem.runs,
        bool(found.success),
        str(found.message),
    )


def _autocorrelation(values: np.ndarray) -> float:
    size = float(values @ values)
    return float(values[1:] @ values[:-1]) / size if size > 0.0 else 0.0
