"""A geometry in words, so that a wrong body is seen before a run: its cells, the patches of its surface, and doubts."""

# pyright: strict

from collections.abc import Iterator

import numpy as np

from wsph.geometry.connected import connected
from wsph.geometry.faces import Faces
from wsph.geometry.geometry import Geometry
from wsph.geometry.meshes.meshed import Meshed, point_edges

CANCELS = 0.01
"""Part of its area below which the normals of a patch, added up, are none."""

SMALL = 0.3
"""Part of the mean edge of the points below which the smallest is told of: it sets the time step of all."""


def doubts(geometry: Geometry) -> Iterator[str]:
    """What whoever runs a body with a fitted surface or from a mesh should know of its cells: that they are pieces without a
    node in common, and that a small one makes the steps short."""
    if not isinstance(geometry, Meshed):
        return
    if geometry.of is not None:
        yield from geometry.of.doubts
        return
    rows, nodes = geometry.rows, geometry.nodes
    first = np.repeat(rows.indices[rows.offsets[:-1]], np.diff(rows.offsets))
    sizes = np.bincount(connected(first, rows.indices, len(nodes)))
    if len(sizes) > 1:
        told = ", ".join(str(size) for size in sizes[:4]) + (", ..." if len(sizes) > 4 else "")
        again = len(nodes) - len(np.unique(np.rint((nodes - nodes.mean(0)) / (1e-6 * geometry.spacing)), axis=0))
        merge = f"; {again} nodes lie on others: merge them where the pieces are to hold together" if again else ""
        yield f"its cells are {len(sizes)} pieces that have no node in common and do not feel each other, of {told} nodes{merge}"
    edge = point_edges(rows, geometry.cell_volume)
    if edge.min() < SMALL * edge.mean():
        where = _vector(geometry.cells[int(edge.argmin())], float(np.ptp(nodes, axis=0).max()))
        yield (
            f"its time step is that of an edge of {edge.min():.3g} m, {edge.min() / edge.mean():.2g} of the mean, of the cell "
            f"at {where} m: cells of more equal size take fewer steps"
        )


def in_words(geometry: Geometry) -> Iterator[tuple[str, str]]:
    """Of a body with a fitted surface or from a mesh a line on its cells, and one for every patch: what it is about, and
    what there is to say. Nothing of one that the lines of a grid cut."""
    if not isinstance(geometry, Meshed):
        return
    yield "cells", _cells(geometry)
    for name, rows in geometry.faces.patches.items():
        yield "patch", f"{name}: {_patch(geometry.nodes, geometry.faces, rows)}"


def _cells(geometry: Meshed) -> str:
    """How many, how large, and what the smallest does to the time step."""
    dim, volume = geometry.nodes.shape[1], geometry.cell_volume
    count = sum(len(corners) for corners in geometry.mesh.blocks)
    points = f"{count}" + (f" with {len(volume)} points" if len(volume) != count else "")
    edge = point_edges(geometry.rows, volume)
    return (
        f"{points}, volume at least {volume.min():.4g} m{dim}, median {np.median(volume):.4g} m{dim}; time step by an edge of "
        f"{edge.min():.4g} m, {edge.min() / edge.mean():.2f} of the mean"
    )


def _patch(nodes: np.ndarray, faces: Faces, rows: np.ndarray) -> str:
    """Area, centre and mean normal of some faces."""
    dim, share = nodes.shape[1], faces.share[rows]
    area = float(share.sum())
    middle = nodes.mean(0)
    centre = middle + (share[..., None] * (nodes[faces.nodes[rows]] - middle)).sum((0, 1)) / area
    normal = faces.vector[rows].sum((0, 1)) / area
    size = float(np.linalg.norm(normal))
    told = f"normal {_vector(normal / size, 1.0)}" if size > CANCELS else "normals that cancel"
    unit = " m" if dim == 2 else " m2"
    return f"area {area:.6g}{unit}, centre {_vector(centre, float(np.ptp(nodes, axis=0).max()))} m, {told}"


def _vector(values: np.ndarray, size: float) -> str:
    """Numbers without what is nothing beside a `size`."""
    kept = np.where(np.abs(values) > 1e-9 * size, values, 0.0)
    return f"({', '.join(f'{value:.6g}' for value in kept)})"
