"""Frames as VTKHDF, and the whole run as one file in time.

A frame is a file of its own that opens by itself. `frames.vtkhdf` is small: its arrays are views of those of the frames, one
behind the other (virtual datasets of HDF5), so that it is written anew with every frame, whole or not at all, and a run that
is killed leaves it as it was. It opens where the folder `frames` lies beside it. A frame in parts is a file of the same
kind, of views of the files of its parts: partitions of one grid.
"""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import io
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wsph.output.cells import vertices
from wsph.output.files import write_atomically
from wsph.output.frames import Frame, Listed, Part, of_files, stem

ROOT = "VTKHDF"


class Vtkhdf:
    """VTK's unstructured grids in HDF5: a file of arrays a frame, and one that has them all in time."""

    name, needs, suffix, listing, joins = "vtkhdf", "h5py", "vtkhdf", "frames.vtkhdf", "vtkhdf"

    def write(self, path: Path, frame: Frame) -> None:
        """Write a frame as a file."""
        import h5py

        cells = vertices(len(frame.points)) if frame.cells is None else frame.cells
        corners, ends, types = cells.flat
        # In memory: HDF5 itself falls over where the disk is full.
        content = io.BytesIO()
        with h5py.File(content, "w") as file:
            group = _begin(file, [Part("", len(frame.points), cells.count, len(corners))])
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

    def join(self, path: Path, frame: Frame, parts: Sequence[Part]) -> None:
        """Write the file that has the parts of a frame."""
        import h5py

        content, files = io.BytesIO(), [part.file for part in parts]
        with h5py.File(content, "w") as file, h5py.File(path.parent / files[0]) as first:
            source: Any = first[ROOT]
            group = _begin(file, parts)
            places = {name: _places(files, counts) for name, counts in _sizes(parts).items()}
            for name in ("Connectivity", "Offsets", "Types"):
                _view(group, name, source[name], places[name])
            for room in ("PointData", "CellData"):
                own = group.create_group(room)
                for name in source[room]:
                    _view(own, name, source[room][name], places["Points" if room == "PointData" else "Types"])
            _view(group, "Points", source["Points"], places["Points"])
            source.copy("FieldData", group)
        path.write_bytes(content.getbuffer())

    def index(self, folder: Path, frames: list[Listed]) -> None:
        """Write frames.vtkhdf, of the frames that are there: a run that goes on may not have written this format before."""
        steps = [
            _Step(f"frames/{stem(k)}.{self.suffix}", each[0], of_files(each, k, "")) for k, each in enumerate(frames)
        ]
        there = [step for step in steps if (folder / step.file).is_file()]
        if there:
            write_atomically(folder / self.listing, lambda path: _put(path, folder, there))


class _Step(NamedTuple):
    """A frame in time: its file, its time [s] and its parts."""

    file: str
    time: float
    parts: list[Part]


def _put(path: Path, folder: Path, frames: list[_Step]) -> None:
    """Write the file that has all `frames`. What an array is, the last frame says that has it; cells stay while parts do."""
    import h5py

    files, times = [frame.file for frame in frames], np.array([frame.time for frame in frames])
    many, every, content = len(frames), [_sizes(frame.parts) for frame in frames], io.BytesIO()
    new = [k for k in range(many) if k == 0 or every[k] != every[k - 1]]
    kinds, of = [every[k] for k in new], np.searchsorted(new, np.arange(many), side="right") - 1
    with h5py.File(content, "w") as file, ExitStack() as opened:
        sources: list[Any] = [
            opened.enter_context(h5py.File(folder / files[k]))[ROOT] for k in {many - 1: 0, **dict.fromkeys(new)}
        ]
        source = sources[0]
        group = _begin(file, [part for k in new for part in frames[k].parts])
        for name in ("Connectivity", "Offsets", "Types"):
            _view(group, name, source[name], _places([files[k] for k in new], [sum(each[name]) for each in kinds]))
        steps = group.create_group("Steps")
        steps.attrs["NSteps"] = many
        numbers = np.array([len(frames[k].parts) for k in new])
        steps["Values"], steps["PartOffsets"], steps["NumberOfParts"] = times, _before(numbers)[of], numbers[of]
        steps["CellOffsets"] = _before([sum(each["Types"]) for each in kinds])[of][:, None]
        steps["ConnectivityIdOffsets"] = _before([sum(each["Connectivity"]) for each in kinds])[of][:, None]
        for room, like in (("PointData", "Points"), ("CellData", "Types")):
            own, offsets = group.create_group(room), steps.create_group(f"{room}Offsets")
            counts = [sum(each[like]) for each in every]
            if like == "Points":
                _view(group, "Points", source["Points"], _places(files, counts))
                steps["PointOffsets"] = _before(counts)
            arrays = {name: each[room][name] for each in reversed(sources) for name in each[room]}
            for name in dict.fromkeys((*source[room], *arrays)):
                _view(own, name, arrays[name], _places(files, counts))
                offsets[name] = _before(counts)
        source.copy("FieldData", group)
        del group["FieldData/TimeValue"]
        group["FieldData/TimeValue"] = times
        for name in group["FieldData"]:
            timed = name == "TimeValue"
            steps[f"FieldDataOffsets/{name}"] = np.arange(many) if timed else np.zeros(many, np.int64)
            wide = np.array([1, 1 if timed else len(group[f"FieldData/{name}"])], np.int64)
            steps[f"FieldDataSizes/{name}"] = np.tile(wide, (many, 1))
    path.write_bytes(content.getbuffer())


def _sizes(parts: Sequence[Part]) -> dict[str, list[int]]:
    """Rows that arrays have of every part."""
    return {
        "Points": [part.points for part in parts],
        "Types": [part.cells for part in parts],
        "Offsets": [part.cells + 1 for part in parts],
        "Connectivity": [part.corners for part in parts],
    }


def _before(counts: Sequence[int] | np.ndarray) -> np.ndarray:
    """How many there are before each."""
    return np.cumsum([0, *counts[:-1]])


def _places(files: Sequence[str], counts: Sequence[int]) -> list[tuple[str, int]]:
    return list(zip(files, counts, strict=True))


def _begin(file: Any, parts: Sequence[Part]) -> Any:
    """The group that VTK looks for, with the numbers of what is in its parts."""
    group = file.create_group(ROOT)
    group.attrs["Version"] = np.array([2, 0], np.int64)
    group.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    group["NumberOfPoints"] = np.array([part.points for part in parts])
    group["NumberOfCells"] = np.array([part.cells for part in parts])
    group["NumberOfConnectivityIds"] = np.array([part.corners for part in parts])
    return group


def _view(group: Any, name: str, like: Any, places: Sequence[tuple[str, int]]) -> None:
    """An array of `group` that is those of that place in files, one behind the other, each of so many rows of those that it
    is `like`; NaN where a file has none."""
    import h5py

    low: Any = h5py
    h5d, h5p, h5s = low.h5d, low.h5p, low.h5s
    shape, path, start = tuple(like.shape), like.name.encode(), 0
    whole = h5s.create_simple((sum(count for _, count in places), *shape[1:]))
    properties = h5p.create(h5p.DATASET_CREATE)
    if like.dtype.kind == "f":
        properties.set_fill_value(np.array(np.nan, like.dtype))
    for file, count in ((file, count) for file, count in places if count):
        own = (count, *shape[1:])
        whole.select_hyperslab((start, *(0 for _ in shape[1:])), own)
        properties.set_virtual(whole, file.encode(), path, h5s.create_simple(own))
        start += count
    h5d.create(group.id, name.encode(), like.id.get_type(), whole, properties)
    group[name].attrs["unit"] = like.attrs.get("unit", "")
