"""The image of bodies, without words: cells as surfaces, particles as squares or balls of the size of their spacing."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wsph.output.cells import KINDS
from wsph.output.view.look import Look
from wsph.output.view.packages import pyvista
from wsph.output.view.recorded import Shot
from wsph.output.view.scalars import Scalar
from wsph.output.view.window import Window

if TYPE_CHECKING:
    from pyvista import Plotter, PolyData, UnstructuredGrid

SHOWN = "shown"
"""The name that the scalar of a picture has in its meshes."""

SHARP = 40.0
"""Edges between surfaces at this angle, and ends of surfaces, are drawn [degrees]."""

LEVEL = 1e-6
"""Of a body's size: what is as near to a plane lies in it."""

SAMPLE = 300
"""Particles whose nearest neighbours say how large particles are drawn."""


@dataclass(frozen=True)
class Drawn:
    """What of a frame is drawn: `surface`, None where there are no cells, and `points` that are none's corners."""

    surface: "PolyData | None"
    points: "UnstructuredGrid | None"
    size: np.ndarray
    """Of a particle, along the axes (3,) [m]."""

    @property
    def bounds(self) -> tuple[float, ...]:
        """(6,) [m], with the size of particles."""
        ends: list[np.ndarray] = []
        if self.surface is not None:
            ends.append(np.reshape(self.surface.bounds, (3, 2)))
        if self.points is not None:
            own = np.reshape(self.points.bounds, (3, 2))
            thick = 0.5 * self.size
            ends.append(np.stack([own[:, 0] - thick, own[:, 1] + thick], 1))
        both = np.stack([np.min([e[:, 0] for e in ends], 0), np.max([e[:, 1] for e in ends], 0)], 1)
        return tuple(both.ravel().tolist())


def drawn(shot: Shot, shown: Scalar, look: Look) -> Drawn:
    """The meshes of a frame, cut as the look says, with the numbers that are shown."""
    grid = shot.grid.copy(deep=False)
    grid.clear_data()
    (grid.cell_data if shown.in_cells else grid.point_data)[SHOWN] = shown.values
    alone = np.asarray(grid.celltypes) == KINDS["vertex"].vtk
    size = np.zeros(3)
    points = surface = None
    if alone.any():
        points = grid.extract_cells(np.flatnonzero(alone)) if not alone.all() else grid
        size = _spacings(np.asarray(points.points, float))
        points = _cut(points, look, points=True)
    if not alone.all():
        surface = _cut(grid.extract_cells(np.flatnonzero(~alone)) if alone.any() else grid, look, points=False)
        if look.slice is None:
            surface = surface.extract_surface(algorithm="dataset_surface", pass_pointid=False, pass_cellid=False)
    return Drawn(surface, points, size)


def _cut(mesh: Any, look: Look, points: bool) -> Any:
    """A mesh behind a clip or in a slice; of points the layer at it."""
    if look.slice is not None:
        origin, axis = look.slice.origin(mesh.bounds), look.slice.axis
        if not points:
            return mesh.slice(normal="xyz"[axis], origin=origin)
        places = np.asarray(mesh.points)
        near = np.abs(places[:, axis] - origin[axis])
        return mesh.extract_points(
            near < 1.001 * max(float(near.min()), 0.5 * _spacings(places)[axis]), adjacent_cells=False
        )
    if look.clip is not None:
        origin = look.clip.origin(mesh.bounds)
        return mesh.clip(normal="xyz"[look.clip.axis], origin=origin, invert=not look.clip.above)
    return mesh


def edges(surface: "PolyData", look: Look, flat: bool) -> "PolyData":
    """The lines that are drawn of a surface: its ends, and, where it is not flat, its sharp edges."""
    return _uncut(surface, look).extract_feature_edges(
        SHARP, boundary_edges=True, feature_edges=not flat, manifold_edges=False, non_manifold_edges=False
    )


def _uncut(surface: Any, look: Look) -> Any:
    """A surface without what a clip has laid open, whose rim is then an end. Slivers of cells in there, which nodes beside
    the plane leave, have normals of any direction: edges between them are no edges of the body."""
    if look.clip is None:
        return surface
    axis = look.clip.axis
    low, high = surface.bounds[2 * axis : 2 * axis + 2]
    at = low if look.clip.above else high
    there = np.abs(np.asarray(surface.points)[:, axis] - at) <= LEVEL * (high - low)
    corners = np.asarray(surface.GetPolys().GetConnectivityArray())
    first = np.asarray(surface.GetPolys().GetOffsetsArray())
    left = ~np.logical_and.reduceat(there[corners], first[:-1])
    return (
        surface.extract_cells(np.flatnonzero(left)).extract_surface(algorithm="dataset_surface")
        if left.any()
        else surface
    )


def _spacings(points: np.ndarray) -> np.ndarray:
    """The typical distance of a particle from its nearest neighbours along each axis, (3,) [m]; zero where all are level."""
    some = np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(int)
    gaps = np.full((len(some), 3), np.inf)
    for row, k in enumerate(some):
        apart = np.abs(points - points[k])
        along = apart.argmax(1)
        for axis in range(3):
            mine = apart[(along == axis) & (apart[:, axis] > 0.0), axis]
            gaps[row, axis] = mine.min(initial=np.inf)
    found = np.median(gaps, axis=0)
    level = np.ptp(points, axis=0) == 0.0
    return np.where(level, 0.0, np.where(np.isfinite(found), found, found[np.isfinite(found)].min(initial=1.0)))


def _squares(points: np.ndarray, size: np.ndarray) -> Any:
    """A rectangle of that size (3,) about every point, across the axis along which it has none."""
    across = np.flatnonzero(size > 0.0)[:2] if (size > 0.0).any() else np.array([0, 1])
    steps = np.zeros((4, 3))
    for corner, (a, b) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1))):
        steps[corner, across] = (0.5 * a * size[across[0]], 0.5 * b * size[across[-1]])[: len(across)]
    corners = (points[:, None] + steps).reshape(-1, 3)
    rows = np.insert(np.arange(len(corners)), np.arange(len(points)) * 4, 4)
    return pyvista().PolyData(corners, rows)


def paint(plotter: "Plotter", bodies: Drawn, look: Look, limits: tuple[float, float], flat: bool, pixel: float) -> None:
    """Put the meshes into a pyvista plotter; `pixel` [m] is the size of one."""
    shared: dict[str, Any] = {
        "scalars": SHOWN,
        "cmap": look.colours,
        "clim": list(limits),
        "nan_color": "lightgray",
        "lighting": not flat,
        # Colours are to be read: light tells shapes, and leaves them.
        "ambient": 0.6,
        "diffuse": 0.45,
        "show_scalar_bar": False,
    }
    if bodies.surface is not None and bodies.surface.n_points:
        plotter.add_mesh(bodies.surface, show_edges=look.mesh, edge_color="dimgray", **shared)
        lines = edges(bodies.surface, look, flat)
        if lines.n_points:
            plotter.add_mesh(lines, color="black", line_width=1.5, lighting=False)
    if bodies.points is not None and bodies.points.n_points:
        places = np.asarray(bodies.points.points, float)
        inside = SHOWN in bodies.points.cell_data
        values = np.asarray((bodies.points.cell_data if inside else bodies.points.point_data)[SHOWN])
        if flat:
            cloud = _squares(places, 1.1 * bodies.size)
            cloud.cell_data[SHOWN] = values
            plotter.add_mesh(cloud, **shared)
        else:
            cloud = pyvista().PolyData(places)
            cloud[SHOWN] = values
            size = float(np.clip(1.1 * bodies.size[bodies.size > 0.0].mean() / pixel, 2.0, 60.0))
            plotter.add_mesh(cloud, point_size=size, render_points_as_spheres=True, **shared)


def image(
    bodies: Drawn, look: Look, limits: tuple[float, float], window: Window, pixels: tuple[int, int], flat: bool
) -> np.ndarray:
    """The bodies in a window, (height, width, 3) uint8, on white."""
    plotter = pyvista().Plotter(off_screen=True, window_size=list(pixels))
    plotter.set_background("white")
    paint(plotter, bodies, look, limits, flat, window.width / pixels[0])
    point_at(plotter, window)
    if flat or bodies.points is None:
        # It makes balls smaller.
        plotter.enable_anti_aliasing("ssaa")
    found = np.array(plotter.screenshot(return_img=True))
    plotter.close()
    return found[..., :3]


def point_at(plotter: "Plotter", window: Window) -> None:
    """Point a plotter's camera at a window."""
    far = float(np.linalg.norm(window.high - window.low)) + window.width + window.height
    camera = plotter.camera
    camera.focal_point = window.centre.tolist()
    camera.position = (window.centre + far * window.towards).tolist()
    camera.up = window.up.tolist()
    camera.parallel_projection = True
    camera.parallel_scale = window.height / 2.0
    camera.clipping_range = (1e-3 * far, 3.0 * far)
