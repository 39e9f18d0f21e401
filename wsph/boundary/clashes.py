"""Entries of a scene that prescribe one component of one particle twice.

Two selections may share a rim: the edge at which faces meet, the layer between two regions. There the later entry of the
scene holds. Where they share more, the scene contradicts itself, unless both say the same. A rim spans, at every particle of
it, fewer directions of the grid than either selection does: of two faces in 3D an edge, in 2D a corner. Of cells of no grid,
it has all the corners of no side and of no cell.
"""

# pyright: strict

from dataclasses import dataclass
from functools import cached_property
from math import prod

import numpy as np

from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.prescribed import Moved, same
from wsph.boundary.programs.windows import Windowed, meet
from wsph.errors import Fault, SceneError
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, on_grid


@dataclass(frozen=True)
class _Claim:
    key: str
    value: Moved
    particles: np.ndarray


class Claims:
    """What the entries of a scene prescribe to a body so far."""

    def __init__(self, geometry: Geometry, *, at_nodes: bool):
        self._geometry, self._at_nodes = geometry, at_nodes
        self._claims: dict[tuple[str, int], list[_Claim]] = {}

    @cached_property
    def _grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the particles are in a grid that has been numbered, (n,), and the steps (dim,) along its axes there."""
        lattice = on_grid(self._geometry)
        nodes = np.rint(lattice.index).astype(int)
        index = nodes if self._at_nodes else nodes[lattice.corners].min(1)
        index = index - index.min(0) + 1
        wide: list[int] = (index.max(0) + 2).tolist()
        steps = np.array([prod(wide[axis + 1 :]) for axis in range(len(wide))])
        return index @ steps, steps

    def take(self, name: str, component: int, particles: np.ndarray, value: Moved, key: str) -> None:
        """Note that the entry at `key` prescribes a component of a field. Raises SceneError where another says otherwise."""
        claims = self._claims.setdefault((name, component), [])
        for other in claims:
            if not same(value, other.value) and meet(value, other.value):
                self._refuse(other, _Claim(key, value, particles))
                _refuse_interrupted(other, _Claim(key, value, particles))
        claims.append(_Claim(key, value, particles))

    def _refuse(self, earlier: _Claim, later: _Claim) -> None:
        both = np.intersect1d(earlier.particles, later.particles)
        if not len(both):
            return
        if isinstance(self._geometry, Lattice):
            spans = [self._spanned(claim.particles, both) for claim in (earlier, later)]
            wide = bool((self._spanned(both, both) >= np.minimum(*spans)).any())
        else:
            wide = self._holds_a_side(both)
        if wide:
            text = (
                f"prescribes what {earlier.key} has another value for, at {len(both)} particles that both select: an edge they"
                " may share, where the later holds; select each face once, or give both the same value"
            )
            raise SceneError("scene", [Fault(0, later.key, text)])

    def _holds_a_side(self, chosen: np.ndarray) -> bool:
        """Whether some chosen nodes are all corners of a side or of a cell."""
        mask = np.zeros(len(self._geometry.nodes), bool)
        mask[chosen] = True
        rows = self._geometry.rows
        cells = np.logical_and.reduceat(mask[rows.indices], rows.offsets[:-1])
        return bool(mask[self._geometry.faces.nodes].all(1).any() or cells.any())

    def _spanned(self, chosen: np.ndarray, at: np.ndarray) -> np.ndarray:
        """How many directions of the grid some chosen particles span beside each of `at`, (len(at),)."""
        place, steps = self._grid
        there = place[chosen]
        beside = [np.isin(place[at] + step, there) | np.isin(place[at] - step, there) for step in steps]
        return np.sum(beside, axis=0)


def _refuse_interrupted(earlier: _Claim, later: _Claim) -> None:
    """Refuse what holds in some steps at an edge where a displacement or an acceleration goes on in all of them."""
    interrupts = isinstance(earlier.value, Motion) and isinstance(later.value, Windowed)
    if interrupts and np.isin(earlier.particles, later.particles).any():
        text = (
            f"holds in some steps at particles that {earlier.key} moves in the whole run: select others, write this entry before"
            " that one, or leave steps out"
        )
        raise SceneError("scene", [Fault(0, later.key, text)])
