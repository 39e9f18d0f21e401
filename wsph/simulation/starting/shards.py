"""Checkpoints of processes that share a scene: a shard each, with what it owns, behind one file that names them.

A shard is written like a checkpoint, with a digest of its own; the file that names the shards has their digests and is
renamed into place when all are whole. Put together they are the arrays of a checkpoint of one process, so that any number of
processes goes on from them, and of one process's file too.
"""

# pyright: strict

import hashlib
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from wsph.errors import CheckpointError
from wsph.output.files import write_atomically
from wsph.protocols import DeviceArray
from wsph.ranks.kept import Piece

FIRST = b"wsph shard 1\n"


class Array(TypedDict):
    """An array that is in shards: the type of its numbers, the shape of its rows where it has a piece without width, and of
    each piece its width and its rows."""

    type: str
    shape: list[int]
    pieces: list[list[int]]


class Shards(TypedDict):
    """What a checkpoint says of its shards: their files with their digests, and the arrays in them."""

    files: list[list[str]]
    arrays: dict[str, Array]


def name_of(step: int, rank: int) -> str:
    """The file of a process's shard."""
    return f"checkpoint_{step:012d}_{rank:05d}.npz"


def write(folder: Path, name: str, arrays: Mapping[str, DeviceArray], pieces: Mapping[str, Sequence[Piece]]) -> str:
    """Write the shard of this process, whole or not at all; its digest. Raises OutputError."""
    content: dict[str, np.ndarray] = {}
    for key, device in arrays.items():
        values = device.numpy()
        for k, piece in enumerate(pieces[key]):
            own = piece.rows.own
            content[f"{key}:{k}"] = piece.of(values)[own]
            content[f"{key}:{k}:at"] = _range(piece.rows.places[own])
    buffer = io.BytesIO()
    np.savez(buffer, **content)  # type: ignore[arg-type]
    raw = buffer.getvalue()
    digest = hashlib.sha256(raw).hexdigest()

    def put(temporary: Path) -> None:
        folder.mkdir(exist_ok=True)
        with open(temporary, "wb") as file:
            file.write(FIRST + raw)
            file.flush()
            os.fsync(file.fileno())

    write_atomically(folder / name, put)
    return digest


def described(arrays: Mapping[str, DeviceArray], pieces: Mapping[str, Sequence[Piece]]) -> dict[str, Array]:
    """The arrays, as the file that names the shards has them."""
    return {
        key: {
            "type": device.numpy().dtype.str,
            "shape": list(device.numpy().shape[1:]),
            "pieces": [[piece.width, piece.rows.whole] for piece in pieces[key]],
        }
        for key, device in arrays.items()
    }


class Assembled(Mapping[str, np.ndarray]):
    """The arrays of a checkpoint in shards: each is put together when it is asked for. Raises CheckpointError where a shard
    is not what it was."""

    def __init__(self, path: Path, shards: Shards, others: Mapping[str, np.ndarray]):
        """`others`: the arrays that are not in shards."""
        self._arrays, self._others = shards["arrays"], others
        self._shards = [_opened(path.parent / name, digest) for name, digest in shards["files"]]

    def __getitem__(self, key: str) -> np.ndarray:
        if key in self._others:
            return self._others[key]
        of = self._arrays[key]
        found: list[np.ndarray] = []
        for k, (width, whole) in enumerate(of["pieces"]):
            rows = np.zeros((whole, width) if width else (whole, *of["shape"]), of["type"])
            for shard in self._shards:
                at = shard[f"{key}:{k}:at"]
                rows[_places(at)] = shard[f"{key}:{k}"]
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
    return np.load(_Behind(file, len(FIRST)), allow_pickle=False)


class _Behind(io.RawIOBase):
    """A file from some place on."""

    def __init__(self, file: io.BufferedReader, start: int):
        self._file, self._start = file, start
        file.seek(start)

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._file.seek(offset + self._start * (whence == 0), whence) - self._start

    def tell(self) -> int:
        return self._file.tell() - self._start

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        return self._file.readinto(buffer)

    def close(self) -> None:
        self._file.close()
        super().close()


def _range(places: np.ndarray) -> np.ndarray:
    """Places as they are written: of a range its first and its length, and -1."""
    if len(places) > 2 and (np.diff(places) == 1).all():
        return np.array([places[0], len(places), -1], np.int64)
    return places.astype(np.int64)


def _places(at: np.ndarray) -> np.ndarray | slice:
    return slice(int(at[0]), int(at[0] + at[1])) if len(at) == 3 and at[2] == -1 else at
