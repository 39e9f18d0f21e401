"""STL files: triangles, binary or as text."""

# pyright: strict

import re
from pathlib import Path

import numpy as np

HEADER = 84
"""Bytes of a binary file before its triangles: a text of 80 and their number."""

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle of a binary file."""

VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(path: Path) -> np.ndarray:
    """The triangles of a file, corners (f, 3, 3) in its own unit. Raises ValueError, with its name, where it is missing, of
    another kind, cut short or empty."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    if not data:
        raise ValueError(f"{path}: is empty")
    many = int.from_bytes(data[HEADER - 4 : HEADER], "little") if len(data) >= HEADER else 0
    if len(data) == HEADER + many * RECORD.itemsize:
        corners = np.frombuffer(data, RECORD, many, HEADER)["corners"].astype(float)
    elif data.lstrip()[:5].lower() == b"solid" and b"facet" in data:
        corners = _text(path, data)
    elif b"\0" in data and HEADER < len(data) < HEADER + many * RECORD.itemsize and many < 2**28:
        there = (len(data) - HEADER) // RECORD.itemsize
        raise ValueError(f"{path}: is cut short: {there} of its {many} triangles are there")
    else:
        raise ValueError(f"{path}: is no STL file, neither binary nor text")
    if not len(corners):
        raise ValueError(f"{path}: has no triangles")
    if not np.isfinite(corners).all():
        raise ValueError(f"{path}: has corners that are not finite")
    return corners


def _text(path: Path, data: bytes) -> np.ndarray:
    try:
        numbers = np.array([[float(x) for x in found] for found in VERTEX.findall(data)])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    facets = len(re.findall(rb"\bendfacet\b", data, re.IGNORECASE))
    if len(numbers) != 3 * facets:
        raise ValueError(f"{path}: has {len(numbers)} corners for {facets} triangles: three each are needed")
    return numbers.reshape(-1, 3, 3)
