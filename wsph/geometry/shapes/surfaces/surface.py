"""A surface of a shape, its named patches, and how both are turned. Coordinates are metres, arrays (n, dim)."""

# pyright: strict

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np


class Surface(Protocol):
    """A smooth piece of the surface of a shape, as far as the shape alone goes."""

    @property
    def normal(self) -> np.ndarray | None:
        """The outward unit normal (dim,) of a flat one."""
        ...

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The signed distance to the surface continued past its border, (n,) [m], negative inside, and its gradient
        (n, dim)."""
        ...

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """The points of the surface itself, within its border, that are nearest to `points`, (n, dim)."""
        ...

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        """Points (m, dim) all over the surface, some `spacing` [m] apart, and the areas (m,) [m^(dim-1)] that they stand
        for: the whole area in all."""
        ...


@dataclass(frozen=True)
class Placed:
    """A surface turned by `axes` (dim, dim) about `middle` (dim,) [m]; one of a hole has what was inside outside, `sign`
    -1."""

    surface: Surface
    middle: np.ndarray
    axes: np.ndarray
    sign: float = 1.0

    @property
    def normal(self) -> np.ndarray | None:
        normal = self.surface.normal
        return None if normal is None else self.sign * self.axes @ normal

    def _back(self, points: np.ndarray) -> np.ndarray:
        return self.middle + (points - self.middle) @ self.axes

    def _forth(self, points: np.ndarray) -> np.ndarray:
        return self.middle + (points - self.middle) @ self.axes.T

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        height, gradient = self.surface.height(self._back(points))
        return self.sign * height, self.sign * gradient @ self.axes.T

    def nearest(self, points: np.ndarray) -> np.ndarray:
        return self._forth(self.surface.nearest(self._back(points)))

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        points, areas = self.surface.samples(spacing)
        return self._forth(points), areas


@dataclass(frozen=True)
class Patch:
    """A surface by its name. The `main` one of a shape, if it has one, takes the name that the shape is given."""

    name: str
    surface: Surface
    main: bool = False

    def within(self, whole: str) -> "Patch":
        """The patch of a shape by the name of `whole`."""
        return replace(self, name=whole if self.main else f"{whole}/{self.name}", main=False)


def placed(patches: Iterable[Patch], middle: np.ndarray, axes: np.ndarray, sign: float = 1.0) -> tuple[Patch, ...]:
    """Patches turned by `axes` about `middle`; with `sign` -1 those of a hole."""
    if sign == 1.0 and (axes == np.eye(len(axes))).all():
        return tuple(patches)
    return tuple(replace(patch, surface=Placed(patch.surface, middle, axes, sign)) for patch in patches)
