"""Frames as HDF5 with an XDMF index."""

# pyright: strict
# pyright: reportMissingTypeStubs=false

import io
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wsph.output.files import write_text, xml_text
from wsph.output.frames import Frame, Listed, stem


class Xdmf:
    """A file of arrays a frame, and one list that says what they are."""

    name, needs, suffix, listing = "xdmf", "h5py", "h5", "frames.xdmf"

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        import h5py

        # In memory: HDF5 itself falls over where the disk is full.
        content = io.BytesIO()
        with h5py.File(content, "w") as file:
            file.attrs["TimeValue"], file.attrs["bodies"] = frame.time, list(frame.bodies)
            for name, v in {"position": frame.points, **frame.data}.items():
                # ParaView reads XDMF's Tensor6 as xx xy xz yy yz zz; all nine leave nothing to guess.
                file[name] = v[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]] if v.ndim == 2 and v.shape[1] == 6 else v
                file[name].attrs["unit"] = "m" if name == "position" else frame.units.get(name, "")
        path.write_bytes(content.getbuffer())

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
        for number, (time, n, names) in enumerate(frames):
            source = f"frames/{stem(number)}.{self.suffix}"
            grid = ElementTree.SubElement(series, "Grid", Name=f"frame {number}", GridType="Uniform")
            ElementTree.SubElement(grid, "Time", Value=repr(time))
            ElementTree.SubElement(grid, "Topology", TopologyType="Polyvertex", NumberOfElements=str(n))
            for entry in names:
                name, width, of, unit = entry.split(":", 3)
                if name == "position":
                    parent = ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ")
                else:
                    kind = {"1": "Scalar", "3": "Vector", "6": "Tensor"}.get(width, "Matrix")
                    parent = ElementTree.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center="Node")
                if unit:
                    ElementTree.SubElement(parent, "Information", Name="unit", Value=unit)
                shape = {"1": f"{n}", "6": f"{n} 9"}.get(width, f"{n} {width}")
                _data_item(parent, shape, np.dtype(of), f"{source}:/{name}")
        write_text(folder / self.listing, xml_text(root))


def _data_item(parent: ElementTree.Element, dimensions: str, of: np.dtype[Any], source: str) -> None:
    kind, size = "Int" if of.kind == "i" else "Float", str(of.itemsize)
    item = ElementTree.SubElement(
        parent, "DataItem", Format="HDF", Dimensions=dimensions, NumberType=kind, Precision=size
    )
    item.text = source
