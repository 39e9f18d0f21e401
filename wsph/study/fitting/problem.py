"""The problem of least squares that a fit is: residuals and their derivatives, by runs."""

# pyright: strict

from collections.abc import Sequence

import numpy as np

from wsph.scene.scene import Scene
from wsph.study.fitting.curves import Curves, Evaluate, Sample
from wsph.study.fitting.parameters import Parameter, with_values

STEP = 1e-3
"""Step of derivatives, as a part of the way between the bounds of a parameter."""


class Problem:
    """Residuals and their derivatives as functions of the parameters, each set of runs made once."""

    def __init__(self, scene: Scene, curves: Curves, parameters: tuple[Parameter, ...], evaluate: Evaluate):
        self.parameters, self.runs = parameters, 0
        self._scene, self._curves, self._evaluate = scene, curves, evaluate
        self._there = np.isfinite(curves.values)
        self._known: dict[bytes, Sample] = {}

    def residuals(self, parts: np.ndarray) -> np.ndarray:
        """Of the values that there are, relative to their columns' sizes (m,)."""
        return self._relative(self.curves_at(parts).values - self._curves.values)

    def jacobian(self, parts: np.ndarray) -> np.ndarray:
        """Derivatives of the residuals by the parts (m, p), by central differences; by one-sided ones at a bound."""
        around = [self._moved(parts, k, sign) for k in range(len(parts)) for sign in (1.0, -1.0)]
        made = self._made(around)
        columns = [
            self._relative(made[2 * k].values - made[2 * k + 1].values) / (around[2 * k][k] - around[2 * k + 1][k])
            for k in range(len(parts))
        ]
        return np.array(columns).T

    def curves_at(self, parts: np.ndarray) -> Sample:
        """The curves of a run."""
        return self._made([parts])[0]

    def _made(self, wanted: Sequence[np.ndarray]) -> list[Sample]:
        missing = {each.tobytes(): each for each in wanted if each.tobytes() not in self._known}
        scenes = [with_values(self._scene, self.parameters, each) for each in missing.values()]
        self._known.update(zip(missing, self._evaluate(scenes), strict=True))
        self.runs += len(missing)
        return [self._known[each.tobytes()] for each in wanted]

    def _relative(self, apart: np.ndarray) -> np.ndarray:
        return (apart / self._curves.sizes[:, None])[self._there]

    def _moved(self, parts: np.ndarray, k: int, sign: float) -> np.ndarray:
        moved = np.array(parts, float)
        moved[k] = np.clip(moved[k] + sign * STEP, 0.0, 1.0)
        return moved
