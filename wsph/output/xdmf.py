"""Frames as HDF5 with an XDMF index."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np


def xml_text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def data_item(parent: ElementTree.Element, dimensions: str, source: str) -> None:
    integer = source.endswith(("/id", "/body"))
    item = ElementTree.SubElement(parent, "DataItem", Format="HDF", Dimensions=dimensions,
                                  NumberType="Int" if integer else "Float", Precision="8")  # fmt: skip
    item.text = source


def write_h5(path: Path, points: np.ndarray, data: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["position"] = points
        for name, values in data.items():
            # ParaView reads XDMF's Tensor6 as xx xy xz yy yz zz; all nine leave nothing to guess.
            file[name] = values[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]] if values.ndim == 2 and values.shape[1] == 6 else values
