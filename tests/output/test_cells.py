"""Bodies of stress points are cells in every format, as VTK's own readers read them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lagrangian.bodies import FITTED, IRREGULAR, MESHED, composed, mesh_file
from tests.output import readers
from wsph.output.fields import tensor
from wsph.output.folder import OutputFolder
from wsph.output.view.recorded import words
from wsph.simulation.probing.records import Records

pytest.importorskip("h5py")
pv = pytest.importorskip("pyvista")

WARPED = {"jittered cube": 0.1, "bent bar": 0.02, "fitted ball": 0.1, "hexahedra": 0.1, "hexahedra and tetrahedra": 0.1}
"""Bodies of hexahedra whose faces are not flat: VTK takes their volumes from tetrahedra, ours are those of the map."""

SLOPE = np.array([[0.02, 0.03, -0.01], [0.05, -0.04, 0.015], [0.01, 0.025, 0.03]])


def written(composition: Any, folder: Path, displacement: np.ndarray) -> Any:
    """Write a frame of that displacement, (n, dim) nondimensional; returns the reading of its body."""
    run = composition.bodies[0]
    run.system.state.write("displacement", displacement)
    run.system.refresh(run.system.state)
    records = Records(composition, (), OutputFolder(folder, readers.FORMATS, None, ["b"]))
    records.frame(0)
    return run.reading


@pytest.mark.filterwarnings("ignore:body .* pieces that have no node in common")
@pytest.mark.parametrize("name", ["bar", "square", "turned", "cube", *IRREGULAR, *FITTED, *MESHED])
def test_cells_are_whole_and_carry_the_stress_of_their_points(name: str, tmp_path: Path) -> None:
    """A linear displacement: VTK's gradient of the displacement is that everywhere, which no other order of corners gives;
    volumes are positive and ours."""
    composition = composed(name, "stress-points")
    system = composition.bodies[0].system
    dim, body = system.space.dim, system.geometry
    slope = SLOPE[:dim, :dim]
    reading = written(composition, tmp_path, body.nodes @ slope.T / system.scales.length)
    stress = tensor(reading.of_cells("stress"), reading.labels)
    assert np.ptp(stress, axis=0) == pytest.approx(np.zeros(6), abs=1e-10)
    for which, read in readers.READERS.items():
        grid = read(tmp_path, 0)
        assert grid.n_cells == sum(len(corners) for corners in body.blocks), which
        assert grid.points[:, :dim] == pytest.approx(body.nodes @ (np.eye(dim) + slope).T, rel=1e-12, abs=1e-12)
        sizes = readers.volumes(grid)
        assert sizes.min() > 0.0
        assert sizes.sum() == pytest.approx(body.cell_volume.sum() * np.linalg.det(np.eye(dim) + slope), rel=1e-3)
        found = grid.cell_data["stress"]
        full = found.reshape(-1, 9)[:, [0, 4, 8, 1, 5, 2]] if which == "xdmf" else found
        assert np.array_equal(full, stress)
        move = grid.points - np.pad(body.nodes, ((0, 0), (0, 3 - dim)))
        grid.points -= move
        ours = [body.cell_volume[at[:, 0]] for at in body.points_of_cells if at.shape[1] == 1]
        if ours:
            expected = np.concatenate(ours)
            assert readers.volumes(grid)[: len(expected)] == pytest.approx(expected, rel=WARPED.get(name, 1e-9))
        if dim > 1:
            grid.point_data["move"] = move
            gradient = grid.compute_derivative("move").point_data["gradient"].reshape(-1, 3, 3)
            assert gradient[:, :dim, :dim] == pytest.approx(np.tile(slope, (grid.n_points, 1, 1)), abs=1e-9)


def mixed(precision: str, **output: Any) -> wsph.Scene:
    """A body of quadrilaterals and triangles between two lattices, of which one flows and one cracks open."""
    law = scenes.material("perzyna", yield_stress=1e-3, hardening_modulus=0.1, fluidity=0.02, exponent=1.0)
    from_file = {
        "name": "meshed",
        "mesh": {"file": mesh_file("quads and triangles")},
        "material": scenes.material(),
        "state": "strain",
    }
    bodies = [
        scenes.body(scenes.box((2.0, 3.0), 1.0), 0.25, name="flows", material=law, velocity=["-0.1*x", "0"]),
        scenes.body(
            scenes.box((4.0, 5.0), 1.0),
            0.25,
            name="cracked",
            cracks=[{"from": [4.5, 1.0], "to": [4.5, 0.5]}],
            velocity=["0.2*(x - 4.5)", "0"],
        ),
    ]
    wanted = ["velocity", "stress", "plastic_strain", "von_mises", "displacement", "density"]
    scene = scenes.scene(
        *bodies,
        run={"precision": precision, "end": 0.5},
        output={"formats": readers.FORMATS, "fields": wanted, **output},
    )
    data = scene.data()
    data["bodies"].insert(1, from_file)
    return wsph.Scene(**data)


@pytest.mark.parametrize(("precision", "positions"), [("f64", "current"), ("f32", "reference")])
def test_bodies_of_several_kinds_of_cells(tmp_path: Path, precision: str, positions: str) -> None:
    result = wsph.run(mixed(precision, positions=positions), tmp_path)
    of = {"f64": np.float64, "f32": np.float32}[precision]
    names = ["flows", "meshed", "cracked"]
    with np.load(tmp_path / "frames" / "frame_000001.npz") as archive:
        frame = dict(archive)
    assert str(frame["positions"]) == positions
    assert {name: len(corners) for name, corners in frame.items() if name.startswith("corners/")} == {
        "corners/quadrilateral": 47,
        "corners/triangle": 30,
    }
    moved = result.particles["position"] + result.particles["displacement"][:, :2]
    expected = moved if positions == "current" else result.particles["position"]
    for which, read in readers.READERS.items():
        grid = read(tmp_path, 1)
        assert readers.volumes(grid).min() > 0.0, which
        assert grid.points.dtype == of
        assert grid.points[:, :2] == pytest.approx(expected, rel=1e-6)
        body = grid.cell_data["body"]
        assert grid.cell_centers().points[:, 0].astype(int) == pytest.approx(np.array([2, 0, 4])[body], abs=0)
        assert np.array_equal(body, grid.point_data["body"][[cell.point_ids[0] for cell in grid.cell]])
        for name in ("stress", "plastic_strain", "von_mises"):
            assert grid.cell_data[name].dtype == grid.point_data[name].dtype == of
            if name != "stress" or which != "xdmf":
                assert np.array_equal(grid.cell_data[name], frame[f"cells/{name}"], equal_nan=True)
                assert np.array_equal(grid.point_data[name], frame[name], equal_nan=True)
        assert "velocity" not in grid.cell_data
        assert "density" not in grid.cell_data
        assert np.array_equal(np.isnan(grid.cell_data["plastic_strain"]), body > 0)
        inside, at_nodes = grid.cell_data["plastic_strain"][body == 0], grid.point_data["plastic_strain"]
        assert inside.max() > 0.0
        assert inside.min() <= np.nanmin(at_nodes) <= np.nanmax(at_nodes) <= inside.max()
        if which != "xdmf":
            assert words(grid, "bodies") == names
            assert words(grid, "positions") == [positions]
            assert "stress: Pa" in words(grid, "units")


def test_the_whole_run_has_its_times(tmp_path: Path) -> None:
    result = wsph.run(mixed("f64", every=0.2), tmp_path)
    reader = readers.vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "frames.vtkhdf"))
    reader.UpdateInformation()
    listed = pv.get_reader(tmp_path / "frames.pvd").time_values
    assert readers.times(reader) == listed
    assert listed[-1] == result.time
    series = readers.vtk.vtkXdmfReader()
    series.SetFileName(str(tmp_path / "frames.xdmf"))
    series.UpdateInformation()
    assert readers.times(series) == listed
    for number in range(len(listed)):
        velocity = [read(tmp_path, number).point_data["velocity"] for read in readers.READERS.values()]
        assert all(np.array_equal(each, velocity[0]) for each in velocity)
        assert number == 0 or not np.array_equal(velocity[0], readers.vtu(tmp_path, number - 1).point_data["velocity"])


def test_a_crack_opens(tmp_path: Path) -> None:
    """The sides of the crack are edges of the surface, and go apart."""
    wsph.run(mixed("f64"), tmp_path)
    grid = readers.vtu(tmp_path, 1)
    mine = grid.extract_cells(np.flatnonzero(grid.cell_data["body"] == 2))
    edges = mine.extract_surface(algorithm="dataset_surface").extract_feature_edges(
        boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
    )
    middles = edges.cell_centers().points
    inner = middles[(abs(middles[:, 0] - 4.5) < 0.1) & (middles[:, 1] > 0.55) & (middles[:, 1] < 0.95)]
    left, right = inner[inner[:, 0] < 4.5], inner[inner[:, 0] > 4.5]
    assert len(left) == len(right) == 2
    assert right[:, 0].min() - left[:, 0].max() > 1e-3


@pytest.mark.parametrize(
    ("integrator", "formulation", "kind"),
    [
        ("leapfrog", "stress-points", 9),
        ("leapfrog", "total-lagrangian", 9),
        ("leapfrog", "updated-lagrangian", 1),
        ("tsph", None, 1),
        ("ul-tsph", None, 1),
    ],
)
def test_forms_without_cells_are_points(integrator: str, formulation: str | None, kind: int, tmp_path: Path) -> None:
    form = {"formulation": formulation} if formulation else {}
    material = scenes.material("jaumann" if formulation == "updated-lagrangian" or not form else "elastic")
    scene = scenes.block(2, 4, run={"integrator": integrator, "end": 0.1, **form}, material=material,
                         tables={"output": {"formats": readers.FORMATS}})  # fmt: skip
    wsph.run(scene, tmp_path)
    for read in readers.READERS.values():
        grid = read(tmp_path, 1)
        # XDMF has vertices as sets of one.
        assert set(grid.celltypes) <= ({kind} if kind > 1 else {1, 2})
        assert ("stress" in grid.cell_data) == (formulation == "stress-points")


def test_a_run_that_goes_on_lists_the_frames_that_a_format_has(tmp_path: Path) -> None:
    """Frames before the checkpoint have other formats and fields: what is not there is not made up."""
    scene = scenes.block(
        2, 4, run={"end": 1.0}, velocity=["0.1*x", "0"], tables={"checkpoint": {"every": 4, "keep": 9}}
    )
    first = scene.with_(output={"every": 2, "formats": ["vtu"]}, end=0.5)
    wsph.run(first, tmp_path)
    wsph.run(
        scene.with_(output={"every": 2, "formats": ["vtkhdf"], "fields": ["velocity"]}, end=0.8), tmp_path, resume=True
    )
    reader = readers.vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "frames.vtkhdf"))
    reader.UpdateInformation()
    earlier = readers.times(reader)
    assert 0.3 < earlier[0] < earlier[-1]
    wsph.run(
        scene.with_(output={"every": 2, "formats": ["vtkhdf"], "fields": ["velocity", "stress"]}, end=1.0),
        tmp_path,
        resume=True,
    )
    last = len(list((tmp_path / "frames").glob("*.vtkhdf"))) - 1
    without, having = readers.vtkhdf(tmp_path, 0), readers.vtkhdf(tmp_path, last)
    assert np.isnan(without.cell_data["stress"]).all()
    assert np.isfinite(without.point_data["velocity"]).all()
    assert np.isfinite(having.cell_data["stress"]).all()
