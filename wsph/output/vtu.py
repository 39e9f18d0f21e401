"""Frames as VTU, with a PVD index.

The arrays stand behind the XML as they are in memory, so that a frame is written as fast as the disk takes it. Field data,
of the frame as a whole: `TimeValue` [s], names of the `bodies`, in the order of the numbers in "body", `positions`, and
`units`, "NAME: UNIT" of every array; each array has its unit as VTK's UNITS_LABEL too.
"""

# pyright: strict

import sys
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from wsph.output.cells import vertices
from wsph.output.files import write_text, xml_text
from wsph.output.frames import Frame, Listed, Part, parts, stem

TYPES = {"float32": "Float32", "float64": "Float64", "int32": "Int32", "int64": "Int64", "uint8": "UInt8"}
"""VTK's names of numpy's types."""


class Vtu:
    """VTK's unstructured grids: cells, or a vertex a particle."""

    name, needs, suffix, listing, joins = "vtu", "", "vtu", "frames.pvd", "pvtu"

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        count = len(frame.points)
        root, grid = _begin("UnstructuredGrid")
        _field_data(ElementTree.SubElement(grid, "FieldData"), frame)
        cells = vertices(count) if frame.cells is None else frame.cells
        piece = ElementTree.SubElement(grid, "Piece", NumberOfPoints=str(count), NumberOfCells=str(cells.count))
        blocks = _Blocks()
        blocks.add(ElementTree.SubElement(piece, "Points"), "Points", frame.points, "m")
        grid = ElementTree.SubElement(piece, "Cells")
        for name, values in zip(("connectivity", "offsets", "types"), cells.flat, strict=True):
            blocks.add(grid, name, values)
        for part, data in (("PointData", frame.data), ("CellData", cells.data)):
            parent = ElementTree.SubElement(piece, part)
            for name, values in data.items():
                blocks.add(parent, name, values, frame.units.get(name, ""))
        blocks.write(path, root)

    def join(self, path: Path, frame: Frame, parts: Sequence[Part]) -> None:
        """Write the .pvtu that names the parts of a frame."""
        root, grid = _begin("PUnstructuredGrid")
        grid.set("GhostLevel", "0")
        cells = {} if frame.cells is None else frame.cells.data
        for room, data in (("PPointData", frame.data), ("PCellData", cells), ("PPoints", {"Points": frame.points})):
            parent = ElementTree.SubElement(grid, room)
            for name, values in data.items():
                unit = "m" if room == "PPoints" else frame.units.get(name, "")
                _said(ElementTree.SubElement(parent, "PDataArray"), name, values, unit)
        for part in parts:
            ElementTree.SubElement(grid, "Piece", Source=part.file)
        path.write_text(xml_text(root), encoding="utf-8", newline="\n")

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write frames.pvd."""
        root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(root, "Collection")
        for number, frame in enumerate(frames):
            suffix = self.joins if parts(frame, number, self.suffix) else self.suffix
            file = f"frames/{stem(number)}.{suffix}"
            ElementTree.SubElement(collection, "DataSet", timestep=repr(frame[0]), part="0", file=file)
        write_text(folder / self.listing, xml_text(root))


def _begin(kind: str) -> tuple[ElementTree.Element, ElementTree.Element]:
    """A file of a kind, and its element that all is in."""
    root = ElementTree.Element(
        "VTKFile",
        type=kind,
        version="1.0",
        byte_order="LittleEndian" if sys.byteorder == "little" else "BigEndian",
        header_type="UInt64",
    )
    return root, ElementTree.SubElement(root, kind)


def _said(array: ElementTree.Element, name: str, values: np.ndarray, unit: str) -> None:
    """What an array is, (n,) or (n, width)."""
    array.set("type", TYPES[values.dtype.name])
    array.set("Name", name)
    array.set("NumberOfComponents", str(1 if values.ndim == 1 else values.shape[1]))
    if unit:
        label = ElementTree.SubElement(array, "InformationKey", name="UNITS_LABEL", location="vtkDataArray")
        label.text = unit


def _field_data(parent: ElementTree.Element, frame: Frame) -> None:
    time = ElementTree.SubElement(
        parent, "DataArray", type="Float64", Name="TimeValue", NumberOfTuples="1", format="ascii"
    )
    time.text = repr(frame.time)
    _words(parent, "bodies", frame.bodies)
    _words(parent, "positions", [frame.positions])
    _words(parent, "units", [f"{name}: {unit}" for name, unit in frame.named_units.items()])


def _words(parent: ElementTree.Element, name: str, words: Sequence[str]) -> None:
    """Texts as the names of the components of an array of their numbers: VTK has arrays of texts, which stop meshio."""
    if not words:
        return
    given = {
        "type": "Int32",
        "Name": name,
        "NumberOfComponents": str(len(words)),
        "NumberOfTuples": "1",
        "format": "ascii",
    }
    array = ElementTree.SubElement(
        parent, "DataArray", given | {f"ComponentName{k}": each for k, each in enumerate(words)}
    )
    array.text = " ".join(str(k) for k in range(len(words)))


class _Blocks:
    """Arrays that stand behind the XML, each behind its length in bytes."""

    def __init__(self) -> None:
        self._arrays: list[np.ndarray] = []
        self._offset = 0

    def add(self, parent: ElementTree.Element, name: str, values: np.ndarray, unit: str = "") -> None:
        """Add an array (n,) or (n, width) as a child of `parent`."""
        array = ElementTree.SubElement(parent, "DataArray")
        _said(array, name, values, unit)
        array.set("format", "appended")
        array.set("offset", str(self._offset))
        self._arrays.append(np.ascontiguousarray(values))
        self._offset += np.uint64(0).nbytes + values.nbytes

    def write(self, path: Path, root: ElementTree.Element) -> None:
        """Write the XML with the arrays behind it."""
        head, end, _ = ElementTree.tostring(root, encoding="unicode").rpartition("</VTKFile>")
        with open(path, "wb") as file:
            file.write(f'<?xml version="1.0"?>\n{head}\n<AppendedData encoding="raw">\n_'.encode())
            for values in self._arrays:
                file.write(np.uint64(values.nbytes).tobytes())
                file.write(values.data)
            file.write(f"\n</AppendedData>\n{end}\n".encode())
