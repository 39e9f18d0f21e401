"""What processes that share a scene keep of a run in memory, to go on with other parts of it."""

# pyright: strict

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from wsph.backend.domain import Domain
from wsph.ranks.kept import Piece
from wsph.simulation.starting.source import filled


class Carried(Mapping[str, np.ndarray]):
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
        self._domain, self._arrays, self._pieces, self._others = domain, arrays, pieces, others

    def here(self, name: str, pieces: Sequence[Piece]) -> np.ndarray | None:
        """The part of an array that stands in `pieces` of the whole; None where there is none of these pieces."""
        own = self._pieces.get(name)
        if own is None or [(a.width, a.rows.whole) for a in own] != [(a.width, a.rows.whole) for a in pieces]:
            return None
        found = [self._piece(name, k, piece) for k, piece in enumerate(pieces)]
        return found[0] if not pieces[0].width else np.concatenate([rows.ravel() for rows in found])

    def _piece(self, name: str, number: int, piece: Piece) -> np.ndarray:
        own, wanted = self._pieces[name][number], piece.rows.places
        places, values = own.rows.places[own.rows.own], own.of(self._arrays[name])[own.rows.own]
        ends = (int(wanted.min()), int(wanted.max())) if len(wanted) else (0, -1)
        chosen = [(places >= low) & (places <= high) for low, high in self._domain.joined(np.array([ends])).tolist()]
        where = self._domain.passed([places[each] for each in chosen])
        what = self._domain.passed([values[each] for each in chosen])
        rows = np.zeros((len(wanted), *values.shape[1:]), values.dtype)
        for at, some in zip(where, what, strict=True):
            filled(piece, at, some, rows)
        return rows

    def __getitem__(self, key: str) -> np.ndarray:
        if key in self._others:
            return self._domain.told(lambda: self._others[key])
        found: list[np.ndarray] = []
        for piece in self._pieces[key]:
            rows = piece.of(self._arrays[key])[piece.rows.own]
            every = np.zeros((piece.rows.whole, *rows.shape[1:]), rows.dtype)
            every[self._domain.joined(piece.rows.places[piece.rows.own])] = self._domain.joined(rows)
            found.append(every.ravel() if piece.width else every)
        return np.concatenate(found) if len(found) > 1 else found[0]

    def __iter__(self) -> Iterator[str]:
        return iter((*self._others, *self._arrays))

    def __len__(self) -> int:
        return len(self._others) + len(self._arrays)
