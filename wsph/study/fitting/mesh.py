"""What the mesh leaves open of fitted parameters.

Coarser lattices of the same scene with the fitted parameters give the error of every curve a bar (`wsph.accuracy`). A curve
that is wrong by dy draws the parameters by pinv(J) dy, J the derivatives of the fit. The shape of dy is that of the
differences of the rows of the ladder, its size that of the bar; of the rows the one that draws most counts. A parameter that
the mesh can move further than the scatter of the data does is one of the mesh.
"""

# pyright: strict

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsph.accuracy.columns import Aim, Seen, look_at
from wsph.accuracy.envelope import FEWEST, Estimate
from wsph.accuracy.measures import Record
from wsph.accuracy.planning.formal import formal_order
from wsph.accuracy.planning.lattices import Lattices
from wsph.errors import Refused
from wsph.scene.scene import Scene
from wsph.study.fitting.curves import Curves, Evaluate
from wsph.study.fitting.fit import Fit
from wsph.study.fitting.parameters import with_values

COARSER = (1.41, 2.0, 2.83)
"""How much coarser the rows beside the fit's own are."""


@dataclass(frozen=True)
class MeshBar:
    """What the mesh leaves open: `bars` (p,) of the parameters in their units, infinite without convergence and not a number
    where there is no ladder, and why in words (`reason`, else empty); the `estimates` of the curves, by name; `cells` of the
    rows, the fit's own first."""

    bars: np.ndarray
    estimates: dict[str, Estimate]
    cells: tuple[int, ...]
    reason: str = ""


def mesh_bar(scene: Scene, curves: Curves, fit: Fit, evaluate: Evaluate) -> MeshBar:
    """What the mesh leaves open of a fit of a scene: runs of coarser lattices, three where there are so many. Raises
    what runs raise."""
    fitted = with_values(scene, fit.parameters, fit.parts)
    nothing = np.full(len(fit.parts), np.nan)
    try:
        cells, coarser, spacings = _ladder(fitted)
    except Refused as error:
        return MeshBar(nothing, {}, (), str(error))
    if len(cells) < FEWEST:
        return MeshBar(
            nothing, {}, cells, f"only {len(cells)} lattices are as coarse as this or coarser: refine the scene"
        )
    rows = [each.values for each in (fit.model, *evaluate(coarser))]
    formal, aim, inverse = formal_order(fitted), Aim(0.0, "history", None), np.linalg.pinv(fit.jacobian)
    found: dict[str, Estimate] = {}
    drawn = np.zeros(len(fit.parts))
    for number, name in enumerate(curves.names):
        records = [Record(curves.times, row[number]) for row in rows]
        seen = look_at(spacings, records, aim, formal, fitted.run.precision)
        found[name] = seen.estimate
        drawn += _drawn(inverse, curves, number, rows, seen)
    return MeshBar(drawn * fit.ranges, found, cells)


def _ladder(scene: Scene) -> tuple[tuple[int, ...], list[Scene], list[float]]:
    """Cells and spacings of a scene's own lattice and of coarser ones, finest first, and the scenes of the coarser ones."""
    lattices = Lattices(scene)
    cells = [lattices.own]
    for factor in COARSER:
        coarser = lattices.below(min(lattices.own / factor, cells[-1] - 1))
        if coarser < cells[-1]:
            cells.append(coarser)
    return tuple(cells), [lattices.scene_at(n) for n in cells[1:]], [lattices.spacing(n) for n in cells]


def _drawn(inverse: np.ndarray, curves: Curves, number: int, rows: Sequence[np.ndarray], seen: Seen) -> np.ndarray:
    """How far the bar of one curve can draw the parameters, as parts of the ways between their bounds (p,); `inverse` of the
    derivatives of the residuals (p, m)."""
    if not seen.estimate.converges:
        return np.full(len(inverse), np.inf)
    there = np.isfinite(curves.values)
    ways = [np.zeros(len(inverse))]
    for k in range(1, len(rows)):
        if seen.apart[k] > 0.0:
            wrong = np.zeros(curves.values.shape)
            wrong[number] = (
                (rows[0][number] - rows[k][number]) / curves.sizes[number] * seen.estimate.bar / seen.apart[k]
            )
            ways.append(np.abs(inverse @ wrong[there]))
    return np.max(ways, axis=0)
