"""Frames as VTKHDF, and the whole run as one file in time.

A frame is a file of its own that opens by itself. `frames.vtkhdf` is small: its arrays are views of those of the frames, one
behind the other (virtual datasets of HDF5), so that it is written anew with every frame, whole or not at all, and a run that
is killed leaves it as it was. It opens where the folder `frames` lies beside it.
"""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import io
from pathlib import Path
from typing import Any

import numpy as np

from wsph.output.cells import vertices
from wsph.output.files import write_atomically
from wsph.output.frames import Frame, Listed, stem

ROOT = "VTKHDF"


class Vtkhdf:
    """VTK's unstructured grids in HDF5: a file of arrays a frame, and one that has them all in time."""

    name, needs, suffix, listing = "vtkhdf", "h5py", "vtkhdf", "frames.vtkhdf"

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        import h5py

        cells = vertices(len(frame.points)) if frame.cells is None else frame.cells
        corners, ends, types = cells.flat
        # In memory: HDF5 itself falls over where the disk is full.
        content = io.BytesIO()
        with h5py.File(content, "w") as file:
            group = _begin(file, len(frame.points), cells.count, len(corners))
            group["Points"], group["Connectivity"], group["Types"] = frame.points, corners, types
            group["Points"].attrs["unit"] = "m"
            group["Offsets"] = np.concatenate([np.zeros(1, ends.dtype), ends])
            for part, data in (("PointData", frame.data), ("CellData", cells.data)):
                own = group.create_group(part)
                for name, values in data.items():
                    own[name] = values
                    own[name].attrs["unit"] = frame.units.get(name, "")
            units = [f"{name}: {unit}" for name, unit in frame.named_units.items()]
            about = group.create_group("FieldData")
            about["TimeValue"] = np.array([frame.time])
            for name, words in (("bodies", frame.bodies), ("positions", [frame.positions]), ("units", units)):
                # VTK reads texts of this kind alone, and takes their bytes for UTF-8.
                of = h5py.string_dtype("ascii")
                about.create_dataset(name, data=[word.encode() for word in words], dtype=of)
        path.write_bytes(content.getbuffer())

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write frames.vtkhdf, of the frames that are there: a run that goes on may not have written this format before."""
        files = [f"frames/{stem(number)}.{self.suffix}" for number in range(len(frames))]
        there = [(file, frame[0]) for file, frame in zip(files, frames, strict=True) if (folder / file).is_file()]
        if there:
            write_atomically(folder / self.listing, lambda path: _put(path, folder, there))


def _put(path: Path, folder: Path, frames: list[tuple[str, float]]) -> None:
    """Write the file that has all `frames`, names and times [s]. What an array is, the last frame says; cells stay."""
    import h5py

    files, times = [file for file, _ in frames], np.array([time for _, time in frames])
    many, content = len(frames), io.BytesIO()
    zeros, sizes = np.zeros(many, np.int64), np.ones((many, 2), np.int64)
    with h5py.File(content, "w") as file, h5py.File(folder / files[-1]) as last:
        source: Any = last[ROOT]
        points, cells = int(source["NumberOfPoints"][0]), int(source["NumberOfCells"][0])
        group = _begin(file, points, cells, int(source["NumberOfConnectivityIds"][0]))
        for name in ("Connectivity", "Offsets", "Types"):
            _view(group, name, source[name], files[:1])
        _view(group, "Points", source["Points"], files)
        steps = group.create_group("Steps")
        steps.attrs["NSteps"] = many
        steps["Values"], steps["PartOffsets"], steps["NumberOfParts"] = times, zeros, zeros + 1
        steps["PointOffsets"] = np.arange(many) * points
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = zeros[:, None]
        for part, count in (("PointData", points), ("CellData", cells)):
            own, offsets = group.create_group(part), steps.create_group(f"{part}Offsets")
            for name in source[part]:
                _view(own, name, source[part][name], files)
                offsets[name] = np.arange(many) * count
        source.copy("FieldData", group)
        del group["FieldData/TimeValue"]
        group["FieldData/TimeValue"] = times
        for name in group["FieldData"]:
            timed = name == "TimeValue"
            steps[f"FieldDataOffsets/{name}"] = np.arange(many) if timed else zeros
            steps[f"FieldDataSizes/{name}"] = sizes * (1, 1 if timed else len(group[f"FieldData/{name}"]))
    path.write_bytes(content.getbuffer())


def _begin(file: Any, points: int, cells: int, corners: int) -> Any:
    """The group that VTK looks for, with the numbers of what is in it."""
    group = file.create_group(ROOT)
    group.attrs["Version"] = np.array([2, 0], np.int64)
    group.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    for name, count in (("NumberOfPoints", points), ("NumberOfCells", cells), ("NumberOfConnectivityIds", corners)):
        group[name] = np.array([count])
    return group


def _view(group: Any, name: str, like: Any, files: list[str]) -> None:
    """An array of `group` that is those of that place in `files`, one behind the other, each as one that it is `like`; NaN
    where a frame has none."""
    import h5py

    low: Any = h5py
    h5d, h5p, h5s = low.h5d, low.h5p, low.h5s
    shape, path = tuple(like.shape), like.name.encode()
    whole, own = h5s.create_simple((shape[0] * len(files), *shape[1:])), h5s.create_simple(shape)
    properties = h5p.create(h5p.DATASET_CREATE)
    if like.dtype.kind == "f":
        properties.set_fill_value(np.array(np.nan, like.dtype))
    for number, file in enumerate(files):
        whole.select_hyperslab((number * shape[0], *(0 for _ in shape[1:])), shape)
        properties.set_virtual(whole, file.encode(), path, own)
    h5d.create(group.id, name.encode(), like.id.get_type(), whole, properties)
    group[name].attrs["unit"] = like.attrs.get("unit", "")
