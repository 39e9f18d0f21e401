"""Frames as HDF5 with an XDMF index."""

# pyright: strict
# pyright: reportMissingTypeStubs=false

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wsph.output.cells import KINDS, Cells, counted
from wsph.output.files import write_text, xml_text
from wsph.output.frames import Entry, Frame, Listed, Part, arrays, of_files, parts

COUNTED = ("vertex", "line")
"""Kinds that in XDMF can have any number of corners, and say it."""

CORNERS = "mesh/corners"
"""Where the cells of a frame are."""


class Xdmf:
    """A file of arrays a frame, and one list that says what they are."""

    name, needs, suffix, listing, joins = "xdmf", "h5py", "h5", "frames.xdmf", ""

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        import h5py

        data = {"position": frame.points, **frame.data}
        if frame.cells is not None:
            data |= {f"cells/{name}": values for name, values in frame.cells.data.items()}
        # In memory: HDF5 itself falls over where the disk is full.
        content = io.BytesIO()
        with h5py.File(content, "w") as file:
            file.attrs["TimeValue"], file.attrs["bodies"] = frame.time, list(frame.bodies)
            file.attrs["positions"] = frame.positions
            for name, v in data.items():
                # ParaView reads XDMF's Tensor6 as xx xy xz yy yz zz; all nine leave nothing to guess.
                file[name] = v[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]] if v.ndim == 2 and v.shape[1] == 6 else v
                unit = frame.units.get(name.removeprefix("cells/"), "")
                file[name].attrs["unit"] = "m" if name == "position" else unit
            if frame.cells is not None:
                file[CORNERS] = _corners(frame.cells)
        path.write_bytes(content.getbuffer())

    def join(self, path: Path, frame: Frame, parts: Sequence[Part]) -> None:
        """The list of frames has their parts."""

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write frames.xdmf."""
        root = ElementTree.Element("Xdmf", Version="3.0")
        series = ElementTree.SubElement(
            ElementTree.SubElement(root, "Domain"),
            "Grid",
            Name="frames",
            GridType="Collection",
            CollectionType="Temporal",
        )
        # Frames of one list are of one kind: where some are in parts a whole one is its only part.
        parted = any(parts(frame, 0, "") for frame in frames)
        for number, (time, n, words) in enumerate(frames):
            name, own = f"frame {number}", of_files((time, n, words), number, self.suffix)
            grids = [_named(series, name, "Uniform")]
            if parted:
                grids[0].set("GridType", "Collection")
                grids[0].set("CollectionType", "Spatial")
            ElementTree.SubElement(grids[0], "Time", Value=repr(time))
            if parted:
                grids = [_named(grids[0], f"{name}, part {k}", "Uniform") for k in range(len(own))]
            for k, (grid, part) in enumerate(zip(grids, own, strict=True)):
                _fill(grid, words, part, k if len(own) > 1 else None)
        write_text(folder / self.listing, xml_text(root))


def _named(parent: ElementTree.Element, name: str, kind: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, "Grid", Name=name, GridType=kind)


def _fill(grid: ElementTree.Element, words: list[str], part: Part, number: int | None) -> None:
    """What a listed frame has, or the part of that number of one."""
    source = f"frames/{part.file}"
    _topology(grid, words, part, number)
    for entry in arrays(words):
        if entry.name == "position":
            _array(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), entry, part.points, source)
        else:
            _array(_attribute(grid, entry, "Node"), entry, part.points, source)
    for entry in arrays(words, cells=True):
        _array(_attribute(grid, entry, "Cell"), entry, part.cells, f"{source}:/cells")


def _corners(cells: Cells) -> np.ndarray:
    """The corners (c, k) of cells of one kind, as XDMF has them; of more kinds the number of its kind in front of each."""
    if len(cells.blocks) == 1:
        return next(iter(cells.blocks.values()))
    flat: list[np.ndarray] = []
    for name, corners in cells.blocks.items():
        kind = [KINDS[name].number, *([corners.shape[1]] if name in COUNTED else [])]
        flat.append(np.concatenate([np.tile(np.array(kind, corners.dtype), (len(corners), 1)), corners], 1).ravel())
    return np.concatenate(flat)


def _topology(grid: ElementTree.Element, words: list[str], part: Part, number: int | None) -> None:
    """Say what cells a listed frame has, or the part of that number of one."""
    kinds = counted(words, number)
    if not kinds:
        ElementTree.SubElement(grid, "Topology", TopologyType="Polyvertex", NumberOfElements=str(part.points))
        return
    count, one = part.cells, next(iter(kinds))
    parent = ElementTree.SubElement(
        grid, "Topology", TopologyType=KINDS[one].xdmf if len(kinds) == 1 else "Mixed", NumberOfElements=str(count)
    )
    if len(kinds) == 1:
        if one in COUNTED:
            parent.set("NodesPerElement", str(len(KINDS[one].order)))
        shape = f"{count} {len(KINDS[one].order)}"
    else:
        shape = str(sum(n * (len(KINDS[kind].order) + 1 + (kind in COUNTED)) for kind, n in kinds.items()))
    of = next(word.split(":", 3)[2] for word in words if word.startswith("corners/"))
    _data_item(parent, shape, np.dtype(of), f"frames/{part.file}:/{CORNERS}")


def _attribute(grid: ElementTree.Element, entry: Entry, center: str) -> ElementTree.Element:
    kind = {1: "Scalar", 3: "Vector", 6: "Tensor"}.get(entry.width, "Matrix")
    return ElementTree.SubElement(grid, "Attribute", Name=entry.name, AttributeType=kind, Center=center)


def _array(parent: ElementTree.Element, entry: Entry, count: int, room: str) -> None:
    """The unit of an array, and where it is: in a `room`, a file with or without a group in it."""
    if entry.unit:
        ElementTree.SubElement(parent, "Information", Name="unit", Value=entry.unit)
    shape = {1: f"{count}", 6: f"{count} 9"}.get(entry.width, f"{count} {entry.width}")
    _data_item(parent, shape, np.dtype(entry.type), f"{room}{'/' if ':' in room else ':/'}{entry.name}")


def _data_item(parent: ElementTree.Element, dimensions: str, of: np.dtype[Any], source: str) -> None:
    kind, size = {"i": "Int", "u": "UChar"}.get(of.kind, "Float"), str(of.itemsize)
    item = ElementTree.SubElement(
        parent, "DataItem", Format="HDF", Dimensions=dimensions, NumberType=kind, Precision=size
    )
    item.text = source
