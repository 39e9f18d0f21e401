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
from wsph.output.fields import von_mises
from wsph.output.folder import OutputFolder

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
scene = wsph.load(sys.argv[1]).with_(end="10 s", output={"every": 3, "formats": ["vtu"]})
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


def test_two_dimensional_fields_are_padded(tmp_path: Path) -> None:
    writer = OutputFolder(tmp_path, ("vtu",))
    writer.frame(0.0, np.ones((4, 2)), {"velocity": np.ones((4, 2)), "density": np.ones(4)})
    mesh = pv.read(tmp_path / "frames" / "frame_000000.vtu")
    assert mesh.point_data["velocity"].tolist() == [[1.0, 1.0, 0.0]] * 4
    assert np.asarray(mesh.points).tolist() == [[1.0, 1.0, 0.0]] * 4
