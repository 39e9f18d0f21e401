"""Shapes of tools as the numbers that kernels take, and what follows from them: where they are, and how heavy they turn."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass, field

import numpy as np

from wsph.backend.space import Space, Struct
from wsph.contact.tools.gaps import KINDS, shape_struct
from wsph.contact.tools.triangles import Mesh, triangles_of
from wsph.geometry.shapes.shape import rotation_matrix
from wsph.scene.touch.tools import Box, Cylinder, Plane, Sphere, Tool

FAR = 3.0
"""Depth [spacings] below which a tree of triangles does not look."""


@dataclass(frozen=True)
class Form:
    """A shape of a tool [m]: its `kind`; `middle` (dim,), its centre of mass where it has one, and `gyration` (3, 3), its
    inertia about that over its mass. What the kernels take: `axis`, `radius`, `half`, `axes`; `corners` (f, 3, 3) of
    triangles."""

    kind: str
    middle: np.ndarray
    gyration: np.ndarray
    axis: np.ndarray
    axes: np.ndarray
    radius: float = 0.0
    half: np.ndarray = field(default_factory=lambda: np.zeros(0))
    corners: np.ndarray | None = None
    hole: bool = False

    @property
    def dim(self) -> int:
        """Dimensions."""
        return len(self.middle)

    @property
    def points(self) -> tuple[np.ndarray, float]:
        """Points (k, dim) [m] from the middle and a radius: the shape as balls about points, which is whole for a ball, and
        for a box as far as a plane is concerned."""
        if self.kind == "sphere":
            return np.zeros((1, self.dim)), self.radius
        signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * self.dim, indexing="ij"), -1).reshape(-1, self.dim)
        return signs * self.half @ self.axes.T, 0.0

    @property
    def round(self) -> bool:
        """Whether it is a ball."""
        return self.kind == "sphere" and not self.hole

    def reach(self, about: np.ndarray) -> float:
        """How far from a point (dim,) [m] it can touch anything; infinite for a shape without ends."""
        apart = float(np.linalg.norm(self.middle - about))
        size = {"sphere": self.radius, "box": float(np.linalg.norm(self.half))}.get(self.kind, np.inf)
        if self.corners is not None:
            size = float(np.linalg.norm(self.corners - self.middle, axis=2).max())
        return apart + size

    def footprint(self, margin: float) -> float:
        """The largest area [m^2] (2D: length) of a body that can touch it at once: half of its surface, where that has
        an end and is not a hole's, `margin` [m] further out."""
        if self.corners is not None and not self.hole:
            a, b, c = np.moveaxis(self.corners, 1, 0)
            area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
            return 0.5 * area * (1.0 + margin / self.reach(self.middle)) ** 2
        if self.round:
            return np.pi * (self.radius + margin) if self.dim == 2 else 2.0 * np.pi * (self.radius + margin) ** 2
        if self.kind == "box" and not self.hole:
            sides = 2.0 * (self.half + margin)
            return (
                float(sides.sum())
                if self.dim == 2
                else float(sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0])
            )
        return np.inf

    def arm(self, points: np.ndarray) -> np.ndarray:
        """How far from the middle a force at `points` (n, dim) [m] can be, where it touches the shape, (n,)."""
        if self.kind == "sphere":
            return np.full(len(points), self.radius)
        if self.kind == "box":
            return np.full(len(points), float(np.linalg.norm(self.half)))
        if self.corners is not None:
            return np.full(len(points), float(np.linalg.norm(self.corners - self.middle, axis=2).max()))
        return np.linalg.norm(points - self.middle, axis=1)

    def on_device(self, about: np.ndarray, spacing: float, length: float, space: Space, device: str) -> "Placed":
        """In the frame of a tool whose point is `about` (dim,) [m]; lengths in units of `length`; `spacing` [m] that of the
        finest body it is against."""
        made, real = shape_struct(space)(), space.scalar
        made.kind = KINDS.index(self.kind)
        made.center = space.vec(*((self.middle - about) / length))
        made.axis, made.axes = space.vec(*self.axis), space.mat(*self.axes.ravel())
        made.radius, made.sign = real(self.radius / length), real(-1.0 if self.hole else 1.0)
        made.half = space.vec(*((self.half if len(self.half) else np.zeros(self.dim)) / length))
        mesh = None
        if self.corners is not None:
            mesh = triangles_of((self.corners - about) / length, space, device, FAR * spacing / length)
            made.mesh = mesh.struct
        return Placed(self.kind, made, mesh)


@dataclass(frozen=True)
class Placed:
    """A shape on the device, for the gap of its `kind`; its triangles live as long as it."""

    kind: str
    struct: Struct
    mesh: Mesh | None


def form_of(tool: Tool, dim: int) -> Form:
    """The shape of a tool."""
    shape, unit = tool.shape, np.eye(dim)
    match shape:
        case Plane():
            normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
            return Form("plane", np.array(shape.point), np.zeros((3, 3)), normal, unit)
        case Sphere():
            r2 = shape.radius**2
            gyration = np.diag([0.0, 0.0, 0.5 * r2]) if dim == 2 else 0.4 * r2 * np.eye(3)
            return Form("sphere", np.array(shape.center), gyration, unit[0], unit, shape.radius, hole=tool.inside)
        case Cylinder():
            return _cylinder(shape, tool.inside)
        case Box():
            low, high = np.array(shape.start), np.array(shape.end)
            axes, sides = rotation_matrix(shape.rotate, dim), high - low
            gyration = np.zeros((3, 3))
            squares = np.zeros(3)
            squares[:dim] = sides**2 / 12.0
            turned = np.eye(3)
            turned[:dim, :dim] = axes
            gyration = turned @ np.diag(squares.sum() - squares) @ turned.T
            if dim == 2:
                gyration = np.diag([0.0, 0.0, gyration[2, 2]])
            middle = 0.5 * (low + high)
            return Form("box", middle, gyration, unit[0], axes, half=0.5 * sides, hole=tool.inside)
        case _:
            triangles = shape.triangulation
            axes = shape.axes
            corners = (triangles.vertices[triangles.faces] - shape.middle) @ axes.T + shape.middle
            middle, gyration = _of_triangles(corners)
            return Form("stl", middle, gyration, unit[0], unit, corners=corners, hole=tool.inside)


def _cylinder(shape: Cylinder, hole: bool) -> Form:
    way = np.array(shape.end) - np.array(shape.start)
    length = float(np.linalg.norm(way))
    axis = way / length
    across = np.eye(3)[int(np.abs(axis).argmin())]
    across = across - (across @ axis) * axis
    across /= np.linalg.norm(across)
    axes = np.stack([across, np.cross(axis, across), axis], 1)
    r2 = shape.radius**2
    tilt = r2 / 4.0 + length**2 / 12.0
    gyration = axes @ np.diag([tilt, tilt, 0.5 * r2]) @ axes.T
    middle = 0.5 * (np.array(shape.start) + np.array(shape.end))
    return Form("cylinder", middle, gyration, axis, axes, shape.radius, hole=hole)


def _of_triangles(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass and gyration of the inside of closed triangles (f, 3, 3), of uniform density: sums over the
    tetrahedra between each and a point."""
    about = corners.reshape(-1, 3).mean(0)
    a, b, c = np.moveaxis(corners - about, 1, 0)
    volume = (np.cross(a, b) * c).sum(1) / 6.0
    whole = float(volume.sum())
    middle = volume @ (a + b + c) / (4.0 * whole)
    second = np.zeros((3, 3))
    for each in (a, b, c, a + b + c):
        second += np.einsum("f,fi,fj->ij", volume, each, each) / 20.0
    second = second / whole - np.outer(middle, middle)
    return about + middle, float(np.trace(second)) * np.eye(3) - second


def zeros3(numbers: np.ndarray) -> np.ndarray:
    """Up to three numbers as three."""
    return np.pad(np.asarray(numbers, float), (0, 3 - len(numbers)))
