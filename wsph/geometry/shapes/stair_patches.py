"""The patches of a body whose surface is in stairs: which patch of its shape each cell face stands for."""

# pyright: strict

from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np

from wsph.backend.domain import Domain
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.surfaces.surface import Patch, placed

TURNED = 3.0
"""Weight of a face's turn away from a patch beside its distance [cells]."""


class StairPatches(Mapping[str, np.ndarray]):
    """Rows of the faces of every patch by its name, each face with the patch of least distance and turn. They are found when
    they are first asked for."""

    def __init__(self, shape: Shape, middles: np.ndarray, normals: np.ndarray, spacing: float):
        """`middles` (m, dim) [m] and outward `normals` (m, dim) of the faces."""
        self._shape, self._spacing = shape, spacing
        self._middles, self._normals = middles, normals

    @property
    def shape(self) -> Shape:
        """The shape whose patches they are."""
        return self._shape

    def along(self, axes: np.ndarray) -> bool:
        """Whether the axes of a grid, columns (dim, dim), are those of the shape."""
        turn = np.abs(self._shape.axes.T @ axes)
        return bool(np.abs(turn - np.rint(turn)).max() < 1e-12)

    @cached_property
    def _found(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of every face its patch (m,), and the place on it [m] and the normal there, (m, dim), before the rotation."""
        shape = self._shape
        points = shape.middle + (self._middles - shape.middle) @ shape.axes
        normals = self._normals @ shape.axes
        least = np.full(len(points), np.inf)
        label, place, normal = np.zeros(len(points), int), points.copy(), normals.copy()
        for number, patch in enumerate(shape.patches()):
            nearest = patch.surface.nearest(points)
            away = np.linalg.norm(points - nearest, axis=1) / self._spacing
            _, gradient = patch.surface.height(nearest)
            cost = away + TURNED * (1.0 - (gradient * normals).sum(1))
            better = cost < least
            least[better], label[better] = cost[better], number
            place[better], normal[better] = nearest[better], gradient[better]
        return label, place, normal

    @property
    def stands_for(self) -> tuple[np.ndarray, tuple[Patch, ...]]:
        """The patch of every face, (m,) indices, and all patches, turned with the shape."""
        shape = self._shape
        return self._found[0], placed(shape.patches(), shape.middle, shape.axes)

    def projected(self, outer: np.ndarray, domain: Domain) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of every face the normal of its patch (m, dim), the name of the face that this makes it (m,), and whether it lies
        less than a cell behind the outermost of its name and of the `outer` ones (m,) bool. `domain`: where the others
        of the body are."""
        _, place, normal = self._found
        rows = np.arange(len(normal))
        nearest = np.abs(np.round(normal, 9)).argmax(1)
        name = 2 * nearest + (normal[rows, nearest] > 0.0)
        height = np.sign(normal[rows, nearest]) * place[rows, nearest]
        highest = np.full(2 * normal.shape[1], -np.inf)
        np.maximum.at(highest, name[outer], height[outer])
        last = outer & (height > domain.max(highest)[name] - self._spacing)
        return normal @ self._shape.axes.T, name, last

    @cached_property
    def _rows(self) -> dict[str, np.ndarray]:
        label, patches = self._found[0], self._shape.patches()
        names = dict.fromkeys(patch.name for patch in patches)
        found = {name: [k for k, patch in enumerate(patches) if patch.name == name] for name in names}
        rows = {name: np.flatnonzero(np.isin(label, which)) for name, which in found.items()}
        return {name: each for name, each in rows.items() if len(each)}

    def __getitem__(self, name: str) -> np.ndarray:
        return self._rows[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)
