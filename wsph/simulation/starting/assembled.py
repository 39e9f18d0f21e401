"""The arrays of a checkpoint in shards, put together, or the part of a process."""

# pyright: strict

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wsph.errors import CheckpointError
from wsph.simulation.starting.shards import FIRST, Shards
from wsph.simulation.starting.source import Parted, fill


class Assembled(Parted):
    """The arrays of a checkpoint in shards: each is put together when it is asked for, from one shard after the other.
    Raises CheckpointError where a shard is not what it was."""

    def __init__(self, path: Path, shards: Shards, others: Mapping[str, np.ndarray]):
        """`others`: the arrays that are not in shards."""
        super().__init__(tuple(shards["arrays"]), others)
        self._arrays = shards["arrays"]
        self._shards = [_opened(path.parent / name, digest) for name, digest in shards["files"]]

    def _standing(self, name: str) -> list[tuple[int, int]]:
        return [(width, whole) for width, whole in self._arrays[name]["pieces"]]

    def _rows(self, name: str, number: int, places: np.ndarray) -> np.ndarray:
        of, (width, _) = self._arrays[name], self._standing(name)[number]
        rows = np.zeros((len(places), width) if width else (len(places), *of["shape"]), of["type"])
        for shard in self._shards:
            there = _numbers(shard[f"{name}:{number}:at"])
            if len(there) and len(places) and there.min() <= places.max() and there.max() >= places.min():
                fill(rows, places, there, shard[f"{name}:{number}"])
        return rows


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
