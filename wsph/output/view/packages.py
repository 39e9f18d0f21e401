"""The packages that pictures need, imported where they are."""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportMissingImports=false

import importlib
import sys
from functools import partial
from io import BytesIO
from types import ModuleType
from typing import TYPE_CHECKING, Any

from wsph.errors import OutputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator


def pyvista() -> ModuleType:
    """pyvista. Raises OutputError where it is not installed."""
    try:
        import pyvista
        import vtk
    except ImportError:
        raise OutputError('pictures need pyvista: pip install "wsph[view]"') from None
    # VTK remarks on standard error that there is no X server, and then draws without one.
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)
    return pyvista


def matplotlib() -> ModuleType:
    """matplotlib, with the modules of figures that belong to no window. Raises OutputError where it is not installed."""
    try:
        for module in ("backends.backend_agg", "cm", "colors", "figure", "ticker"):
            importlib.import_module(f"matplotlib.{module}")
    except ImportError:
        raise OutputError('pictures need matplotlib: pip install "wsph[view]"') from None
    return sys.modules["matplotlib"]


def figure(width: float, height: float) -> "Figure":
    """A figure of that size [inches] that belongs to no window; a notebook shows it where it is the value of a cell."""
    mpl: Any = matplotlib()
    made = mpl.figure.Figure(figsize=(width, height), dpi=DPI)
    mpl.backends.backend_agg.FigureCanvasAgg(made)
    # What pyplot would register for its own figures.
    made._repr_png_ = partial(_png, made)
    return made


def _png(made: Any) -> bytes:
    file = BytesIO()
    made.savefig(file, format="png")
    return file.getvalue()


def ticks(most: int) -> "MaxNLocator":
    """Places of round numbers on an axis, at most so many intervals."""
    mpl: Any = matplotlib()
    return mpl.ticker.MaxNLocator(most, steps=[1, 2, 2.5, 5, 10], min_n_ticks=1)


DPI = 100
"""Pixels of an inch."""
