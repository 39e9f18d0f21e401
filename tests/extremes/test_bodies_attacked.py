"""Bodies as hostile hands give them: far from the origin, in spacings that do not divide, with sharp edges, with cells in
pieces and nodes in a wrong order; and what is asked of their surfaces."""

import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.boundary.selections import Selection, selections
from wsph.cli import main
from wsph.errors import WsphError
from wsph.geometry.fitted.fit import fit
from wsph.geometry.meshes.meshed import meshed
from wsph.simulation.compose import compose, stairs

Data = dict[str, Any]
DISC: Data = {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}
RING: Data = {"type": "ring", "center": [0.0, 0.0], "inner": 0.25, "outer": 0.5}
HOLE: Data = {"type": "disc", "name": "hole", "center": [0.5, 0.5], "radius": 0.2}
PLATE: Data = {"type": "difference", "shapes": [scenes.box(1.0, 1.0), HOLE]}


def entry(**keys: Any) -> Data:
    return {"body": "b", **keys}


def selected(scene: wsph.Scene) -> list[Selection]:
    system = compose(scene).bodies[0].system
    return list(selections(scene, "b", system.geometry, system.position, scene.run.end))


def cells(path: Path, points: np.ndarray, kind: str, corners: Any) -> Data:
    """A body of the cells of a file."""
    meshio.write(path, meshio.Mesh(np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), [(kind, np.array(corners))]))
    state = {"state": "strain"} if points.shape[1] == 2 else {}
    return {"name": "b", "mesh": {"file": str(path)}, "material": scenes.material(), **state}


def of_cells(body: Data, dim: int = 2, **run: Any) -> wsph.Scene:
    return wsph.Scene(schema=1, dim=dim, run={"integrator": "leapfrog", "end": 0.1, "cfl": 0.5, **run}, bodies=[body])


class TestShapes:
    """What of a shape is fitted, and what is said where it cannot be."""

    @pytest.mark.parametrize(("scale", "off"), [(1.0, 1e3), (1e-6, 1e-3), (1e-3, -1e3), (1e3, 0.0)])
    @pytest.mark.parametrize("rotate", [0.0, 30.0])
    def test_one_far_from_the_origin_is_the_one_at_it(self, scale: float, off: float, rotate: float) -> None:
        """A disc that runs into the sides of a box: what samples miss of its surface must not count by the offset."""

        def union(scale: float, off: float) -> Any:
            box = {"type": "box", "min": [off, off], "max": [off + scale, off + scale]}
            disc = {"type": "disc", "center": [off + scale, off + 0.5 * scale], "radius": 0.5 * scale}
            return scenes.shape(type="union", shapes=[box, disc], rotate=rotate)

        volumes = [
            meshed(fit(union(s, o), 0.05 * s, 0)).cell_volume.sum() / s**2 for s, o in ((1.0, 0.0), (scale, off))
        ]
        assert volumes[1] == pytest.approx(volumes[0], rel=1e-6)
        assert volumes[0] == pytest.approx(1.0 + np.pi / 8.0, rel=1e-3)

    @pytest.mark.parametrize("data", [
        {"type": "polygon", "points": [[0.0, 0.0], [1.0, 0.0], [1.0, 0.17]]},
        {"type": "difference", "shapes": [scenes.box(1.0, 1.0), {"type": "disc", "center": [0.8, 0.5], "radius": 0.2}]},
    ], ids=["wedge", "tangent"])  # fmt: skip
    def test_where_no_spacing_helps_none_is_named(self, data: Data) -> None:
        with pytest.raises(ValueError, match="touch or meet at a sharp angle near .* which no spacing gives") as error:
            fit(scenes.shape(**data), 0.02, 0)
        assert "a spacing of at most" not in str(error.value)

    def test_a_place_is_told_to_a_part_of_a_spacing_however_far_out(self) -> None:
        thin = scenes.shape(**{**RING, "center": [1000.0, 0.0], "inner": 0.45})
        with pytest.raises(ValueError, match=r"the wall at \[(999|1000)\.\d{3,4}, -?0\.\d{2,4}\] m"):
            fit(thin, 0.04, 0)

    def test_a_spacing_that_divides_nothing_is_for_fitted_surfaces(self) -> None:
        def made(shape: Data, run: Data | None = None, **keys: Any) -> wsph.Scene:
            return scenes.scene(scenes.body(shape, 0.07, **keys), run=run)

        geometry = compose(made(PLATE)).bodies[0].system.geometry
        assert geometry.cell_volume.sum() == pytest.approx(1.0 - 0.04 * np.pi, rel=2e-3)
        box = compose(made(scenes.box(1.0, 1.0), surface="fitted")).bodies[0].system.geometry
        assert box.cell_volume.sum() == pytest.approx(1.0, rel=1e-12)
        with pytest.raises(WsphError, match='does not divide the box\'s x edge.*; surface = "fitted" takes any'):
            made(scenes.box(1.0, 1.0))
        for refused in (made(PLATE, {"formulation": "total-lagrangian"}), made(PLATE, jitter=0.1),
                        made(PLATE, {"integrator": "tsph"})):  # fmt: skip
            with pytest.raises(
                WsphError, match=r"bodies.0.spacing: 0.07 m does not divide .* in steps of a cell at .*hole"
            ):
                compose(refused)


class TestStairs:
    @pytest.mark.parametrize(("changes", "why"), [
        ({}, None),
        ({"surface": "stairs"}, 'the body asks for surface = "stairs"'),
        ({"jitter": 0.1}, "the body has jitter"),
        ({"map": ["x", "y + 0.1*x"]}, "the body has map"),
        ({"lattice_rotate": 20.0}, "the body has lattice_rotate"),
        ({"spacing": [0.05, 0.1]}, "one spacing for all axes"),
        ({"run": {"support": 1.8}}, "run.support asks for the pairs of a kernel"),
        ({"run": {"formulation": "total-lagrangian"}}, "the total-lagrangian form has no points"),
        ({"run": {"formulation": "updated-lagrangian"}}, "the updated-lagrangian form has no points"),
        ({"run": {"integrator": "tsph"}}, "the small-strain form has no points"),
        ({"contact": [{"self": "b", "law": "pinball"}]}, "contact between balls"),
        ({"contact": [{"self": "b"}]}, None),
    ], ids=str)  # fmt: skip
    def test_are_said_with_their_reason(self, changes: Data, why: str | None) -> None:
        tables = {key: changes[key] for key in changes if key in ("contact", "run")}
        keys = {key: changes[key] for key in changes if key not in tables}
        made = {"spacing": 0.1, **keys}
        told = stairs(scenes.scene(scenes.body(PLATE, made.pop("spacing"), **made), **tables))
        assert told == {} if why is None else re.match(rf"in steps of a cell at .*hole: .*{why}", told["b"])

    def test_are_none_where_the_surface_lies_on_the_grid(self) -> None:
        run = {"formulation": "total-lagrangian"}
        assert stairs(scenes.scene(scenes.body({**scenes.box(1.0, 1.0), "rotate": 20.0}, 0.1), run=run)) == {}


BOSS: Data = {"type": "union", "shapes": [
    {**scenes.box(1.0, 1.0), "name": "low"}, {**scenes.box((0.3, 0.7), (1.0, 1.5)), "name": "boss"}]}  # fmt: skip


class TestPatches:
    """Names of what lies on the lines of a grid, on every form."""

    @pytest.mark.parametrize(("run", "keys"), [
        ({}, {}), ({"formulation": "total-lagrangian"}, {}), ({"formulation": "updated-lagrangian"}, {}),
        ({"integrator": "tsph"}, {}), ({}, {"jitter": 0.1}), ({}, {"map": ["x", "y + 0*x"]}),
    ], ids=str)  # fmt: skip
    def test_of_a_union_on_the_grid(self, run: Data, keys: Data) -> None:
        pull = entry(patch="boss/+y", traction={"y": 2.0}) if "integrator" not in run else entry(
            patch="boss/+y", stress={"yy": 2.0})  # fmt: skip
        scene = scenes.scene(scenes.body(BOSS, 0.1, **keys), run={"cfl": 0.1, **run}, boundary=[pull])
        [top] = selected(scene)
        assert top.faces == {"+y": pytest.approx(0.4)}
        assert top.resultant == pytest.approx([0.0, 0.8])
        assert str(top).startswith("b, patch boss/+y: ")

    def test_of_a_square_hole_in_a_turned_plate_are_the_sides_of_its_box(self) -> None:
        hole = {**scenes.box((0.4, 0.6), (0.4, 0.6)), "name": "hole"}
        shape = {"type": "difference", "shapes": [scenes.box(1.0, 1.0), hole], "rotate": 30.0}
        [side] = selected(scenes.scene(scenes.body(shape, 0.1), boundary=[entry(patch="hole/+x", pressure=0.01)]))
        # The hole's +x side looks to -x, so that the pressure pushes along +x.
        assert side.resultant == pytest.approx([0.002 * np.cos(np.pi / 6), 0.002 * np.sin(np.pi / 6)])

    def test_with_one_name_are_one(self) -> None:
        holes = [{"type": "disc", "name": "holes", "center": [x, 0.5], "radius": 0.2} for x in (0.5, 1.5)]
        shape = {"type": "difference", "shapes": [scenes.box(2.0, 1.0), *holes]}
        push = entry(patch="holes", pressure="1e-3*t")
        [both] = selected(scenes.scene(scenes.body(shape, 0.05), boundary=[push]))
        assert sum(both.faces.values()) == pytest.approx(0.8 * np.pi, rel=5e-3)
        # A pressure all around has no resultant, and is looked at where it is largest.
        assert both.resultant is not None
        assert both.resultant.tolist() == [0.0, 0.0]
        assert both.time == pytest.approx(1.0)

    def test_of_stairs_have_their_own_cell_faces(self) -> None:
        body = scenes.body(PLATE, 0.1, surface="stairs")
        [side] = selected(scenes.scene(body, boundary=[entry(patch="box-1/+x", traction={"x": 1.0})]))
        assert side.faces == {"+x": pytest.approx(1.0)}
        [hole] = selected(scenes.scene(body, boundary=[entry(patch="hole", pressure=1.0)]))
        assert hole.resultant == pytest.approx([0.0, 0.0], abs=1e-15)
        with pytest.raises(WsphError, match=r"no patch 'rim': it has box-1/-x, .*hole"):
            compose(scenes.scene(body, boundary=[entry(patch="rim", traction={"x": 1.0})]))


def test_check_lists_cells_and_patches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "plate.toml"
    scene.write_text("""
schema = 1
dim = 2
run = { integrator = "leapfrog", end = 1.0, cfl = 0.5 }
[[bodies]]
name = "b"
spacing = 0.05
state = "strain"
material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.3 }
[bodies.shape]
type = "difference"
shapes = [{ type = "box", min = [0.0, 0.0], max = [1.0, 1.0] },
          { type = "disc", name = "hole", center = [0.5, 0.5], radius = 0.2 }]
[[boundary]]
body = "b"
patch = "hole"
pressure = 0.01
[[boundary]]
body = "b"
face = "+x"
stress = { xx = 0.02 }
""")
    assert main(["check", str(scene)]) == 0
    said = capsys.readouterr().out
    number = r"[\d.e+-]+"
    assert re.search(rf"^  cells +\d+, volume at least {number} m2, median {number} m2; time step by an edge of {number} m, "
                     r"0\.\d\d of the mean$", said, re.MULTILINE)  # fmt: skip
    assert re.search(r"^  patch +box-1/\+x: area 1 m, centre \(1, 0.5\) m, normal \(1, 0\)$", said, re.MULTILINE)
    assert re.search(r"^  patch +hole: area 1.25\d* m, centre \(0.5, 0.5\) m, normals that cancel$", said, re.MULTILINE)
    assert re.search(r"^boundary 0 +b, patch hole: .*; resultant \(0, 0\) N/m$", said, re.MULTILINE)
    assert re.search(r"^boundary 1 +b, face \+x: .*; resultant \(0.02, 0\) N/m$", said, re.MULTILINE)
    assert main(["check", str(scene), "--set", 'bodies.0.surface="stairs"', "--set", "boundary=[]"]) == 0
    assert re.search(
        r"^  surface +in steps of a cell at hole: the body asks for", capsys.readouterr().out, re.MULTILINE
    )


CUBE = np.array([[x, y, z] for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))])


class TestMeshes:
    @pytest.mark.parametrize("order", [[0, 2, 1, 3, 4, 6, 5, 7], [0, 1, 2, 3, 6, 7, 4, 5]], ids=["crossed", "twisted"])
    def test_hexahedra_in_a_wrong_order_are_refused(self, tmp_path: Path, order: list[int]) -> None:
        # Moved a little, so that volumes are not zero by symmetry.
        points = CUBE + 0.02 * np.arange(24).reshape(8, 3) % 0.07
        with pytest.raises(WsphError, match="cells (cross themselves|have no positive volume), the (first|worst) at"):
            compose(of_cells(cells(tmp_path / "a.vtu", points, "hexahedron", [order]), 3))

    def test_quadrilaterals_that_cross_themselves_are_refused(self, tmp_path: Path) -> None:
        points = np.array([[0.0, 0.0], [1.0, 0.0], [1.1, 1.2], [0.0, 1.0]])
        body = cells(tmp_path / "a.vtu", points, "quad", [[0, 2, 1, 3]])
        with pytest.raises(
            WsphError, match="1 cells cross themselves, the first at .*: their nodes are in a wrong order"
        ):
            compose(of_cells(body))

    def test_pieces_that_do_not_hold_together_are_told_of(self, tmp_path: Path) -> None:
        square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        points = np.concatenate([square, square + np.eye(2)[0]])
        body = cells(tmp_path / "a.vtu", points, "quad", [[0, 1, 2, 3], [4, 5, 6, 7]])
        with pytest.warns(
            RuntimeWarning, match="2 pieces that have no node in common .* of 4, 4 nodes; 2 nodes lie on"
        ):
            compose(of_cells(body))

    def test_a_small_cell_that_sets_the_time_step_is_told_of(self, tmp_path: Path) -> None:
        x = np.array([0.0, 1.0, 2.0, 3.0, 3.1])
        points = np.concatenate([np.stack([x, 0.0 * x], 1), np.stack([x, 0.0 * x + 1.0], 1)])
        body = cells(tmp_path / "a.vtu", points, "quad", [[k, k + 1, k + 6, k + 5] for k in range(4)])
        with pytest.warns(
            RuntimeWarning, match=r"its time step is that of an edge of 0\.\d+ m, 0\.\d+ of the mean, of the"
        ):
            compose(of_cells(body))

    @pytest.mark.parametrize("text", ["", "hello"])
    def test_what_is_no_mesh_is_refused_in_words(self, tmp_path: Path, text: str) -> None:
        (tmp_path / "a.msh").write_text(text)
        body = {
            "name": "b",
            "mesh": {"file": str(tmp_path / "a.msh")},
            "material": scenes.material(),
            "state": "strain",
        }
        with pytest.raises(WsphError, match=r"a.msh cannot be read as a mesh.*it is cut short, or of another kind"):
            compose(of_cells(body))


@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
def test_a_pressure_in_time_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path: Path, integrator: str) -> None:
    """The first stage of a step may use what the step before imposed at its end."""
    conditions = [entry(patch="inner", pressure="0.02*t*(1 + x)"), entry(patch="outer", normal="1e-3*sin(t)")]

    def run(end: float, folder: Path, **how: Any) -> wsph.Result:
        keys = {"checkpoint": {"every": 5}, "boundary": conditions}
        scene = scenes.scene(scenes.body(RING, 0.06), run={"integrator": integrator, "end": end, "cfl": 0.9}, **keys)
        return wsph.run(scene, folder, **how)

    whole = run(0.6, tmp_path / "whole")
    run(0.4, tmp_path / "parts")
    parts = run(0.6, tmp_path / "parts", resume=True)
    assert parts.summary["energy"] == whole.summary["energy"]
    for name in ("velocity", "stress"):
        assert (parts.particles[name] == whole.particles[name]).all()


TRIANGLE: Data = {"type": "polygon", "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}


class TestConditions:
    """What would act on nothing, or not as it says, is refused before anything is compiled."""

    @pytest.mark.parametrize(("shape", "keys", "message"), [
        (TRIANGLE, {"patch": "side-2", "symmetry": "x"}, r"boundary.0.symmetry: faces .* lie across no axis: write normal = 0"),
        (DISC, {"face": "-x", "symmetry": "x"}, r"boundary.0.symmetry: faces .* lie across no axis: write normal = 0"),
        (RING, {"patch": "inner", "fixed": ["x", "y"], "pressure": 1.0}, r"boundary.0.pressure: all velocities are prescr"),
        (RING, {"patch": "inner", "fixed": ["x", "y"], "spring": {"stiffness": 1.0}}, r"boundary.0.spring: all velocities"),
        (RING, {"patch": "inner", "normal": 0.0, "pressure": 1.0}, r"boundary.0.pressure: the velocity along the normals"),
        (RING, {"patch": "inner", "pressure": "1/t"}, "a value prescribed at t = 0, is not finite"),
        (RING, {"patch": "inner", "normal": "1/t"}, "a value prescribed at t = 0, is not finite"),
        (RING, {"patch": "inner", "traction": {"x": "1/t"}}, "a value prescribed at t = 0, is not finite"),
    ], ids=str)  # fmt: skip
    def test_that_cannot_be_are_named(self, shape: Data, keys: Data, message: str) -> None:
        with pytest.raises(WsphError, match=message):
            compose(scenes.scene(scenes.body(shape, 0.06), boundary=[entry(**keys)]))

    def test_symmetry_across_an_axis_and_springs_beside_sliding_are_taken(self) -> None:
        good = [entry(patch="side-3", symmetry="x"), entry(patch="side-2", normal=0.0, spring={"stiffness": 1.0})]
        assert len(selected(scenes.scene(scenes.body(TRIANGLE, 0.06), boundary=good))) == 2
