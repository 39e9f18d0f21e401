"""Frames as pictures take them: from the files of a run, or from a result."""

# pyright: strict
# pyright: reportMissingTypeStubs=false
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wsph.errors import OutputError
from wsph.output.cells import Cells, vertices
from wsph.output.frames import COPIES
from wsph.output.view.packages import pyvista

if TYPE_CHECKING:
    from pyvista import UnstructuredGrid


@dataclass(frozen=True)
class Shot:
    """A frame: its `grid` (pyvista's), `time` [s], `units` by field, names of the `bodies`, and whether points are where
    particles are."""

    grid: "UnstructuredGrid"
    time: float
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    bodies: tuple[str, ...] = ()
    moved: bool = True

    @property
    def flat(self) -> int:
        """How many of the coordinates differ among its points: dimensions of the picture."""
        ends = np.reshape(self.grid.bounds, (3, 2))
        return int((ends[:, 1] > ends[:, 0]).sum())

    def body(self, name: str) -> "Shot":
        """One body of it. Raises OutputError for a name that there is not."""
        if name not in self.bodies:
            raise OutputError(f"no body {name!r}; there is {', '.join(self.bodies)}")
        number = self.bodies.index(name)
        cells = self.grid.cell_data if "body" in self.grid.cell_data else self.grid.point_data
        return replace(self, grid=self.grid.extract_cells(np.flatnonzero(np.asarray(cells["body"]) == number)))

    def whole(self, most: float) -> "Shot":
        """What is damaged up to that. Raises OutputError where nothing has a damage."""
        in_cells = "damage" in self.grid.cell_data
        if not in_cells and "damage" not in self.grid.point_data:
            raise OutputError('--broken needs the damage: add "damage" to output.fields of the scene')
        if in_cells:
            beyond = np.asarray(self.grid.cell_data["damage"]) > most
        else:
            sizes = np.asarray(self.grid.point_data["damage"])
            corners, starts = np.asarray(self.grid.cell_connectivity), _offsets(self.grid)[:-1]
            beyond = np.minimum.reduceat(sizes[corners], starts) > most
        return replace(self, grid=self.grid.extract_cells(np.flatnonzero(~beyond)))

    def warped(self, factor: float) -> "Shot":
        """With displacements times a factor. Raises OutputError where the frame has none."""
        if "displacement" not in self.grid.point_data:
            raise OutputError('--warp needs displacements: add "displacement" to output.fields of the scene')
        grid, moved = self.grid.copy(deep=False), np.asarray(self.grid.point_data["displacement"], float)
        places = np.asarray(self.grid.points, float) + (factor - float(self.moved)) * np.nan_to_num(moved)
        # The copy shares its points: it is to have others.
        grid.SetPoints(pyvista().vtk_points(places))
        return replace(self, grid=grid)


def frames(folder: Path) -> list[tuple[float, Path]]:
    """Time and file of every frame that the folder's index lists. Raises OutputError where there is none."""
    index = folder / "frames.pvd"
    if not index.exists():
        raise OutputError(f"{folder}: no frames.pvd; is it the folder of a run that wrote vtu?")
    try:
        found = re.findall(r'timestep="([^"]+)".*?file="([^"]+)"', index.read_text(encoding="utf-8"))
        listed = [(float(time), folder / name) for time, name in found]
    except (OSError, ValueError) as error:
        raise OutputError(f"{index}: cannot be read: {error}") from None
    if not listed:
        raise OutputError(f"{folder}: frames.pvd lists no frame")
    return listed


def words(grid: "UnstructuredGrid", name: str) -> list[str]:
    """The texts of a frame's field data: the names of an array's components, or the array's own."""
    array = grid.GetFieldData().GetAbstractArray(name)
    named = [array.GetComponentName(k) for k in range(array.GetNumberOfComponents())]
    return [str(word) for word in (named if all(named) else grid.field_data[name])]


def read(time: float, path: Path) -> Shot:
    """A frame from its file. Raises OutputError."""
    if not path.is_file():
        raise OutputError(f"{path}: is listed, but not there")
    grid = pyvista().read(path)
    if grid.n_points == 0:
        raise OutputError(f"{path}: holds no particle, or is damaged")
    about = {name: words(grid, name) for name in ("bodies", "positions", "units") if name in grid.field_data}
    units = dict(word.rsplit(": ", 1) for word in about.get("units", []))
    if COPIES in grid.point_data:
        grid = _welded(grid)
    return Shot(grid, time, units, tuple(about.get("bodies", ())), about.get("positions") != ["reference"])


def _welded(grid: "UnstructuredGrid") -> "UnstructuredGrid":
    """A grid of parts without copies of particles: its cells have the particles themselves, which come in their order."""
    ids, own = np.asarray(grid.point_data["id"]), np.flatnonzero(np.asarray(grid.point_data[COPIES]) == 0)
    order = own[np.argsort(ids[own])]
    corners = np.searchsorted(ids[order], ids)[np.asarray(grid.cell_connectivity)]
    made = _grid(corners, _offsets(grid)[1:], np.asarray(grid.celltypes), np.asarray(grid.points)[order])
    for name in grid.point_data:
        if name != COPIES:
            made.point_data[name] = np.asarray(grid.point_data[name])[order]
    for name in grid.cell_data:
        made.cell_data[name] = np.asarray(grid.cell_data[name])
    return made


def _offsets(grid: "UnstructuredGrid") -> np.ndarray:
    """Where the corners of each cell begin, and where the last ones end; the name of pyvista's own has changed."""
    return np.asarray(pyvista().convert_array(grid.GetCells().GetOffsetsArray()))


def _grid(corners: np.ndarray, ends: np.ndarray, types: np.ndarray, points: np.ndarray) -> "UnstructuredGrid":
    """A grid of cells: the corners of all, where those of each end, and their kinds."""
    many = np.diff(ends, prepend=0)
    # VTK wants the number of its corners in front of every cell.
    return pyvista().UnstructuredGrid(np.insert(corners.astype(np.int64), ends - many, many), types, points)


def shot(
    particles: Mapping[str, np.ndarray],
    time: float,
    cells: Cells | None = None,
    units: Mapping[str, str] | None = None,
    bodies: tuple[str, ...] = (),
) -> Shot:
    """A frame from fields of particles by name, `position` (n, dim) [m] among them, and their cells."""
    cells = cells or vertices(len(particles["position"]))
    corners, ends, types = cells.flat
    places = np.asarray(particles["position"], float)
    grid = _grid(corners, ends, types, np.pad(places, ((0, 0), (0, 3 - places.shape[1]))))
    for name, values in particles.items():
        if name != "position":
            grid.point_data[name] = _padded(values)
    for name, values in cells.data.items():
        grid.cell_data[name] = _padded(values)
    return Shot(grid, time, units or {}, bodies, moved=False)


def _padded(values: np.ndarray) -> np.ndarray:
    if values.ndim == 2 and values.shape[1] == 1:
        return values[:, 0]
    return np.pad(values, ((0, 0), (0, 1))) if values.ndim == 2 and values.shape[1] == 2 else values
