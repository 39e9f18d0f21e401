"""What processes that share a scene keep of a run in memory, to go on with other parts of it."""

# pyright: strict

from collections.abc import Mapping, Sequence

import numpy as np

from wsph.backend.domain import Domain
from wsph.ranks.kept import Piece
from wsph.simulation.starting.source import Parted, fill


class Carried(Parted):
    """The arrays of a checkpoint of which every process has its part. All processes ask for the same of them, in the same
    order."""

    def __init__(
        self,
        domain: Domain,
        arrays: Mapping[str, np.ndarray],
        pieces: Mapping[str, Sequence[Piece]],
        others: Mapping[str, np.ndarray],
    ):
        """`pieces`: where the `arrays` stand in those of all processes; `others`, those that are whole in the first."""
        super().__init__(tuple(arrays), others)
        self._domain, self._arrays, self._pieces = domain, arrays, pieces

    def _standing(self, name: str) -> list[tuple[int, int]]:
        return [(each.width, each.rows.whole) for each in self._pieces[name]]

    def _rows(self, name: str, number: int, places: np.ndarray) -> np.ndarray:
        own = self._pieces[name][number]
        mine, values = own.rows.places[own.rows.own], own.of(self._arrays[name])[own.rows.own]
        ends = (int(places.min()), int(places.max())) if len(places) else (0, -1)
        chosen = [(mine >= low) & (mine <= high) for low, high in self._domain.joined(np.array([ends])).tolist()]
        where = self._domain.passed([mine[each] for each in chosen])
        what = self._domain.passed([values[each] for each in chosen])
        rows = np.zeros((len(places), *values.shape[1:]), values.dtype)
        for at, some in zip(where, what, strict=True):
            fill(rows, places, at, some)
        return rows

    def _other(self, name: str) -> np.ndarray:
        return self._domain.told(lambda: self._others[name])
