"""The patches of a body whose surface is in stairs: which patch of its shape each cell face stands for."""

# pyright: strict

from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np

from wsph.geometry.shapes.combined import Shape

TURNED = 3.0
"""Weight of a face's turn away from a patch beside its distance [cells]."""


class StairPatches(Mapping[str, np.ndarray]):
    """Rows of the faces of every patch by its name, each face with the patch of least distance and turn. They are found when
    they are first asked for."""

    def __init__(self, shape: Shape, middles: np.ndarray, normals: np.ndarray, spacing: float):
        """`middles` (m, dim) [m] and outward `normals` (m, dim) of the faces."""
        self._shape, self._spacing = shape, spacing
        self._middles, self._normals = middles, normals

    @cached_property
    def _rows(self) -> dict[str, np.ndarray]:
        shape = self._shape
        points = shape.middle + (self._middles - shape.middle) @ shape.axes
        normals = self._normals @ shape.axes
        patches = shape.patches()
        costs: list[np.ndarray] = []
        for patch in patches:
            nearest = patch.surface.nearest(points)
            away = np.linalg.norm(points - nearest, axis=1) / self._spacing
            _, gradient = patch.surface.height(nearest)
            costs.append(away + TURNED * (1.0 - (gradient * normals).sum(1)))
        label = np.argmin(costs, axis=0) if costs else np.zeros(0, int)
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
