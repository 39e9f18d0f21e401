"""Pictures of a run: a field over its particles, off-screen, with pyvista (the extra "view")."""

# pyright: strict
# pyright: reportMissingTypeStubs=false

import os
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wsph.errors import OutputError
from wsph.output.fields import tensor, von_mises

if TYPE_CHECKING:
    from pyvista import Plotter

SIZE = (1000, 700)


def _pyvista() -> Any:
    try:
        import pyvista
        import vtk
    except ImportError:
        raise OutputError('pictures need pyvista: pip install "wsph[view]"') from None
    # VTK remarks on standard error that there is no X server, and then draws without one.
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)
    return pyvista


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


def read(path: Path) -> dict[str, np.ndarray]:
    """A frame's fields by name, with `position` (n, 3)."""
    if not path.is_file():
        raise OutputError(f"{path}: is listed, but not there")
    mesh = _pyvista().read(path)
    if mesh.n_points == 0:
        raise OutputError(f"{path}: holds no particle, or is damaged")
    return {"position": np.array(mesh.points), **{name: np.array(mesh.point_data[name]) for name in mesh.point_data}}


def _scalar(data: dict[str, np.ndarray], name: str) -> tuple[str, np.ndarray]:
    """The scalar that stands for a field in a picture, and its name."""
    match = re.fullmatch(r"(velocity|displacement)_([xyz])", name)
    if match and match[1] in data and "xyz".index(match[2]) < data[match[1]].shape[1]:
        return name, data[match[1]][:, "xyz".index(match[2])]
    match = re.fullmatch(r"stress_(xx|yy|zz|xy|yz|xz)", name)
    if match and "stress" in data:
        return name, data["stress"][:, ("xx", "yy", "zz", "xy", "yz", "xz").index(match[1])]
    if name == "von_mises" and name not in data and "stress" in data:
        return name, von_mises(data["stress"])
    if name not in data:
        raise OutputError(f"no field {name!r} in the frame; there is {', '.join(k for k in data if k != 'position')}")
    values = data[name]
    if values.ndim == 1:
        return name, values
    if name == "stress":
        full = values if values.shape[1] == 6 else tensor(values, ("xx", "yy", "xy"))
        one_dimensional = not np.any(full[:, 1:])
        return ("stress_xx", full[:, 0]) if one_dimensional else ("von_mises", von_mises(full))
    one_dimensional = not np.any(values[:, 1:])
    return (f"{name}_x", values[:, 0]) if one_dimensional else (f"|{name}|", np.linalg.norm(values, axis=1))


def picture(
    data: dict[str, np.ndarray],
    name: str,
    time: float,
    save: str | Path | None = None,
    limits: tuple[float, float] | None = None,
) -> "Plotter | None":
    """Draw a field of particles: a curve over x for a bar, coloured particles otherwise.

    Returns the plotter, or writes `save`.
    """
    if save is not None and Path(save).suffix != ".png":
        raise OutputError(f"{save}: a picture is a .png")
    plotter = _drawn(data, name, time, limits, shown=save is None)
    if save is None:
        return plotter
    try:
        plotter.screenshot(str(save))
    except (OSError, ValueError) as error:  # a link to a file of another kind is a ValueError
        raise OutputError(f"{save}: cannot be written: {error}") from error
    plotter.close()
    return None


def _drawn(data: dict[str, np.ndarray], name: str, time: float, limits: tuple[float, float] | None, shown: bool) -> Any:
    pv = _pyvista()
    label, values = _scalar(data, name)
    points = np.zeros((len(values), 3))
    points[:, : data["position"].shape[1]] = data["position"]
    plotter = pv.Plotter(off_screen=not shown, window_size=list(SIZE))
    title = f"{label}   t = {time:.6g} s"
    there = _finite(values, name)
    low, high = limits or (float(there.min()), float(there.max()))
    if high - low <= 1e-12 * max(abs(high), abs(low)):
        margin = 0.05 * max(abs(high), abs(low)) or 1.0
        low, high = low - margin, high + margin
    if np.ptp(points[:, 1]) == 0.0 and np.ptp(points[:, 2]) == 0.0:
        chart = pv.Chart2D(x_label="x [m]", y_label=label)
        chart.title = title
        order = np.argsort(points[:, 0])
        order = order[np.isfinite(values[order])]
        chart.line(points[order, 0], values[order], color="#1f5fa8", width=3.0)
        chart.y_range = [low - 0.05 * (high - low), high + 0.05 * (high - low)]
        plotter.add_chart(chart)
    else:
        cloud = pv.PolyData(points)
        cloud[label] = values
        flat = np.ptp(points[:, 2]) == 0.0
        extent = np.ptp(points, axis=0).max()
        size = float(np.clip(0.95 * min(SIZE) / max(extent / _spacing(points) + 1.0, 1.0), 2.0, 40.0))
        # One particle at a corner must not leave the rest in one colour: what lies far above has a colour of its own.
        usual = low + 2.0 * (float(np.percentile(there, 99.5)) - low) if limits is None else high
        top = min(high, usual) if usual > low else high
        plotter.add_mesh(
            cloud,
            scalars=label,
            cmap="viridis",
            clim=[low, top],
            nan_color="lightgray",
            above_color="crimson" if top < high else None,
            lighting=not flat,
            render_points_as_spheres=not flat,
            point_size=size,
            scalar_bar_args={"vertical": True, "title": label, "position_x": 0.86, "position_y": 0.2, "height": 0.6},
        )
        plotter.add_text(title, font_size=12)
        if flat:
            plotter.view_xy()
    return plotter


def _finite(values: np.ndarray, name: str) -> np.ndarray:
    """The values that are numbers: a body without the field has none."""
    there = values[np.isfinite(values)]
    if not len(there):
        raise OutputError(f"{name!r} is no finite number anywhere in the frame: there is nothing to draw")
    return there


def _spacing(points: np.ndarray) -> float:
    """Typical distance between particles, from the volume that they fill."""
    extent = np.ptp(points, axis=0)
    extent = extent[extent > 0.0]
    return float((float(extent.prod()) / len(points)) ** (1.0 / len(extent))) if len(extent) else 1.0


def view(folder: Path, name: str, save: Path | None) -> None:
    """Show the last frame of a run, or save it (.png), or the whole run (.gif). Raises OutputError."""
    found = frames(folder)
    if save is None:
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or sys.platform in ("win32", "darwin")):
            raise OutputError("there is no display to show a picture on; save it with --save FILE.png")
        _drawn(read(found[-1][1]), name, found[-1][0], None, shown=True).show()
        return
    if save.suffix == ".png":
        picture(read(found[-1][1]), name, found[-1][0], save)
        return
    if save.suffix != ".gif":
        raise OutputError(f"{save}: a picture is .png or .gif")
    _animate(found, name, save)


def _animate(found: list[tuple[float, Path]], name: str, save: Path) -> None:
    import tempfile

    try:
        from PIL import Image
    except ImportError:
        raise OutputError("a .gif needs pillow: pip install pillow") from None
    loaded = [(time, read(path)) for time, path in found]
    values = [_finite(_scalar(data, name)[1], name) for _, data in loaded]
    limits = (float(min(v.min() for v in values)), float(max(v.max() for v in values)))
    with tempfile.TemporaryDirectory() as folder:
        pages: list[Image.Image] = []
        for k, (time, data) in enumerate(loaded):
            path = Path(folder) / f"{k}.png"
            picture(data, name, time, path, limits)
            with Image.open(path) as page:
                pages.append(page.convert("P"))
        try:
            pages[0].save(save, save_all=True, append_images=pages[1:], duration=100, loop=0)
        except OSError as error:
            raise OutputError(f"{save}: cannot be written: {error.strerror or error}") from error


def undominated(errors: np.ndarray) -> np.ndarray:
    """Which of the errors (n,), by rising cost, are below all that cost less, (n,) bool."""
    before = np.minimum.accumulate(np.concatenate([[np.inf], errors]))[:-1]
    return errors < before


def front(rows: Sequence[Mapping[str, str | int | float]], title: str, save: str | Path) -> None:
    """Error against right-hand sides of a study's rows, a point each, both axes logarithmic. A line joins the front of each
    variant: the rows to which it has no other that is as cheap and as near."""
    pv = _pyvista()
    plotter = pv.Plotter(off_screen=True, window_size=[900, 650])
    chart = pv.Chart2D(x_label="right-hand sides", y_label="relative error")
    colors = ("black", "blue", "red", "green", "orange", "purple", "brown", "cyan", "magenta", "gray")
    for k, name in enumerate(dict.fromkeys(row["variant"] for row in rows)):
        mine = (row for row in rows if row["variant"] == name and row.get("error"))
        found = sorted((float(row["right_hand_sides"]), float(row["error"])) for row in mine)
        if found:
            x, y = np.array(found, float).T
            color = colors[k % len(colors)]
            best = undominated(y)
            chart.line(x[best], y[best], color=color, width=2.0, label=name)
            chart.scatter(x, y, color=color, size=8, style="o")
    chart.x_axis.log_scale = chart.y_axis.log_scale = True
    chart.title = title
    plotter.add_chart(chart)
    plotter.screenshot(str(save))
    plotter.close()
