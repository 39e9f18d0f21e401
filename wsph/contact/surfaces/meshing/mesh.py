"""The surface of a body on the host: a closed mesh of points (1D), segments (2D) or triangles (3D), in metres."""

# pyright: strict

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsph.contact.surfaces.meshing.boundary import Boundary, boundary_of
from wsph.contact.surfaces.meshing.on_shape import OnShape, on_shape
from wsph.contact.surfaces.meshing.shell import Shell
from wsph.contact.surfaces.meshing.sparse import spread
from wsph.contact.surfaces.meshing.unfolding import unfolded
from wsph.geometry.shapes.surfaces.surface import Patch

SMOOTH = 0.64
"""Cosine between normals above which two faces meet smoothly: an angle of 50 degrees."""

FLAT = 1e-9
"""Part of a face's area that is turned over without its being folded: rounding of one that has none."""


@dataclass(frozen=True)
class SurfaceMesh:
    """n vertices, m faces.

    boundary  # sides and fans that it is made of
    X         # vertices in the reference configuration, (n, dim) [m]
    moved     # which of them do not lie at their node, (n,) bool
    faces     # vertices of the faces, outward by their order, (m, dim)
    side      # of the boundary that each face is, or is half of, (m,)
    N         # outward normals, of length 1, those of the shape where it is known, (m, dim)
    A         # areas (m,) [m^(dim-1)]; 0 of a face that is folded over
    """

    boundary: Boundary
    X: np.ndarray
    moved: np.ndarray
    faces: np.ndarray
    side: np.ndarray
    N: np.ndarray
    A: np.ndarray

    @cached_property
    def starts(self) -> np.ndarray:
        """Where the faces of each vertex begin in `around`, (n + 1,)."""
        return np.concatenate([[0], np.cumsum(np.bincount(self.faces.ravel(), minlength=len(self.X)))])

    @cached_property
    def around(self) -> np.ndarray:
        """The faces around each vertex, ascending, (m dim,)."""
        return np.argsort(self.faces.ravel(), kind="stable") // self.faces.shape[1]

    def groups(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The faces that meet each corner of a face smoothly, itself among them: where they begin (m dim + 1,), and all of
        them; and which vertices have faces that do not all meet smoothly, (n,) bool."""
        corner, where = spread(self.starts, self.faces.ravel())
        other, own = self.around[where], corner // self.faces.shape[1]
        smooth = (self.N[own] * self.N[other]).sum(1) > SMOOTH
        count, sharp = np.bincount(corner[smooth], minlength=self.faces.size), np.zeros(len(self.X), bool)
        sharp[self.faces.ravel()[corner[~smooth]]] = True
        return np.concatenate([[0], np.cumsum(count)]), other[smooth], sharp

    @cached_property
    def near(self) -> np.ndarray:
        """Keys, vertex times m + face, ascending, of the faces within two rings of each vertex along the surface."""
        m, dim = self.faces.shape
        vertex, face = np.repeat(np.arange(len(self.X)), np.diff(self.starts)), self.around
        whose = np.repeat(vertex, dim)
        beside = np.unique(whose * len(self.X) + self.faces[face].ravel())
        whose, where = spread(self.starts, beside % len(self.X))
        return np.unique((beside // len(self.X))[whose] * m + self.around[where])


def surface_mesh(shell: Shell, *, deep: bool) -> SurfaceMesh:
    """The surface of a body, of the shell around it; `deep` as of the boundary, which has numbers of the whole body.
    Vertices of stairs lie on the shape, and the normals are those of the shape there. Raises ValueError for a geometry
    without cells."""
    boundary = boundary_of(shell, deep=deep)
    at = shell.nodes[boundary.node]
    faces, side = _faces(boundary, at, _middles(shell)[boundary.cell])
    outward = _outward(shell, boundary)
    straight = area_vectors(at, faces, outward)

    def lying(placed: OnShape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normals and areas of the faces, and which of them are folded over."""
        vectors = area_vectors(placed.X, faces, outward)
        areas = np.linalg.norm(vectors, axis=1)
        chords = vectors / np.maximum(areas, np.finfo(float).tiny)[:, None]
        normals = _of_patches(chords, straight, placed.X[faces].mean(1), placed.patch[side], placed.patches)
        return normals, areas, (vectors * normals).sum(1) < -FLAT * np.linalg.norm(straight, axis=1)

    placed = unfolded(on_shape(shell, boundary), faces, lambda placed: lying(placed)[2])
    N, A, folded = lying(placed)
    A[folded] = 0.0
    return SurfaceMesh(shell.numbered(boundary), placed.X, (at != placed.X).any(1), faces, side, N, A)


def area_vectors(x: np.ndarray, faces: np.ndarray, ways: np.ndarray | None = None) -> np.ndarray:
    """Outward area vectors of `faces` (m, dim) at places x (n, dim), (m, dim); in 1D they are the `ways` (m, 1)."""
    dim = faces.shape[1]
    if dim == 1:
        return np.zeros((len(faces), 1)) if ways is None else ways
    edge = x[faces[:, 1]] - x[faces[:, 0]]
    if dim == 2:
        return np.stack([edge[:, 1], -edge[:, 0]], 1)
    return 0.5 * np.cross(edge, x[faces[:, 2]] - x[faces[:, 0]])


def _middles(shell: Shell) -> np.ndarray:
    """The middles of the cells, (c, dim) [m]."""
    return np.concatenate([shell.nodes[corners].mean(1) for corners in shell.blocks])


def _outward(shell: Shell, boundary: Boundary) -> np.ndarray:
    """From the middle of its cell to that of each side, of length 1, (s, dim)."""
    way = shell.nodes[boundary.node[boundary.sides]].mean(1) - _middles(shell)[boundary.cell]
    return way / np.linalg.norm(way, axis=1, keepdims=True)


def _faces(boundary: Boundary, at: np.ndarray, inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces (m, dim), outward as seen from the points `inside` (s, dim) their cells, and the side of each. A side with four
    corners is halved between its first and its last."""
    sides = boundary.sides
    rows, dim = np.arange(len(sides)), at.shape[1]
    if dim < 3:
        faces = sides.copy()
    elif sides.shape[1] == 3:
        faces = sides[:, [0, 1, 2]]
    else:
        whole = np.flatnonzero(sides[:, 2] != sides[:, 3])
        faces = np.concatenate([sides[:, [0, 1, 3]], sides[whole][:, [0, 3, 2]]])
        rows = np.concatenate([rows, whole])
    # Both halves of a side as the side as a whole lies, whose middle is less bent than they are.
    way = at[sides].mean(1) - inside
    total = np.zeros((len(sides), dim))
    np.add.at(total, rows, area_vectors(at, faces))
    inward = (total * way).sum(1)[rows] < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return faces, rows


def _of_patches(
    chords: np.ndarray, straight: np.ndarray, middles: np.ndarray, patch: np.ndarray, patches: tuple[Patch, ...]
) -> np.ndarray:
    """The normals of faces: those of `chords`, or of their patches at their `middles`, on the side of the stairs' own area
    vectors `straight`; each (m, dim)."""
    found = chords.copy()
    for k, each in enumerate(patches):
        rows = np.flatnonzero(patch == k)
        if len(rows):
            normal = each.surface.height(middles[rows])[1]
            found[rows] = normal * np.sign((normal * straight[rows]).sum(1))[:, None]
    return found
