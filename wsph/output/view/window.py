"""The part of space that a picture shows, and how it lies on the page: a parallel projection."""

# pyright: strict

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np

from wsph.output.view.look import CAMERAS

THINNEST = 0.12
"""A window is at least this high for its width, and that wide for its height."""

MARGIN = 0.02
"""Room around what is shown, in its larger extent."""


@dataclass(frozen=True)
class Window:
    """A rectangle across the direction `towards` the eye (3,): its axes `right` and `up` (3,), where its middle is along
    them [m], `width` and `height` [m]; `low` and `high` (3,) [m] of what it shows."""

    towards: np.ndarray
    right: np.ndarray
    up: np.ndarray
    middle: tuple[float, float]
    width: float
    height: float
    low: np.ndarray
    high: np.ndarray

    @property
    def aspect(self) -> float:
        """Height over width."""
        return self.height / self.width

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top, along its axes [m]."""
        x, y = self.middle
        return x - self.width / 2, x + self.width / 2, y - self.height / 2, y + self.height / 2

    @property
    def axes(self) -> tuple[int, int] | None:
        """The coordinates that run along the page, None where it is seen at an angle."""
        along = [np.flatnonzero(np.abs(axis) > 1.0 - 1e-12) for axis in (self.right, self.up)]
        return (int(along[0][0]), int(along[1][0])) if all(map(len, along)) else None

    def onto(self, points: np.ndarray) -> np.ndarray:
        """Where points (m, 3) [m] are on the page, (m, 2) [m]."""
        return points @ np.stack([self.right, self.up], 1)

    @property
    def centre(self) -> np.ndarray:
        """The point in space that is in the middle of the page, (3,) [m]."""
        middle = 0.5 * (self.low + self.high)
        shift = np.array(self.middle) - self.onto(middle[None])[0]
        return middle + shift[0] * self.right + shift[1] * self.up


def window(bounds: Iterable[tuple[float, ...]], camera: str) -> Window:
    """The window that holds all of some bounds, (6,) [m] each, as a camera sees them."""
    ends = np.array(list(bounds)).reshape(-1, 3, 2)
    low, high = ends[..., 0].min(0), ends[..., 1].max(0)
    towards, up = (np.array(each) for each in CAMERAS[camera])
    towards = towards / np.linalg.norm(towards)
    right = np.cross(up, towards)
    right = right / np.linalg.norm(right)
    up = np.cross(towards, right)
    corners = np.array([[(low, high)[side][k] for k, side in enumerate(sides)] for sides in product((0, 1), repeat=3)])
    seen = corners @ np.stack([right, up], 1)
    least, most = seen.min(0), seen.max(0)
    extent = most - least
    room = 2.0 * MARGIN * (float(extent.max()) or 1.0)
    width, height = (float(each) + room for each in extent)
    width, height = max(width, THINNEST * height), max(height, THINNEST * width)
    middle = 0.5 * (least + most)
    return Window(towards, right, up, (float(middle[0]), float(middle[1])), width, height, low, high)
