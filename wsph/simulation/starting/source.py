"""Arrays that a run goes on from, of which a process takes its part."""

# pyright: strict

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from wsph.ranks.kept import Piece, localised


@runtime_checkable
class Parted(Protocol):
    """Arrays that are there in parts."""

    def here(self, name: str, pieces: Sequence[Piece]) -> np.ndarray | None:
        """The part of an array that stands in `pieces` of the whole; None where there is no such array."""
        ...


def here(arrays: Mapping[str, np.ndarray], name: str, pieces: Sequence[Piece] | None) -> np.ndarray | None:
    """An array of some, or with `pieces` the part of it that stands there in the whole; None where there is none like it."""
    if pieces is not None and isinstance(arrays, Parted):
        return arrays.here(name, pieces)
    value = arrays.get(name)
    if value is None or pieces is None:
        return value
    fits = len(value) == sum(each.rows.whole * max(each.width, 1) for each in pieces)
    return localised(value, pieces) if fits else value


def filled(piece: Piece, places: np.ndarray, values: np.ndarray, rows: np.ndarray) -> None:
    """Put into the rows of a piece those `values` (m, ...) of the whole's rows at `places` (m,) that it has."""
    wanted = piece.rows.places
    order = np.argsort(wanted, kind="stable")
    at = np.minimum(np.searchsorted(wanted, places, sorter=order), max(len(wanted) - 1, 0))
    known = wanted[order][at] == places if len(wanted) else np.zeros(len(places), bool)
    rows[order[at[known]]] = values[known]
