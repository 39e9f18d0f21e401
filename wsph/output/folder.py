"""The output folder: frames, probes, history and summary, each written under a temporary name and renamed.

A kill at any instant leaves a readable folder: the index files name only frames that are complete. The traps of the file
formats stay behind this module: 1D and 2D points are padded to 3D, symmetric tensors are six columns in VTK's order (XDMF
reads another order and gets nine), nothing is boolean or half precision.
"""

import csv
import io
import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wsph.errors import OutputError
from wsph.output.files import own_files, write_atomically, write_text
from wsph.output.npz import write_npz
from wsph.output.vtu import write_vtu
from wsph.output.xdmf import data_item, write_h5, xml_text


class OutputFolder:
    """Writes one run. Creates the folder; an earlier run in it is removed first (`check_writable` has allowed it)."""

    def __init__(self, folder: Path, formats: tuple[str, ...], dim: int, times: list[Any] | None = None):
        """`times`: the frames up to the checkpoint that the run in the folder goes on from."""
        self.folder, self.formats, self.dim = folder, formats, dim
        self.times: list[tuple[float, int, list[str]]] = [(t, n, list(names)) for t, n, names in times or []]
        try:
            for path in own_files(folder) if times is None else ():
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
            writer = {"vtu": write_vtu, "npz": write_npz, "xdmf": write_h5}[extension]
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
        write_text(self.folder / "frames.pvd", xml_text(root))

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
            data_item(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), f"{n} 3", f"{source}:/position")
            for entry in names:
                name, width = entry.rsplit(":", 1)
                kind = {"1": "Scalar", "3": "Vector", "6": "Tensor"}.get(width, "Matrix")
                attribute = ElementTree.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center="Node")
                data_item(attribute, {"1": f"{n}", "6": f"{n} 9"}.get(width, f"{n} {width}"), f"{source}:/{name}")
        write_text(self.folder / "frames.xdmf", xml_text(root))

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
