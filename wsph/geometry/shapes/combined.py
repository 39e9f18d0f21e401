"""Differences and unions of shapes; the table of all shapes by their `type`."""

# pyright: strict

from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from pydantic.config import JsonDict

from wsph.declarations import example
from wsph.geometry.shapes.ball import Ball
from wsph.geometry.shapes.box import Box
from wsph.geometry.shapes.cylinder import Cylinder
from wsph.geometry.shapes.polygon import Polygon
from wsph.geometry.shapes.ring import Ring
from wsph.geometry.shapes.shape import BaseShape, Edges
from wsph.geometry.shapes.stl import Stl
from wsph.geometry.shapes.surfaces.surface import Patch, placed
from wsph.quantities import as_tuple

_EXAMPLE: JsonDict = {
    "type": "difference",
    "shapes": [
        {"type": "box", "min": [0.0, 0.0], "max": [1.0, 1.0]},
        {"type": "disc", "center": [0.5, 0.5], "radius": 0.2},
    ],
}


class Combined(BaseShape):
    """`difference`: the first of `shapes` without the others; `union`: all of them together."""

    model_config = example(_EXAMPLE)
    type: Literal["difference", "union"]
    shapes: Annotated[tuple["Shape", ...], BeforeValidator(as_tuple), Field(min_length=2)]

    @model_validator(mode="after")
    def _of_one_dimension(self) -> "Combined":
        if len({shape.dim for shape in self.shapes}) > 1:
            raise ValueError(f"its shapes have {', '.join(str(s.dim) for s in self.shapes)} coordinates: not the same")
        return self

    @property
    def dim(self) -> int:
        return self.shapes[0].dim

    @property
    def unscaled(self) -> bool:
        return any(shape.unscaled for shape in self.shapes)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        corners = np.concatenate([s.corners() for s in (self.shapes if self.type == "union" else self.shapes[:1])])
        return corners.min(0), corners.max(0)

    def edges(self) -> Edges:
        upright = [shape.edges() for shape in self.shapes if shape.rotate == 0.0]
        return [np.unique(np.concatenate([np.zeros(0), *(e[k] for e in upright)])) for k in range(self.dim)]

    def holds(self, points: np.ndarray) -> np.ndarray:
        first, *rest = (shape.contains(points) for shape in self.shapes)
        others = np.any(rest, axis=0)
        return first | others if self.type == "union" else first & ~others

    def surfaces(self) -> tuple[Patch, ...]:
        """Those of all its shapes, each under its name or, without one, as TYPE-1, TYPE-2, ..."""
        found: list[Patch] = []
        numbers: dict[str, int] = {}
        for k, shape in enumerate(self.shapes):
            numbers[shape.type] = numbers.get(shape.type, 0) + (shape.name is None)
            patches = shape.patches()
            if shape.name is None:
                patches = tuple(patch.within(f"{shape.type}-{numbers[shape.type]}") for patch in patches)
            sign = -1.0 if self.type == "difference" and k else 1.0
            found += placed(patches, shape.middle, shape.axes, sign)
        return tuple(found)

    def covers(self, points: np.ndarray) -> np.ndarray:
        back = self._back(points)
        return self.shapes[0].covers(back) if self.type == "difference" else self.holds(back)


Shape = Annotated[Box | Ball | Ring | Cylinder | Polygon | Stl | Combined, Field(discriminator="type")]
"""Every shape that a body can have."""
Combined.model_rebuild()
