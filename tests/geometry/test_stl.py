"""STL files: read in every way they are written, refused by name where they are no body, parted at their edges."""

from pathlib import Path

import numpy as np
import pytest
import tomli_w

import wsph
from examples.bracket import bracket, write_stl
from tests.geometry.fitted_quality import patch_areas, volumes
from tests.scenes import body, box, material, scene, shape
from wsph.errors import SceneError
from wsph.geometry.fitted.fit import fit
from wsph.geometry.lattice import lattice
from wsph.geometry.shapes.shape import BaseShape
from wsph.geometry.shapes.triangulation import triangulate

CUBE = {"type": "stl", "file": "cube.stl"}


def cube_triangles(parts: int = 4) -> np.ndarray:
    """The unit cube from the origin, every side of parts x parts squares of two triangles, (f, 3, 3)."""
    u, v = (grid.ravel() / parts for grid in np.meshgrid(np.arange(parts), np.arange(parts), indexing="ij"))
    low = np.stack([u, v, np.zeros(len(u))], 1)
    a, b = np.array([1.0 / parts, 0.0, 0.0]), np.array([0.0, 1.0 / parts, 0.0])
    below = np.concatenate([np.stack([low, low + b, low + a + b], 1), np.stack([low, low + a + b, low + a], 1)])
    above = below[:, ::-1] + [0.0, 0.0, 1.0]
    return np.concatenate([np.roll(side, turn, axis=2) for side in (below, above) for turn in range(3)])


def sphere_triangles(count: int = 48) -> np.ndarray:
    """A unit sphere, (f, 3, 3)."""
    polar, angle = np.linspace(0.0, np.pi, count // 2 + 1), 2.0 * np.pi * np.arange(count + 1) / count
    points = np.stack(
        [np.outer(np.sin(polar), f(angle)) for f in (np.cos, np.sin)] + [np.outer(np.cos(polar), np.ones(count + 1))], 2
    )
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    both = np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])
    areas = np.linalg.norm(np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0]), axis=1)
    return both[areas > 1e-9]


def as_text(triangles: np.ndarray) -> str:
    lines = ["solid part"]
    for corners in triangles:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x:.7e} {y:.7e} {z:.7e}" for x, y, z in corners)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid part"])


def part(path: Path, triangles: np.ndarray, **keys: object) -> BaseShape:
    write_stl(path, triangles)
    return shape(type="stl", file=str(path), **keys)


class TestReading:
    def test_binary_and_text_are_the_same(self, tmp_path: Path) -> None:
        binary = part(tmp_path / "a.stl", cube_triangles())
        (tmp_path / "b.stl").write_text(as_text(cube_triangles()))
        text = shape(type="stl", file=str(tmp_path / "b.stl"))
        assert np.array_equal(binary.triangulation.vertices, text.triangulation.vertices)
        assert len(binary.triangulation.vertices) == 98
        assert [patch.name for patch in text.patches()] == [f"patch-{k}" for k in range(6)]

    def test_a_binary_file_that_begins_as_text_is_read_as_binary(self, tmp_path: Path) -> None:
        write_stl(tmp_path / "a.stl", cube_triangles())
        data = (tmp_path / "a.stl").read_bytes()
        (tmp_path / "a.stl").write_bytes(b"solid facet" + data[11:])
        assert shape(type="stl", file=str(tmp_path / "a.stl")).bounds()[1].tolist() == [1.0, 1.0, 1.0]

    @pytest.mark.parametrize("scale", ["1 mm", 0.001, "0.1 cm"])
    def test_scale_is_a_length_or_a_number(self, tmp_path: Path, scale: object) -> None:
        assert part(tmp_path / "a.stl", cube_triangles(), scale=scale).bounds()[1] == pytest.approx(
            [1e-3] * 3, rel=1e-12
        )

    def test_triangles_inside_out_are_turned(self, tmp_path: Path) -> None:
        made = part(tmp_path / "a.stl", cube_triangles()[:, ::-1])
        assert made.contains(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]])).tolist() == [True, False]
        assert made.patches()[0].surface.height(np.array([[0.5, 0.5, 0.5]]))[0] == pytest.approx(-0.5)

    def test_a_file_that_has_changed_is_read_again(self, tmp_path: Path) -> None:
        first = part(tmp_path / "a.stl", cube_triangles(2))
        assert len(first.triangulation.faces) == 48
        assert len(part(tmp_path / "a.stl", cube_triangles(3)).triangulation.faces) == 108

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            (None, "no such file"),
            (b"", "is empty"),
            (b"v 0 0 0\nf 1 2 3\n", "is no STL file"),
            (b"solid a\nendsolid a\nfacet", "has no triangles"),
            (b"\0" * 84, "has no triangles"),
            (b"solid a\nfacet normal 0 0 1\nvertex 0 0 x\nendfacet", "could not convert"),
            (b"solid a\nfacet normal 0 0 1\nvertex 0 0 1\nendfacet", "has 1 corners for 1 triangles"),
        ],
    )  # fmt: skip
    def test_what_is_none_is_refused_by_name(self, tmp_path: Path, content: bytes | None, message: str) -> None:
        path = tmp_path / "part.stl"
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(ValueError, match=rf"part.stl: {message}"):
            shape(type="stl", file=str(path))

    def test_a_folder_and_a_file_cut_short_are_refused(self, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match="cannot be read"):
            shape(type="stl", file=str(tmp_path))
        write_stl(tmp_path / "a.stl", cube_triangles())
        (tmp_path / "a.stl").write_bytes((tmp_path / "a.stl").read_bytes()[:1000])
        with pytest.raises(ValueError, match="is cut short: 18 of its 192 triangles are there"):
            shape(type="stl", file=str(tmp_path / "a.stl"))


class TestClosed:
    def test_a_missing_side_is_refused_with_how_much_and_where(self, tmp_path: Path) -> None:
        triangles = cube_triangles()
        without = triangles[~(triangles[:, :, 2] == 1.0).all(1)]
        with pytest.raises(ValueError, match=r"a.stl: is not closed: 16 edges .* about 0.2 of the area is missing, most of it near \[0.5, 0.5, 1.0\] m"):  # fmt: skip
            part(tmp_path / "a.stl", without)

    def test_triangles_that_are_not_oriented_alike_are_refused(self, tmp_path: Path) -> None:
        triangles = cube_triangles()
        triangles[7] = triangles[7, ::-1]
        with pytest.raises(ValueError, match="are not oriented alike: along 3 edges"):
            part(tmp_path / "a.stl", triangles)

    def test_a_sheet_without_volume_is_refused(self) -> None:
        sheet = cube_triangles()[:32]
        with pytest.raises(ValueError, match="has no volume"):
            triangulate(np.concatenate([sheet, sheet[:, ::-1]]), 30.0)

    def test_a_few_missing_triangles_are_filled(self, tmp_path: Path) -> None:
        """Of a sphere of 2208 triangles six far from each other."""
        whole = sphere_triangles()
        left = np.delete(whole, [100, 400, 800, 1200, 1500, 1900], axis=0)
        made, full = part(tmp_path / "a.stl", left), part(tmp_path / "b.stl", whole)
        assert len(made.patches()) == 1
        points = np.random.default_rng(0).uniform(-1.1, 1.1, (5000, 3))
        assert np.array_equal(made.holds(points), full.holds(points))
        surface = made.patches()[0].surface
        assert surface.areas.sum() == pytest.approx(full.patches()[0].surface.areas.sum(), rel=1e-6)


class TestSurface:
    def test_inside_and_distance_of_a_sphere(self, tmp_path: Path) -> None:
        made = part(tmp_path / "a.stl", 1e-3 * sphere_triangles() + 5.0)
        off = np.random.default_rng(1).uniform(-1.5e-3, 1.5e-3, (2000, 3))
        radius = np.linalg.norm(off, axis=1)
        # Chords of 48 around lie up to 0.3 % inside; the file has seven digits of 5.
        clear = np.abs(radius - 1e-3) > 8e-6
        assert np.array_equal(made.holds(5.0 + off)[clear], radius[clear] < 1e-3)
        height, gradient = made.patches()[0].surface.height(5.0 + off)
        close = np.abs(radius - 1e-3) < 3e-4
        assert np.abs(height - (radius - 1e-3))[close].max() < 2e-5
        assert (gradient * off).sum(1)[close].min() > 0.0

    def test_pieces_are_parted_at_the_angle(self, tmp_path: Path) -> None:
        """The bracket's eleven edges are sharper than 30 degrees; at 100 all is one piece."""
        made = part(tmp_path / "a.stl", bracket(), scale="1 mm")
        areas = [float(patch.surface.areas.sum()) for patch in made.patches()]
        assert areas == sorted(areas, reverse=True)
        assert areas[0] == pytest.approx(1.8e-3 - 48 / 2 * np.sin(2 * np.pi / 48) * 36e-6, rel=1e-6)
        assert len(areas) == 9
        flat = [patch.name for patch in made.patches() if patch.surface.normal is not None]
        assert flat == ["patch-0", "patch-1", "patch-2", "patch-3", "patch-6", "patch-7", "patch-8"]
        one = part(tmp_path / "b.stl", bracket(), scale="1 mm", angle=130.0)
        assert [patch.name for patch in one.patches()] == ["patch-0"]

    def test_a_cube_is_the_box(self, tmp_path: Path) -> None:
        """By its planes, which the grid meets: no layer, no projection."""
        made, known = part(tmp_path / "a.stl", cube_triangles()), shape(**box(1.0, 1.0, 1.0))
        mesh, other = fit(made, 0.2), fit(known, 0.2)
        assert np.abs(mesh.nodes - other.nodes).max() < 1e-12
        assert patch_areas(mesh) == pytest.approx({f"patch-{k}": 1.0 for k in range(6)}, rel=1e-12)

    def test_a_lattice_fills_it(self, tmp_path: Path) -> None:
        made = part(tmp_path / "a.stl", bracket(), scale="1 mm")
        body = lattice(made, 0.001)
        assert body.cell_volume.sum() == pytest.approx(2.034e-5, rel=0.02)
        assert body.faces.named("-z").sum() == pytest.approx(60 * 30 - np.pi * 36, rel=0.02)

    def test_a_part_of_unions_and_differences(self, tmp_path: Path) -> None:
        write_stl(tmp_path / "a.stl", cube_triangles())
        cube = {"type": "stl", "file": str(tmp_path / "a.stl"), "name": "cube", "rotate": ["z", 30.0]}
        bore = {"type": "cylinder", "name": "bore", "from": [0.5, 0.5, -1.0], "to": [0.5, 0.5, 2.0], "radius": 0.2}
        mesh = fit(shape(type="difference", shapes=[cube, bore]), 0.07)
        assert volumes(mesh).sum() == pytest.approx(1.0 - 0.04 * np.pi, rel=5e-3)
        areas = patch_areas(mesh)
        assert areas.pop("bore") == pytest.approx(0.4 * np.pi, rel=0.02)
        assert set(areas) == {f"cube/patch-{k}" for k in range(6)}


class TestScenes:
    def test_a_file_is_looked_for_beside_the_scene(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        text = scene(body({"type": "sphere", "center": [0.0] * 3, "radius": 1.0}, 0.1)).data()
        folder = tmp_path / "case"
        folder.mkdir()
        write_stl(folder / "cube.stl", cube_triangles())
        text["bodies"][0]["shape"] = CUBE
        (folder / "scene.toml").write_text(tomli_w.dumps(text))
        monkeypatch.chdir(tmp_path)
        found = wsph.load("case/scene.toml")
        assert found.bodies[0].shape.file == str(folder / "cube.stl")
        (folder / "cube.stl").rename(tmp_path / "cube.stl")
        assert wsph.load("case/scene.toml").bodies[0].shape.file == "cube.stl"

    def test_one_that_is_missing_is_named_with_its_key(self) -> None:
        part = {"name": "b", "shape": CUBE, "spacing": 0.1, "material": material()}
        run = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.3}
        with pytest.raises(SceneError) as error:
            wsph.Scene(schema=1, dim=3, run=run, bodies=[part])
        (fault,) = error.value.faults
        assert fault.key == "bodies.0.shape"
        assert "cube.stl: no such file" in fault.message
