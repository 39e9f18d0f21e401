"""What contacts, ties and tools are on the particles of a body's surface, as frames have it: pressure and gap."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from wsph.backend.arrays import host
from wsph.contact.surfaces.laws import Law
from wsph.contact.surfaces.surface import Surface
from wsph.units import Scales

SMOOTH = 0.64
"""Cosine of the angle up to which faces around a vertex are one side."""

PART = 0.3
"""Of a vertex' largest weight, from which a particle has the vertex' gap."""


def surface_fields(surface: Surface, laws: Sequence[Law], scales: Scales) -> Mapping[str, Callable[[], np.ndarray]]:
    """By their names the fields of the particles of a body at the end of a step, (count, 1), SI: `contact_pressure` [Pa],
    zero where nothing acts and inside, of a tie below zero where it pulls, and `contact_gap` [m] to the nearest of what may
    be met, below zero where it presses, NaN where there is nothing near."""

    def pressure() -> np.ndarray:
        weight, values = abs(surface.B), _pressures(surface)
        whole = np.bincount(weight.indices, weight.values, weight.columns)
        found = np.bincount(weight.indices, weight.values * values[weight.rows], weight.columns)
        return surface.of_particles(found / np.maximum(whole, 1e-300) * scales.stress, 0.0)[:, None]

    def gap() -> np.ndarray:
        vertices = np.full(surface.n, np.nan)
        for law in laws:
            vertices = np.fmin(vertices, law.surface_gaps(surface))
        weight, found = abs(surface.B), np.full(surface.B.columns, np.nan)
        largest = np.maximum.reduceat(weight.values, weight.offsets[:-1])
        much = weight.values > PART * largest[weight.rows]
        np.fmin.at(found, weight.indices[much], vertices[weight.rows[much]])
        return surface.of_particles(found * scales.length, np.nan)[:, None]

    return {"contact_pressure": pressure, "contact_gap": gap}


def _pressures(surface: Surface) -> NDArray[np.float64]:
    """Of every vertex (n,), nondimensional: the force on it along the side that it presses most, over its share of that
    side in the reference configuration."""
    mesh, force = surface.mesh, host(surface.force).astype(float)
    vertex, face = np.repeat(np.arange(surface.n), np.diff(mesh.starts)), mesh.around
    area, size = host(surface.struct.area).astype(float), host(surface.struct.size).astype(float)
    normal = area[face] / np.linalg.norm(area[face], axis=1, keepdims=True)
    push = -(force[vertex] * normal).sum(1)
    order = np.lexsort((np.abs(push), vertex))
    most = order[mesh.starts[1:] - 1]
    side = (normal * normal[most][vertex]).sum(1) > SMOOTH
    share = np.bincount(vertex[side], size[face[side]], surface.n) / force.shape[1]
    return push[most] / share
