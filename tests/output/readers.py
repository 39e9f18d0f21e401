"""VTK's own readers of frames: the classes that ParaView reads them with."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pv, vtk = pytest.importorskip("pyvista"), pytest.importorskip("vtk")

Reader = Callable[[Path, int], Any]
"""Gives the grid of one frame of a run's folder, by its number."""


def vtu(folder: Path, number: int) -> Any:
    """The part that frames.pvd names."""
    reader = pv.get_reader(folder / "frames.pvd")
    reader.set_active_time_value(reader.time_values[number])
    return reader.read()[0]


def vtkhdf(folder: Path, number: int) -> Any:
    """A step of frames.vtkhdf."""
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / "frames.vtkhdf"))
    reader.UpdateInformation()
    reader.SetStep(number)
    reader.Update()
    return pv.wrap(reader.GetOutput())


def vtkhdf_alone(folder: Path, number: int) -> Any:
    """A frame's file by itself."""
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / "frames" / f"frame_{number:06d}.vtkhdf"))
    reader.Update()
    return pv.wrap(reader.GetOutput())


def xdmf(folder: Path, number: int) -> Any:
    """A grid of the series in frames.xdmf."""
    reader = vtk.vtkXdmfReader()
    reader.SetFileName(str(folder / "frames.xdmf"))
    reader.UpdateInformation()
    reader.UpdateTimeStep(times(reader)[number])
    output = reader.GetOutputDataObject(0)
    return pv.wrap(output if output.IsA("vtkUnstructuredGrid") else output.GetBlock(0))


def times(reader: Any) -> list[float]:
    """The times that a reader says its file has."""
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    return list(reader.GetOutputInformation(0).Get(key) or ())


READERS: dict[str, Reader] = {each.__name__: each for each in (vtu, vtkhdf, vtkhdf_alone, xdmf)}
FORMATS = ["vtu", "vtkhdf", "xdmf", "npz"]


def volumes(grid: Any) -> Any:
    """Volumes of the cells by VTK's filter, areas and lengths in 2D and 1D."""
    sizes = grid.compute_cell_sizes(length=True, area=True, volume=True)
    return sum(sizes.cell_data[name] for name in ("Length", "Area", "Volume"))
