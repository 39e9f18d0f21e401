"""The arrays of a checkpoint in shards, put together, or the part of a process."""

# pyright: strict

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from wsph.errors import CheckpointError
from wsph.ranks.kept import Piece
from wsph.simulation.starting.shards import FIRST, Array, Shards
from wsph.simulation.starting.source import filled, here


class Assembled(Mapping[str, np.ndarray]):
    """The arrays of a checkpoint in shards: each is put together when it is asked for. Raises CheckpointError where a shard
    is not what it was."""

    def __init__(self, path: Path, shards: Shards, others: Mapping[str, np.ndarray]):
        """`others`: the arrays that are not in shards."""
        self._arrays, self._others = shards["arrays"], others
        self._shards = [_opened(path.parent / name, digest) for name, digest in shards["files"]]

    def here(self, name: str, pieces: Sequence[Piece]) -> np.ndarray | None:
        """The part of an array that stands in `pieces` of the whole, of whose shards one is read at a time; None where there
        is none."""
        if name in self._others:
            return here(self._others, name, pieces)
        of = self._arrays.get(name)
        if of is None:
            return None
        if of["pieces"] != [[each.width, each.rows.whole] for each in pieces]:
            return here({name: self[name]}, name, pieces)  # of a body that each process had whole
        found = [self._piece(name, k, piece, of) for k, piece in enumerate(pieces)]
        return found[0] if not pieces[0].width else np.concatenate([rows.ravel() for rows in found])

    def _piece(self, name: str, number: int, piece: Piece, of: Array) -> np.ndarray:
        wanted = piece.rows.places
        rows = np.zeros((len(wanted), piece.width) if piece.width else (len(wanted), *of["shape"]), of["type"])
        for shard in self._shards:
            places = _numbers(shard[f"{name}:{number}:at"])
            if len(places) and len(wanted) and places.min() <= wanted.max() and places.max() >= wanted.min():
                filled(piece, places, shard[f"{name}:{number}"], rows)
        return rows

    def __getitem__(self, key: str) -> np.ndarray:
        if key in self._others:
            return self._others[key]
        of = self._arrays[key]
        found: list[np.ndarray] = []
        for k, (width, whole) in enumerate(of["pieces"]):
            rows = np.zeros((whole, width) if width else (whole, *of["shape"]), of["type"])
            for shard in self._shards:
                at = shard[f"{key}:{k}:at"]
                rows[_numbers(at)] = shard[f"{key}:{k}"]
            found.append(rows.ravel() if width else rows)
        return np.concatenate(found) if len(found) > 1 else found[0]

    def __iter__(self) -> Iterator[str]:
        return iter((*self._others, *self._arrays))

    def __len__(self) -> int:
        return len(self._others) + len(self._arrays)


def _opened(path: Path, digest: str) -> Mapping[str, np.ndarray]:
    """A shard whose digest is right: its arrays are read when they are asked for."""
    try:
        with open(path, "rb") as file:
            first, found = file.read(len(FIRST)), hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error.strerror or error}") from error
    if first != FIRST or found != digest:
        raise CheckpointError(f"{path}: is cut off or altered")
    file = open(path, "rb")  # noqa: SIM115 - it is read as long as the arrays are asked for
    file.seek(len(FIRST))  # an archive may have something before it
    return np.load(file, allow_pickle=False)


def _numbers(at: np.ndarray) -> np.ndarray:
    """The numbers of rows, of which a range may be written short."""
    if len(at) != 3 or at[2] != -1:
        return at
    found: np.ndarray = np.arange(int(at[0]), int(at[0]) + int(at[1]))
    return found
