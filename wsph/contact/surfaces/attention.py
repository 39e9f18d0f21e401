"""Which rows of a surface are brought up to date: those that laws read or write, and what these need."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from dataclasses import dataclass

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array
from wsph.contact.surfaces.meshing.mesh import SurfaceMesh
from wsph.contact.surfaces.meshing.sparse import SparseRows, among, spread


@dataclass(frozen=True)
class Rows:
    """Rows of an array, ascending, on the host and on the device, (k,) int32."""

    host: np.ndarray
    device: Array

    @property
    def count(self) -> int:
        """How many."""
        return len(self.host)


@dataclass(frozen=True)
class Attention:
    """The rows of a surface that are brought up to date.

    placed  # vertices that have places: of all faces below
    turned  # faces that have area vectors: all around the vertices that laws see
    smooth  # faces whose corners have normals: those that laws see
    pushed  # particles, of the `support`, that forces on the vertices that laws see reach
    columns # particles, of all that the surface hangs on, that the places take, ascending
    """

    placed: Rows
    turned: Rows
    smooth: Rows
    pushed: Rows
    columns: np.ndarray


def attention(
    mesh: SurfaceMesh,
    B: SparseRows,
    support: np.ndarray,
    stands: np.ndarray,
    seen: tuple[np.ndarray, np.ndarray],
    arrays: Arrays,
) -> Attention:
    """Of the vertices and faces that laws see, rows. `support` (s,), ascending: particles here that forces can reach;
    `stands` (columns,): where those of B are among the particles here, -1 for those that are not."""

    def rows(name: str, each: np.ndarray) -> Rows:
        return Rows(each, arrays.of(name, each.astype(np.int32), wp.int32))

    n, smooth = len(mesh.X), among(len(mesh.faces), seen[1])
    vertices = among(n, seen[0], mesh.faces[smooth])
    turned = among(len(mesh.faces), mesh.around[spread(mesh.starts, vertices)[1]])
    placed = among(n, vertices, mesh.faces[turned])
    felt = stands[among(B.columns, B.only(vertices).indices)]
    pushed = np.searchsorted(support, felt[felt >= 0])
    return Attention(
        rows("placed", placed),
        rows("turned", turned),
        rows("smooth", smooth),
        rows("pushed", pushed),
        among(B.columns, B.only(placed).indices),
    )
