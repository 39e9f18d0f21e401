"""Arrays that a run goes on from, of which a process takes its part."""

# pyright: strict

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from wsph.ranks.kept import Piece, localised


class Parted(Mapping[str, np.ndarray]):
    """Arrays that are there in parts, piece by piece (`wsph.ranks.kept.Piece`), and `others` that are whole."""

    def __init__(self, names: Sequence[str], others: Mapping[str, np.ndarray]):
        self._names, self._others = names, others

    def _standing(self, name: str) -> list[tuple[int, int]]:
        """Of every piece of an array its width and its rows in the whole."""
        raise NotImplementedError

    def _rows(self, name: str, number: int, places: np.ndarray) -> np.ndarray:
        """Rows of a piece, those at `places` (n,) of the whole."""
        raise NotImplementedError

    def _other(self, name: str) -> np.ndarray:
        """One of those that are whole."""
        return self._others[name]

    def here(self, name: str, pieces: Sequence[Piece]) -> np.ndarray | None:
        """The part of an array that stands in `pieces` of the whole; None where there is no such array."""
        if name not in self._names:
            return here(self._others, name, pieces)
        standing = self._standing(name)
        if standing != [(each.width, each.rows.whole) for each in pieces]:
            return here({name: self[name]}, name, pieces)  # of a body that each process had whole, or has
        return _joined([self._rows(name, k, piece.rows.places) for k, piece in enumerate(pieces)], standing)

    def __getitem__(self, key: str) -> np.ndarray:
        if key in self._others:
            return self._other(key)
        standing = self._standing(key)
        return _joined([self._rows(key, k, np.arange(whole)) for k, (_, whole) in enumerate(standing)], standing)

    def __iter__(self) -> Iterator[str]:
        return iter((*self._others, *self._names))

    def __len__(self) -> int:
        return len(self._others) + len(self._names)


def here(arrays: Mapping[str, np.ndarray], name: str, pieces: Sequence[Piece] | None) -> np.ndarray | None:
    """An array of some, or with `pieces` the part of it that stands there in the whole; None where there is none like it."""
    if pieces is not None and isinstance(arrays, Parted):
        return arrays.here(name, pieces)
    value = arrays.get(name)
    if value is None or pieces is None:
        return value
    fits = len(value) == sum(each.rows.whole * max(each.width, 1) for each in pieces)
    return localised(value, pieces) if fits else value


def _joined(found: list[np.ndarray], standing: Sequence[tuple[int, int]]) -> np.ndarray:
    """The pieces of an array as one: a flat one, where they have a width."""
    flat = [rows.ravel() if width else rows for rows, (width, _) in zip(found, standing, strict=True)]
    return np.concatenate(flat) if len(flat) > 1 else flat[0]


def fill(rows: np.ndarray, wanted: np.ndarray, places: np.ndarray, values: np.ndarray) -> None:
    """Put into `rows`, which are those at `wanted` (n,) of the whole, the `values` (m, ...) of the whole's rows at `places`
    (m,) that are among these."""
    if not len(wanted):
        return
    order = np.argsort(wanted, kind="stable")
    at = np.minimum(np.searchsorted(wanted, places, sorter=order), len(wanted) - 1)
    known = wanted[order][at] == places
    rows[order[at[known]]] = values[known]
