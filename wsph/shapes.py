"""Shapes of bodies: what is inside, and the box that encloses it. Coordinates are metres, arrays (n, dim)."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator

from wsph.units import quantity


def _length(value: object) -> float:
    return quantity(value, "m")


Length = Annotated[float, BeforeValidator(_length)]


class Box(BaseModel):
    """An axis-parallel box (a segment in 1D, a rectangle in 2D) from corner `min` to corner `max`."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)

    type: Literal["box"]
    min: Annotated[tuple[Length, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]
    max: Annotated[tuple[Length, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]

    @model_validator(mode="after")
    def _ordered(self) -> "Box":
        if len(self.min) != len(self.max):
            raise ValueError(f"min has {len(self.min)} coordinates and max {len(self.max)}")
        if any(a >= b for a, b in zip(self.min, self.max, strict=True)):
            raise ValueError(f"min {list(self.min)} must lie below max {list(self.max)} on every axis")
        return self

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return len(self.min)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner [m]."""
        return np.array(self.min), np.array(self.max)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which of `points` (n, dim) lie inside or on the surface, (n,) bool."""
        low, high = self.bounds()
        return np.all((points >= low) & (points <= high), axis=1)

    def cells(self, spacing: float) -> np.ndarray:
        """Number of cells of edge `spacing` along each axis. Raises ValueError where they do not fit to 1e-6."""
        low, high = self.bounds()
        ratio = (high - low) / spacing
        if not np.isfinite(ratio).all() or ratio.max() > 1e15:
            raise ValueError(f"{spacing:g} m is too small for a box of {(high - low).max():g} m")
        count = np.rint(ratio)
        for axis in np.flatnonzero((np.abs(ratio - count) > 1e-6 * np.maximum(ratio, 1.0)) | (count < 1)):
            edge = high[axis] - low[axis]
            fitting = sorted({edge / max(np.floor(ratio[axis]), 1), edge / np.ceil(ratio[axis])})
            raise ValueError(
                f"{spacing:g} m does not divide the box's {'xyz'[axis]} edge of {edge:g} m; the nearest that do: {' m, '.join(f'{f:.12g}' for f in fitting)} m"
            )
        return count.astype(int)


Shape = Box
"""Every shape that a body can have."""
