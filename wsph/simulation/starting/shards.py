"""Checkpoints of processes that share a scene: a shard each, with what it owns, behind one file that names them.

A shard is written like a checkpoint, with a digest of its own; the file that names the shards has their digests and is
renamed into place when all are whole. Put together they are the arrays of a checkpoint of one process, so that any number of
processes goes on from them, and of one process's file too.
"""

# pyright: strict

import hashlib
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from wsph.output.files import write_durably
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


def write(folder: Path, name: str, arrays: Mapping[str, np.ndarray], pieces: Mapping[str, Sequence[Piece]]) -> str:
    """Write the shard of this process, whole or not at all; its digest. Raises OutputError."""
    content: dict[str, np.ndarray] = {}
    for key, values in arrays.items():
        for k, piece in enumerate(pieces[key]):
            own = piece.rows.own
            content[f"{key}:{k}"] = piece.of(values)[own]
            content[f"{key}:{k}:at"] = _range(piece.rows.places[own])
    buffer = io.BytesIO()
    np.savez(buffer, **content)  # type: ignore[arg-type]
    raw = buffer.getvalue()
    write_durably(folder / name, FIRST + raw)
    return hashlib.sha256(raw).hexdigest()


def described(arrays: Mapping[str, np.ndarray], pieces: Mapping[str, Sequence[Piece]]) -> dict[str, Array]:
    """The arrays, as the file that names the shards has them."""
    return {
        key: {
            "type": values.dtype.str,
            "shape": list(values.shape[1:]),
            "pieces": [[piece.width, piece.rows.whole] for piece in pieces[key]],
        }
        for key, values in arrays.items()
    }


def _range(places: np.ndarray) -> np.ndarray:
    """Places as they are written: of a range its first and its length, and -1."""
    if len(places) > 2 and (np.diff(places) == 1).all():
        return np.array([places[0], len(places), -1], np.int64)
    return places.astype(np.int64)
