"""How the vertices of a surface follow the particles of their body: u_v = sum_j B_vj u_j.

A vertex is the mean over its sources s, the node that it is or the cells of its fan, of what a linear field about each says:

    B_v = mean of [e_s + D_s (X_v - X_s)],   D_s = sum_j (e_j - e_s) (x) M_s^-1 r,  r = X_j - X_s,  M_s = sum_j r (x) r

D_s is the least-squares gradient over the sources that hang together with s. Rows sum to one and carry linear fields, so
that forces on vertices keep their resultant and their moment on the way. A vertex at its own particle is that particle.
"""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.contact.surfaces.meshing.boundary import Boundary
from wsph.contact.surfaces.meshing.mesh import SurfaceMesh
from wsph.contact.surfaces.meshing.shell import Shell
from wsph.contact.surfaces.meshing.sparse import SparseRows, spread

FLAT = 1e-9
"""Eigenvalue of M over the largest one below which sources do not span its direction: the gradient there is zero."""


@dataclass(frozen=True)
class Embedding:
    """`B` (vertices, particles); `exact`: every linear field is carried, because sources span all directions everywhere."""

    B: SparseRows
    exact: bool

    @property
    def identity(self) -> bool:
        """Whether every vertex is a particle."""
        single = len(self.B.values) == self.B.shape[0] and (np.diff(self.B.offsets) == 1).all()
        return bool(single and (self.B.values == 1.0).all())


def embedding(shell: Shell, mesh: SurfaceMesh, *, at_nodes: bool) -> Embedding:
    """The matrix of the surface of a shell, of a body whose particles are its nodes, `at_nodes`, or its cells."""
    boundary = shell.own(mesh.boundary)
    if at_nodes:
        return _in_nodes(shell, mesh, boundary)
    return _in_cells(shell, mesh, boundary)


def _in_nodes(shell: Shell, mesh: SurfaceMesh, boundary: Boundary) -> Embedding:
    node, moved = boundary.node, np.flatnonzero(mesh.moved)
    rows, columns, values = [np.arange(len(node))], [node], [np.ones(len(node))]
    exact = True
    if len(moved):
        source, other = _nodes_of_fans(shell, boundary, moved)
        slopes, full = _slopes(shell.nodes[other] - shell.nodes[node[moved]][source], source, len(moved))
        weight = (slopes * (mesh.X[moved] - shell.nodes[node[moved]])[source]).sum(1)
        rows += [moved[source], moved[source]]
        columns += [other, node[moved][source]]
        values += [weight, -weight]
        exact = bool(full.all())
    entries = np.concatenate(rows), shell.node[np.concatenate(columns)], np.concatenate(values)
    return Embedding(SparseRows.of(entries, (len(node), shell.count[0])), exact)


def _nodes_of_fans(shell: Shell, boundary: Boundary, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The other nodes of the cells of the fans of some vertices: an index into `vertices`, and the node, each once."""
    whose, where = spread(boundary.starts, vertices)
    cell = boundary.cells[where]
    count = len(shell.nodes)
    keys: list[np.ndarray] = []
    first = 0
    for corners in shell.blocks:
        own = np.flatnonzero((cell >= first) & (cell < first + len(corners)))
        nodes = corners[cell[own] - first]
        keys.append((whose[own][:, None] * count + nodes).ravel())
        first += len(corners)
    both = np.unique(np.concatenate(keys))
    source, other = both // count, both % count
    apart = other != boundary.node[vertices[source]]
    return source[apart], other[apart]


def _in_cells(shell: Shell, mesh: SurfaceMesh, boundary: Boundary) -> Embedding:
    place = shell.cells
    n, count = len(boundary.node), len(place)
    first, second = boundary.joins.T
    slopes, full = _slopes(place[second] - place[first], first, count)
    starts = np.searchsorted(first, np.arange(count + 1))
    # Every vertex and each cell of its fan ...
    vertex, share = np.repeat(np.arange(n), np.diff(boundary.starts)), 1.0 / np.diff(boundary.starts)
    own = boundary.cells
    off = mesh.X[vertex] - place[own]
    # ... and each neighbour of that.
    whose, where = spread(starts, own)
    weight = share[vertex[whose]] * (off[whose] * slopes[where]).sum(1)
    rows = np.concatenate([vertex, vertex[whose], vertex[whose]])
    columns = shell.cell[np.concatenate([own, second[where], own[whose]])]
    values = np.concatenate([share[vertex], weight, -weight])
    return Embedding(SparseRows.of((rows, columns, values), (n, shell.count[1])), bool(full[own].all()))


def _slopes(r: np.ndarray, source: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """M^-1 r of every pair (k, dim) of a source of so many, and of each source whether its pairs span all directions."""
    dim = r.shape[1]
    moments = [np.bincount(source, r[:, a] * r[:, b], count) for a in range(dim) for b in range(dim)]
    values, vectors = np.linalg.eigh(np.stack(moments, 1).reshape(count, dim, dim))
    spanned = values > FLAT * np.maximum(values[:, -1:], np.finfo(float).tiny)
    inverse = np.where(spanned, 1.0 / np.where(spanned, values, 1.0), 0.0)
    turned = np.einsum("kab,ka->kb", vectors[source], r) * inverse[source]
    return np.einsum("kab,kb->ka", vectors[source], turned), np.asarray(spanned.all(1))
