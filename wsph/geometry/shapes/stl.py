"""A part from an STL file."""

# pyright: strict

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from wsph.declarations import example
from wsph.geometry.shapes.shape import BaseShape
from wsph.geometry.shapes.stl_file import read_stl
from wsph.geometry.shapes.surfaces.surface import Patch
from wsph.geometry.shapes.triangulation import Triangulation, triangulate
from wsph.quantities import Positive, Unit


class Stl(BaseShape):
    """The inside of the closed surface in an STL `file` (3D), whose unit is `scale`, 1 m without it. Edges sharper than
    `angle` degrees part it into the patches patch-0, patch-1, ..., the largest first."""

    model_config = example({"type": "stl", "file": "part.stl", "scale": "1 mm"})
    type: Literal["stl"] = "stl"
    file: Annotated[str, Field(min_length=1)]
    scale: Positive = 1.0
    angle: Annotated[float, Unit("", gt=0, le=180)] = 30.0

    @model_validator(mode="after")
    def _readable(self) -> "Stl":
        self.triangulation  # noqa: B018
        return self

    @property
    def triangulation(self) -> Triangulation:
        """The triangles in metres. Raises ValueError, with the file's name, where they are no closed surface."""
        path = Path(self.file)
        try:
            state = path.stat()
        except OSError:
            raise ValueError(f"{path}: no such file") from None
        return _triangulation(path, (state.st_mtime_ns, state.st_size), self.scale, self.angle)

    @property
    def dim(self) -> int:
        return 3

    @property
    def unscaled(self) -> bool:
        return "scale" not in self.model_fields_set

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        vertices = self.triangulation.vertices
        return vertices.min(0), vertices.max(0)

    def holds(self, points: np.ndarray) -> np.ndarray:
        return self.triangulation.queries.inside(points)

    def surfaces(self) -> tuple[Patch, ...]:
        return tuple(Patch(f"patch-{k}", surface) for k, surface in enumerate(self.triangulation.surfaces))


@lru_cache(maxsize=8)
def _triangulation(path: Path, state: tuple[int, int], scale: float, angle: float) -> Triangulation:
    """By the file's `state`, its time and size, so that it is read again when it has changed."""
    try:
        return triangulate(scale * read_stl(path), angle)
    except ValueError as error:
        message = str(error)
        raise ValueError(message if message.startswith(f"{path}: ") else f"{path}: {message}") from None
