"""Frames: ParaView's readers read them right, also those of a run that was killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.output.readers import READERS, times, vtk
from wsph.errors import OutputError
from wsph.output.fields import von_mises
from wsph.output.folder import OutputFolder
from wsph.output.view.look import Look
from wsph.output.view.pictures import picture
from wsph.output.view.recorded import frames, shot, words

pv = pytest.importorskip("pyvista")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, shock_bar: wsph.Scene) -> Path:
    """A run with frames in every format."""
    out = tmp_path_factory.mktemp("run") / "out"
    wsph.run(
        shock_bar.with_(
            output={"every": "2 ms", "formats": ["vtu", "xdmf", "npz"], "fields": ["velocity", "stress", "von_mises"]}
        ),
        out,
    )
    return out


def test_frames_open_in_pyvista_padded_to_three_dimensions(folder: Path) -> None:
    reader = pv.get_reader(folder / "frames.pvd")
    assert reader.time_values == pytest.approx([0.0, 0.002, 0.004, 0.006, 0.008, 0.01])
    reader.set_active_time_value(0.006)
    mesh = reader.read()[0]
    assert mesh.n_points == mesh.n_cells == 101
    assert np.asarray(mesh.points)[-1].tolist() == [1.0, 0.0, 0.0]
    assert mesh.point_data["velocity"].shape == (101, 3)
    assert mesh.point_data["stress"].shape == (101, 6)
    assert mesh.point_data["stress"][-1].tolist() == pytest.approx([-8e5, 0, 0, 0, 0, 0])
    assert mesh.point_data["id"].tolist() == list(range(101))


def test_tensor_order_is_vtk_s(tmp_path: Path) -> None:
    """VTK's own von Mises filter agrees with ours on random full tensors."""
    vtk = pytest.importorskip("vtk")
    random = np.random.default_rng(1)
    stress = random.standard_normal((50, 6)) * 1e6
    writer = OutputFolder(tmp_path, ("vtu",))
    writer.frame(0.0, random.random((50, 3)), {"stress": stress})
    mesh = pv.read(tmp_path / "frames" / "frame_000000.vtu")
    xx, yy, zz, xy, yz, xz = (mesh.point_data["stress"][:, k] for k in range(6))
    assert np.array_equal(np.stack([xx, yy, zz, xy, yz, xz], 1), stress)
    criteria = vtk.vtkYieldCriteria()
    criteria.SetInputData(mesh)
    criteria.SetInputArrayToProcess(0, 0, 0, vtk.vtkDataObject.FIELD_ASSOCIATION_POINTS, "stress")
    criteria.Update()
    result = pv.wrap(criteria.GetOutput())
    name = next(n for n in result.point_data if "mises" in n.lower())
    np.testing.assert_allclose(np.asarray(result.point_data[name]), von_mises(stress), rtol=1e-6)


def test_xdmf_and_npz_carry_the_same_numbers(folder: Path) -> None:
    h5py = pytest.importorskip("h5py")
    root = ElementTree.parse(folder / "frames.xdmf").getroot()
    grids = root.findall("./Domain/Grid/Grid")
    assert [float(g.find("Time").get("Value")) for g in grids] == pytest.approx([0.0, 0.002, 0.004, 0.006, 0.008, 0.01])
    stress = next(a for a in grids[3].findall("Attribute") if a.get("Name") == "stress")
    file, path = stress.find("DataItem").text.split(":")
    with h5py.File(folder / file) as data:
        nine = data[path][:]
    frame = np.load(folder / "frames" / "frame_000003.npz")
    assert nine.shape == (101, 9)
    assert np.array_equal(nine[:, [0, 4, 8, 1, 5, 2]], frame["stress"])
    mesh = pv.read(folder / "frames" / "frame_000003.vtu")
    assert np.array_equal(mesh.point_data["stress"], frame["stress"])
    vtk = pytest.importorskip("vtk")
    reader = vtk.vtkXdmf3Reader() if hasattr(vtk, "vtkXdmf3Reader") else None
    if reader is not None:
        reader.SetFileName(str(folder / "frames.xdmf"))
        reader.Update()
        assert reader.GetOutputDataObject(0) is not None


KILLED = """
import sys, wsph
scene = wsph.load(sys.argv[1]).with_(end="10 s", output={"every": 3, "formats": ["vtu", "vtkhdf", "xdmf", "npz"]})
wsph.run(scene, sys.argv[2])
"""


def test_a_kill_at_any_instant_leaves_a_readable_folder(tmp_path: Path) -> None:
    scene = Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml"
    random = np.random.default_rng(0)
    for attempt in range(2):
        out = tmp_path / f"out{attempt}"
        process = subprocess.Popen([sys.executable, "-c", KILLED, str(scene), str(out)], stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while not (out / "frames" / "frame_000005.vtu").exists():
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(random.uniform(0.0, 0.3))
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        reader = pv.get_reader(out / "frames.pvd")
        assert len(reader.time_values) >= 5
        for value in reader.time_values:
            reader.set_active_time_value(value)
            assert reader.read()[0].n_points == 101
        listed = [len(reader.time_values)]
        for kind, name in ((vtk.vtkHDFReader, "frames.vtkhdf"), (vtk.vtkXdmfReader, "frames.xdmf")):
            series = kind()
            series.SetFileName(str(out / name))
            series.UpdateInformation()
            listed.append(len(times(series)))
        # The kill fell between two lists at most.
        assert max(listed) - min(listed) <= 1
        for read in READERS.values():
            for number in (0, min(listed) - 1):
                assert read(out, number).n_points == 101
                assert np.isfinite(read(out, number).point_data["velocity"]).all()
        for path in (out / "frames").glob("frame_*.npz"):
            assert len(np.load(path)["position"]) == 101


def test_two_dimensional_fields_are_padded(tmp_path: Path) -> None:
    writer = OutputFolder(tmp_path, ("vtu",))
    writer.frame(0.0, np.ones((4, 2)), {"velocity": np.ones((4, 2)), "density": np.ones(4)})
    mesh = pv.read(tmp_path / "frames" / "frame_000000.vtu")
    assert mesh.point_data["velocity"].tolist() == [[1.0, 1.0, 0.0]] * 4
    assert np.asarray(mesh.points).tolist() == [[1.0, 1.0, 0.0]] * 4


def two_bodies(precision: str) -> wsph.Scene:
    """A body that flows beside one that has no plastic strain."""
    law = scenes.material("perzyna", yield_stress=1e-3, hardening_modulus=0.1, fluidity=0.02, exponent=1.0)
    bodies = [
        scenes.body(scenes.box(1.0, 0.5), 0.25, name="soft, 50 %", material=law, velocity=["-0.1*x", "0"]),
        scenes.body(scenes.box((2.0, 3.0), 0.5), 0.25, name='<härte> & "more"'),
    ]
    wanted = ["velocity", "stress", "plastic_strain", "density", "displacement", "von_mises"]
    output = {"formats": ["vtu", "xdmf", "npz"], "fields": wanted}
    return scenes.scene(*bodies, run={"precision": precision, "end": 0.5}, output=output)


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_files_have_time_units_bodies_and_the_precision_of_the_run(tmp_path: Path, precision: str) -> None:
    h5py, vtk = pytest.importorskip("h5py"), pytest.importorskip("vtk")
    result = wsph.run(two_bodies(precision), tmp_path / "out")
    of, names = {"f64": "float64", "f32": "float32"}[precision], [b.name for b in result.scene.bodies]
    units = {"position": "m", "velocity": "m/s", "stress": "Pa", "plastic_strain": "1", "density": "kg/m3", "displacement": "m",
             "von_mises": "Pa"}  # fmt: skip
    folder = tmp_path / "out" / "frames"
    mesh = pv.read(folder / "frame_000001.vtu")
    assert mesh.field_data["TimeValue"].tolist() == [result.time]
    assert words(mesh, "bodies") == names
    assert words(mesh, "units") == [f"{name}: {unit}" for name, unit in units.items()]
    assert mesh.points.dtype == of
    for name in units.keys() - {"position"}:
        assert mesh.point_data[name].dtype == of
        label = mesh.GetPointData().GetArray(name).GetInformation().Get(vtk.vtkDataArray.UNITS_LABEL())
        assert label == units[name]
        assert result.particles[name].dtype == of
    assert mesh.point_data["id"].dtype == mesh.point_data["body"].dtype == "int64"
    assert np.array_equal(np.isnan(mesh.point_data["plastic_strain"]), mesh.point_data["body"] == 1)
    with np.load(folder / "frame_000001.npz") as archive, h5py.File(folder / "frame_000001.h5") as data:
        assert archive["bodies"].tolist() == list(data.attrs["bodies"]) == names
        assert dict(archive["units"].tolist()) == units
        assert archive["TimeValue"] == data.attrs["TimeValue"] == result.time
        for name in units:
            assert data[name].attrs["unit"] == units[name]
            assert archive[name].dtype == data[name].dtype == of
    root = ElementTree.parse(tmp_path / "out" / "frames.xdmf").getroot()
    items = root.findall(".//Attribute/DataItem") + root.findall(".//Geometry/DataItem")
    inside = ("cells/stress", "cells/plastic_strain", "cells/von_mises")
    sizes = {item.text.split(":/")[1]: (item.get("NumberType"), item.get("Precision")) for item in items}
    assert sizes == {
        **dict.fromkeys(units, ("Float", {"f64": "8", "f32": "4"}[precision])),
        "id": ("Int", "8"),
        "body": ("Int", "8"),
        **dict.fromkeys(inside, ("Float", {"f64": "8", "f32": "4"}[precision])),
        "cells/body": ("Int", "8"),
    }
    said = {a.get("Name"): a.find("Information") for a in root.findall("./Domain/Grid/Grid")[-1].findall("Attribute")}
    assert {name: found.get("Value") for name, found in said.items() if found is not None} == {
        n: u for n, u in units.items() if n != "position"
    }


def test_points_of_single_precision_stay_apart(tmp_path: Path) -> None:
    """Far from the origin single precision has no digits for a spacing: there points keep theirs."""
    far = scenes.body(scenes.box((1e4, 1e4 + 0.01)), 0.001)
    wsph.run(scenes.scene(far, run={"precision": "f32", "end": 1e-3}), tmp_path / "out")
    mesh = pv.read(tmp_path / "out" / "frames" / "frame_000001.vtu")
    assert np.diff(mesh.points[:, 0]) == pytest.approx(0.001, rel=1e-6)
    assert mesh.point_data["velocity"].dtype == "float32"


def test_times_are_numbers_where_the_step_adapts(tmp_path: Path) -> None:
    squeezed = scenes.block(2, 4, model="neo-hookean", run={"cfl": "auto", "end": 1.0}, velocity=["-0.5*x", "-0.5*y"],
                            tables={"output": {"every": 0.1, "formats": ["vtu", "xdmf"]}})  # fmt: skip
    result = wsph.run(squeezed, tmp_path / "out")
    assert result.history["dt"][-1] < result.history["dt"][0]
    assert type(result.time) is float
    for name in ("frames.pvd", "frames.xdmf"):
        assert "np.float64" not in (tmp_path / "out" / name).read_text()
    times = [time for time, _ in frames(tmp_path / "out")]
    assert times[-1] == result.time
    assert times == sorted(set(times))


def test_a_body_without_the_field_does_not_grey_the_others(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    result = wsph.run(two_bodies("f64"))
    result.plot("plastic_strain", tmp_path / "x.png")
    with image.open(tmp_path / "x.png") as page:
        colours = np.unique(np.asarray(page.convert("RGB")).reshape(-1, 3), axis=0).astype(int)
    assert (np.ptp(colours, axis=1) > 60).sum() > 10
    nothing = {"position": np.zeros((3, 3)), "damage": np.full(3, np.nan)}
    with pytest.raises(OutputError, match="'damage' is no finite number anywhere in the frame"):
        picture(shot(nothing, 0.0), Look("damage"))


def test_a_list_of_frames_that_is_damaged_is_named(tmp_path: Path) -> None:
    for text in (b"\xff\xfe", b'<DataSet timestep="np.float64(0.1)" part="0" file="frames/f.vtu"/>'):
        (tmp_path / "frames.pvd").write_bytes(text)
        with pytest.raises(OutputError, match=r"frames.pvd: cannot be read"):
            frames(tmp_path)


def test_meshio_reads_the_frames(tmp_path: Path) -> None:
    """Points, cells and fields, of bodies with cells and of particles."""
    meshio = pytest.importorskip("meshio")
    result = wsph.run(two_bodies("f64"), tmp_path / "out")
    mesh = meshio.read(sorted((tmp_path / "out" / "frames").glob("*.vtu"))[-1])
    assert len(mesh.points) == len(result.particles["velocity"])
    np.testing.assert_array_equal(mesh.point_data["velocity"][:, : result.scene.dim], result.particles["velocity"])
    assert sum(len(block.data) for block in mesh.cells) > 0
    assert mesh.field_data["TimeValue"].ravel().tolist() == [result.time]
