"""Rows of several arrays as the bytes of one message."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import math
from collections.abc import Sequence

import numpy as np


def packed(every: Sequence[np.ndarray]) -> np.ndarray:
    """Rows of several arrays (k, ...) as bytes, (k, width)."""
    flat = [np.ascontiguousarray(rows).reshape(len(rows), math.prod(rows.shape[1:])) for rows in every]
    return np.concatenate([rows.view(np.uint8) for rows in flat], 1)


def widths(every: Sequence[np.ndarray]) -> list[int]:
    """Bytes of a row of each of several arrays."""
    return [rows.dtype.itemsize * math.prod(rows.shape[1:]) for rows in every]


def unpacked(found: np.ndarray, like: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Rows of several arrays, of kinds that they are `like`, of their bytes (k, width)."""
    parts, low = list[np.ndarray](), 0
    for rows, width in zip(like, widths(like), strict=True):
        part = np.ascontiguousarray(found[:, low : low + width]).view(rows.dtype)
        parts.append(part.reshape(len(found), *rows.shape[1:]))
        low += width
    return parts
