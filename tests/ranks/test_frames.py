"""Frames in parts: VTK's readers, which ParaView has, read them as one grid, with the numbers of one process."""

import json
import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.ranks.launch import launched, needs_mpi
from tests.ranks.shared_cases import scene
from tests.ranks.test_endings import ENDLESS, FULL, SOON, errors, ranks_of, started, wait_for, written
from wsph.errors import SceneError
from wsph.output.view.look import Look
from wsph.output.view.pictures import picture
from wsph.output.view.recorded import frames, read
from wsph.scene.outputs import GATHERED, Output

pytest.importorskip("h5py")
pv = pytest.importorskip("pyvista")

from tests.output.readers import times, vtk  # noqa: E402

NAMES = ("plastic", "bodies", "breaking, resumed")
ONE = "plastic"
"""The one that is short: the others are slow."""


def leaves(data: Any) -> Iterator[Any]:
    """The grids of what a reader gives."""
    if not hasattr(data, "n_blocks") and not hasattr(data, "n_partitions"):
        yield data
        return
    for each in data:
        yield from leaves(each)


def by_pvd(folder: Path, number: int) -> Any:
    reader = pv.get_reader(folder / "frames.pvd")
    reader.set_active_time_value(reader.time_values[number])
    return reader.read()[0]


def by_vtkhdf(folder: Path, number: int) -> Any:
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / "frames.vtkhdf"))
    reader.UpdateInformation()
    reader.SetStep(number)
    reader.Update()
    return pv.wrap(reader.GetOutputDataObject(0))


def by_vtkhdf_alone(folder: Path, number: int) -> Any:
    return pv.read(folder / "frames" / f"frame_{number:06d}.vtkhdf")


def by_xdmf(folder: Path, number: int) -> Any:
    reader = vtk.vtkXdmfReader()
    reader.SetFileName(str(folder / "frames.xdmf"))
    reader.UpdateInformation()
    reader.UpdateTimeStep(times(reader)[number])
    return pv.wrap(reader.GetOutputDataObject(0))


READERS = {"pvd": by_pvd, "vtkhdf": by_vtkhdf, "vtkhdf alone": by_vtkhdf_alone, "xdmf": by_xdmf}


class Grid:
    """All that a reader gives: arrays of points, of which `copies` are, and of cells, whose corners are particles."""

    def __init__(self, data: Any):
        grids = list(leaves(data))
        self.points: dict[str, np.ndarray] = {"at": np.concatenate([np.asarray(each.points) for each in grids])}
        for name in list(grids[0].point_data):
            self.points[name] = np.concatenate([np.asarray(each.point_data[name]) for each in grids])
        self.copies = self.points.pop("vtkGhostType", np.zeros(len(self.points["at"]), np.uint8)) == 1
        self.cells: dict[tuple[int, ...], tuple[Any, ...]] = {}
        names = sorted(grids[0].cell_data)
        for each in grids:
            ids, ends = np.asarray(each.point_data["id"])[each.cell_connectivity], np.asarray(each.cell_offsets)
            data = [np.asarray(each.cell_data[name]) for name in names]
            for k, kind in enumerate(each.celltypes):
                corners = (int(kind), *ids[ends[k] : ends[k + 1]].tolist())
                assert corners not in self.cells
                self.cells[corners] = tuple(values[k].tobytes() for values in data)

    def own(self, name: str) -> np.ndarray:
        """An array of the points that are no copies, by the numbers of the particles."""
        return self.points[name][~self.copies][np.argsort(self.points["id"][~self.copies], kind="stable")]


def assert_same(parted: Grid, alone: Grid) -> None:
    """Every particle once, with its numbers; copies have those of what they are copies of; every cell once."""
    assert parted.points.keys() == alone.points.keys()
    numbers = parted.own("id")
    np.testing.assert_array_equal(numbers, np.arange(len(alone.points["id"])))
    for name in alone.points:
        whole = alone.own(name)
        assert parted.points[name].dtype == whole.dtype
        np.testing.assert_array_equal(parted.own(name), whole, err_msg=name)
        copied = parted.points[name][parted.copies]
        np.testing.assert_array_equal(copied, whole[parted.points["id"][parted.copies]], err_msg=name)
    assert parted.cells == alone.cells


def assert_no_other_files(folder: Path) -> None:
    """There are the files of the frames that are listed, and no others, as of a run that was resumed by fewer."""
    files = {path.name for path in (folder / "frames").iterdir()}
    joined = [path.name for _, path in frames(folder)]
    for name in joined:
        text = (folder / "frames" / name).read_text() if name.endswith("pvtu") else ""
        own = re.findall(r'Source="(.+?)\.vtu"', text)
        stems = {f"{each}.{suffix}" for each in own for suffix in ("vtu", "vtkhdf", "h5")}
        whole = {name, f"{name[:12]}.vtkhdf"} | (set() if own else {f"{name[:12]}.h5"})
        found = {each for each in files if each.startswith(name[:12])}
        assert found == stems | whole


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("frames")


def run(folder: Path, name: str) -> Path:
    """The runs of a case, made once."""
    if not (folder / name).is_dir():
        done = launched(4, "-m", "tests.ranks.frame_cases", str(folder), name)
        assert done.returncode == 0, done.stderr[-3000:]
    return folder / name


@needs_mpi
@pytest.mark.parametrize("name", [ONE, *(pytest.param(each, marks=pytest.mark.slow) for each in NAMES if each != ONE)])
@pytest.mark.parametrize("reader", READERS)
def test_parts_are_read_as_the_frame_of_one_process(folder: Path, name: str, reader: str) -> None:
    runs, opened = run(folder, name), READERS[reader]
    counts = ("3", "1") if name.endswith("resumed") else ("2", "4")
    whole = run(folder, name.partition(", ")[0]) / "1" if name.endswith("resumed") else runs / "1"
    last = len(frames(whole)) - 1
    for count in counts:
        for number in (0, last - 1, last):
            assert_same(Grid(opened(runs / count, number)), Grid(opened(whole, number)))
        assert_no_other_files(runs / count)
    if name == "kernel":  # particles alone come in the order of one process
        parted = Grid(opened(runs / "4", last))
        assert not parted.copies.any()
        np.testing.assert_array_equal(parted.points["id"], np.arange(len(parted.copies)))


@needs_mpi
def test_parts_are_drawn_as_the_frame_of_one_process(folder: Path) -> None:
    runs = run(folder, ONE)
    shots = [read(*frames(runs / count)[-1]) for count in ("1", "4")]
    whole, parted = (picture(each, Look("velocity")) for each in shots)
    assert [each.bodies for each in shots] == [("b",)] * 2
    assert shots[0].units == shots[1].units
    for figure in (whole, parted):
        figure.canvas.draw()
    np.testing.assert_array_equal(np.asarray(whole.canvas.buffer_rgba()), np.asarray(parted.canvas.buffer_rgba()))  # type: ignore[attr-defined]


IN_PARTS = {"output": {"every": 4, "formats": ["vtu", "xdmf"], "parts": True}}


@needs_mpi
def test_a_process_without_disk_for_its_part_ends_all_and_leaves_no_frame(tmp_path: Path) -> None:
    """Another number of processes writes over what is left."""
    out, path = tmp_path / "out", written(tmp_path, **IN_PARTS)
    done = launched(3, "-c", FULL, "run", str(path), "-o", str(out))
    assert done.returncode == 2
    assert len(errors(done.stderr)) == 1
    assert re.search(r"frame_000000_00001-of-00003.vtu: cannot be written: File too large", done.stderr)
    left = {each.name for each in (out / "frames").iterdir()}
    assert left <= {f"frame_000000_0000{k}-of-00003.{suffix}" for k in (0, 2) for suffix in ("vtu", "h5")}
    assert not (out / "frames.pvd").exists()
    done = launched(2, "-m", "wsph", "run", str(path), "-o", str(out), "--overwrite")
    assert done.returncode == 0, done.stderr
    assert json.loads((out / "summary.json").read_text())["status"] == "completed"
    assert not list((out / "frames").glob("*of-00003*"))
    assert read(*frames(out)[-1]).grid.n_points == 5001


@needs_mpi
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds processes in /proc")
def test_a_kill_leaves_frames_that_are_whole_and_other_processes_go_on(tmp_path: Path) -> None:
    out, path = tmp_path / "out", written(tmp_path, **ENDLESS, **IN_PARTS)
    process = started(path, out)
    try:
        wait_for("checkpoints/checkpoint_????????????.npz", out)
        os.kill(ranks_of(process)[1], signal.SIGKILL)
        process.communicate(timeout=SOON)
    finally:
        process.kill()
    left = frames(out)
    assert {read(*each).grid.n_points for each in left} == {5001}
    last = max(int(each.stem.partition("_")[2]) for each in (out / "checkpoints").glob("checkpoint_????????????.npz"))
    end = f"run.end={0.2 * (last + 9)}"
    done = launched(2, "-m", "wsph", "run", str(path), "-o", str(out), "--resume", "--set", end)
    assert done.returncode == 0, done.stderr
    found = frames(out)
    assert {read(*each).grid.n_points for each in found} == {5001}
    for number, (_, each) in enumerate(found):
        size = 3 if number <= last // 4 else 2
        assert each.read_text().count(f"-of-0000{size}.vtu") == size
        assert not list((out / "frames").glob(f"frame_{number:06d}*-of-0000{5 - size}*"))


@needs_mpi
def test_the_first_process_has_no_more_of_a_frame_in_parts_than_the_others() -> None:
    done = launched(4, "tests/benchmarks/parts.py", "--cells", "16", "--formats", "vtu", "vtkhdf")
    assert done.returncode == 0, done.stderr[-3000:]
    gathered, parted = (
        [float(each) for each in line.partition("; memory ")[2].partition(" bytes")[0].split(", ")]
        for line in done.stdout.splitlines()
    )
    assert gathered[0] > 2.0 * max(gathered[1:])
    assert parted[0] < 1.1 * max(parted[1:])
    assert parted[0] < 0.5 * gathered[0]


def test_a_format_without_parts_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="output: parts: a frame as npz is one file: leave out either"):
        scene(output={"every": 4, "formats": ["vtu", "npz"], "parts": True})


def test_large_frames_are_in_parts_where_nothing_is_said() -> None:
    asked = Output()
    assert asked.in_parts(GATHERED + 1, 2)
    assert not asked.in_parts(GATHERED, 2)
    assert not asked.in_parts(GATHERED + 1, 1)
    assert not Output(formats=("vtu", "npz")).in_parts(GATHERED + 1, 2)
    assert not Output(parts=False).in_parts(GATHERED + 1, 2)
    assert Output(parts=True).in_parts(100, 2)
