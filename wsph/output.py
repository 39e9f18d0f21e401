"""The output folder: frames, probes, history and summary, each written under a temporary name and renamed.

A kill at any instant leaves a readable folder: the index files name only frames that are complete. The traps of the file
formats stay behind this module: 1D and 2D points are padded to 3D, symmetric tensors are six columns in VTK's order (XDMF
reads another order and gets nine), nothing is boolean or half precision.
"""

import csv
import io
import json
import math
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np

from wsph.errors import OutputError


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it. Raises OutputError, leaving no debris."""
    temporary = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error


def write_text(path: Path, content: str) -> None:
    """Write a text file whole or not at all. Raises OutputError."""
    write_atomically(path, lambda temporary: _put(temporary, content))


def _put(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8", newline="\n")


def check_writable(folder: Path, overwrite: bool, resume: bool = False) -> None:
    """Whether a run may use `folder`, before anything is computed; leaves nothing behind. Raises OutputError."""
    if "\0" in str(folder):
        raise OutputError("the output folder's name has a NUL character")
    try:
        _check(folder, overwrite or resume)
        ancestor = folder
        while not ancestor.exists():
            ancestor = ancestor.parent
        os.rmdir(tempfile.mkdtemp(prefix=".wsph-", dir=ancestor))
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _check(folder: Path, overwrite: bool) -> None:
    if folder.is_symlink():
        raise OutputError(f"{folder}: is a symbolic link; name the folder itself")
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, not a folder")
    if not any(folder.iterdir()):
        return
    if not overwrite:
        raise OutputError(f"{folder}: holds files already; choose another folder with -o, or give --overwrite")
    if not _is_a_run(folder):
        raise OutputError(f"{folder}: holds no run of wsph, so --overwrite does not touch it")


def _is_a_run(folder: Path) -> bool:
    """A folder that a run made: its summary, or the index of its frames if it was cut off before."""
    try:
        return "particle_steps_per_second" in json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return (folder / "history.csv").is_file() and (folder / "frames").is_dir() and (folder / "probes").is_dir()


def _own_files(folder: Path) -> list[Path]:
    """What an earlier run wrote in a folder, and nothing else."""
    frames = [
        p for p in (folder / "frames").glob("*") if re.fullmatch(r"\.?frame_\d{6}(\.partial)?\.(vtu|h5|npz)", p.name)
    ]
    own = [folder / name for name in ("summary.json", "history.csv", "frames.pvd", "frames.xdmf")]
    own += list((folder / "checkpoints").glob("*checkpoint_*.npz"))
    return [*frames, *(folder / "probes").glob("*.csv"), *own]


class OutputFolder:
    """Writes one run. Creates the folder; an earlier run in it is removed first (`check_writable` has allowed it)."""

    def __init__(self, folder: Path, formats: tuple[str, ...], dim: int, times: list[Any] | None = None):
        """`times`: the frames up to the checkpoint that the run in the folder goes on from."""
        self.folder, self.formats, self.dim = folder, formats, dim
        self.times: list[tuple[float, int, list[str]]] = [(t, n, list(names)) for t, n, names in times or []]
        try:
            for path in _own_files(folder) if times is None else ():
                path.unlink(missing_ok=True)
            (folder / "frames").mkdir(parents=True, exist_ok=True)
            (folder / "probes").mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error

    def frame(self, time: float, points: np.ndarray, data: dict[str, np.ndarray]) -> None:
        """Write one frame: `points` (n, dim) [m], `data` name -> (n,) or (n, width); tensors are (n, 6)."""
        number = len(self.times)
        stem = f"frame_{number:06d}"
        padded = np.zeros((len(points), 3))
        padded[:, : points.shape[1]] = points
        point_data = {name: _padded(values) for name, values in data.items()}
        for extension in self.formats:
            path = self.folder / "frames" / f"{stem}.{'h5' if extension == 'xdmf' else extension}"
            writer = {"vtu": _write_vtu, "npz": _write_npz, "xdmf": _write_h5}[extension]
            write_atomically(path, lambda temporary, writer=writer: writer(temporary, padded, point_data))
        self.times.append(
            (time, len(points), [f"{name}:{1 if v.ndim == 1 else v.shape[1]}" for name, v in point_data.items()])
        )
        if "vtu" in self.formats:
            self._write_pvd()
        if "xdmf" in self.formats:
            self._write_xdmf()

    def _write_pvd(self) -> None:
        root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(root, "Collection")
        for number, (time, _, _) in enumerate(self.times):
            ElementTree.SubElement(
                collection, "DataSet", timestep=repr(time), part="0", file=f"frames/frame_{number:06d}.vtu"
            )
        write_text(self.folder / "frames.pvd", _xml(root))

    def _write_xdmf(self) -> None:
        root = ElementTree.Element("Xdmf", Version="3.0")
        series = ElementTree.SubElement(
            ElementTree.SubElement(root, "Domain"),
            "Grid",
            Name="frames",
            GridType="Collection",
            CollectionType="Temporal",
        )
        for number, (time, n, names) in enumerate(self.times):
            source = f"frames/frame_{number:06d}.h5"
            grid = ElementTree.SubElement(series, "Grid", Name=f"frame {number}", GridType="Uniform")
            ElementTree.SubElement(grid, "Time", Value=repr(time))
            ElementTree.SubElement(grid, "Topology", TopologyType="Polyvertex", NumberOfElements=str(n))
            _data_item(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), f"{n} 3", f"{source}:/position")
            for entry in names:
                name, width = entry.rsplit(":", 1)
                kind = {"1": "Scalar", "3": "Vector", "6": "Tensor"}.get(width, "Matrix")
                attribute = ElementTree.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center="Node")
                _data_item(attribute, {"1": f"{n}", "6": f"{n} 9"}.get(width, f"{n} {width}"), f"{source}:/{name}")
        write_text(self.folder / "frames.xdmf", _xml(root))

    def table(self, name: str, columns: dict[str, Any]) -> None:
        """Write `name` (a path in the folder) as CSV, a column an entry, in the shortest digits that read back the same."""
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*[np.asarray(v).tolist() for v in columns.values()], strict=True))
        write_text(self.folder / name, buffer.getvalue())

    def summary(self, content: dict[str, Any]) -> None:
        """Write summary.json."""
        write_text(
            self.folder / "summary.json",
            json.dumps(_json(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n",
        )


def _json(value: Any) -> Any:
    """JSON has no infinities: null stands for a number that is not finite."""
    if isinstance(value, dict):
        return {key: _json(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _padded(values: np.ndarray) -> np.ndarray:
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    if values.ndim == 2 and values.shape[1] == 1:
        return np.column_stack([values, np.zeros((len(values), 2))])
    return values


def _xml(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _data_item(parent: ElementTree.Element, dimensions: str, source: str) -> None:
    integer = source.endswith(("/id", "/body"))
    item = ElementTree.SubElement(parent, "DataItem", Format="HDF", Dimensions=dimensions,
                                  NumberType="Int" if integer else "Float", Precision="8")  # fmt: skip
    item.text = source


def _write_vtu(path: Path, points: np.ndarray, data: dict[str, np.ndarray]) -> None:
    mesh = meshio.Mesh(points, [("vertex", np.arange(len(points))[:, None])], point_data=data)
    # Uncompressed: zlib writes 6 MB/s where plain bytes write 89.
    meshio.write(path, mesh, file_format="vtu", compression=None)


def _write_npz(path: Path, points: np.ndarray, data: dict[str, np.ndarray]) -> None:
    with open(path, "wb") as file:
        np.savez(file, position=points, **data)


def _write_h5(path: Path, points: np.ndarray, data: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["position"] = points
        for name, values in data.items():
            # ParaView reads XDMF's Tensor6 as xx xy xz yy yz zz; all nine leave nothing to guess.
            file[name] = values[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]] if values.ndim == 2 and values.shape[1] == 6 else values
