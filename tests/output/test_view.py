"""Pictures: made off-screen, with what was asked for in them, and every word in a place of its own."""

import re
import sys
import types
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.cli import main
from wsph.errors import OutputError
from wsph.output.cells import Gathered
from wsph.output.folder import OutputFolder
from wsph.output.view import tables
from wsph.output.view.bodies import edges
from wsph.output.view.look import CAMERAS, Look, Plane, chosen, plane, span
from wsph.output.view.page import Frame
from wsph.output.view.pictures import picture, prepared, save_figure
from wsph.output.view.recorded import Shot, frames, read, shot
from wsph.output.view.scalars import scalar
from wsph.output.view.window import window

pytest.importorskip("pyvista")
pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

UNITS = {"velocity": "m/s", "displacement": "m", "stress": "Pa", "damage": "1"}


def block(
    sides: tuple[float, ...], cells: tuple[int, ...], joined: bool = True, names: tuple[str, ...] = ("b",)
) -> Shot:
    """A frame of a box: stress_xx as x, in cells and at nodes; displacements of a tenth of x along y."""
    dim, counts = len(sides), np.array(cells) + 1
    grid = np.arange(counts.prod()).reshape(counts)
    place = np.stack(np.unravel_index(grid.ravel(), grid.shape), 1) / cells * sides
    ends = [
        grid[tuple(slice(o, n + o) for o, n in zip(offset, cells, strict=True))].ravel()
        for offset in product((0, 1), repeat=dim)
    ]
    corners = np.stack(ends, 1)

    def stress(x: np.ndarray) -> np.ndarray:
        return np.pad(2e8 * x[:, :1] / sides[0], ((0, 0), (0, 5)))

    move = np.zeros((len(place), 3))
    move[:, min(1, dim - 1)] = 0.1 * place[:, 0]
    data = {
        "position": place,
        "velocity": place[:, ::-1].copy(),
        "displacement": move,
        "stress": stress(place),
        "body": np.zeros(len(place), int),
    }
    middles = place[corners].mean(1)
    inside = {"stress": stress(middles), "damage": middles[:, 0] / sides[0], "body": np.zeros(len(corners), int)}
    made = Gathered([[corners] if joined else []], [len(place)], dim).having(inside) if joined else None
    return shot(data, 1.234e-3, made, UNITS, names)


SHOTS = {
    "bar": lambda: block((1.0,), (20,)),
    "particles in a bar": lambda: block((1.0,), (20,), joined=False),
    "plate": lambda: block((0.3, 0.2), (12, 8)),
    "particles in a plate": lambda: block((0.3, 0.2), (12, 16), joined=False),
    "rod": lambda: block((0.3, 0.004), (75, 1)),
    "mast": lambda: block((0.01, 3.0), (1, 75)),
    "cube": lambda: block((1.0, 1.0, 1.0), (4, 4, 4)),
    "column": lambda: block((0.01, 0.01, 0.3), (2, 2, 20)),
    "beam": lambda: block((2e-5, 1e-6, 1e-6), (20, 1, 1)),
    "sheet": lambda: block((3.0, 2.0, 0.01), (6, 4, 1)),
    "particles in a cube": lambda: block((40.0, 30.0, 20.0), (4, 3, 2), joined=False),
}


def words(figure: Any) -> list[tuple[str, Any]]:
    """Every text of a figure that is seen, with its rectangle [pixels]."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    mpl = sys.modules["matplotlib"]
    found, unseen = [], set()
    for axis in [axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)]:
        low, high = sorted(axis.get_view_interval())
        for tick in axis.get_major_ticks():
            if not axis.axes.axison or not low <= tick.get_loc() <= high:
                unseen |= {tick.label1, tick.label2}
    for text in figure.findobj(mpl.text.Text):
        if not text.get_visible() or not text.get_text().strip() or text in unseen:
            continue
        found.append((text.get_text(), text.get_window_extent(renderer)))
    return found


def misplaced(figure: Any) -> list[str]:
    """Texts that overlap another, or leave the page."""
    found, wide, high = words(figure), *figure.canvas.get_width_height()
    inside = [
        f"{name!r} leaves the page" for name, box in found if box.x0 < 0 or box.y0 < 0 or box.x1 > wide or box.y1 > high
    ]
    pairs = [
        f"{a!r} on {b!r}"
        for (a, first), (b, second) in combinations(found, 2)
        if min(first.x1, second.x1) - max(first.x0, second.x0) > 0.5
        and min(first.y1, second.y1) - max(first.y0, second.y0) > 0.5
    ]
    return inside + pairs


@pytest.mark.parametrize("name", SHOTS)
def test_every_word_has_a_place_of_its_own(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """On pages whose images are left white: words do not depend on them."""
    white = lambda *arguments: np.full((arguments[4][1], arguments[4][0], 3), 255, np.uint8)  # noqa: E731
    monkeypatch.setattr("wsph.output.view.pictures.image", white)
    made = SHOTS[name]()
    cameras = ["xy"] if made.flat == 2 else [None] if made.flat == 1 else list(CAMERAS)
    for camera in cameras:
        for field in ("stress_xx", "velocity") if camera in (None, "iso", "xy") else ("stress_xx",):
            figure = picture(made, Look(field, camera=camera))
            assert not misplaced(figure), (camera, field)
            said = " ".join(text for text, _ in words(figure))
            assert "1.234 ms" in said
            assert re.search(r"[µm]*Pa\]" if field == "stress_xx" else r"m/s\]", said)
            axes = {None: "x", "iso": "xyz"}.get(camera, camera)
            assert all(re.search(rf"\b{axis} (\[[µm]*m\]|from)", said) for axis in axes), said


def colours(figure: Any) -> np.ndarray:
    """Pixels of the image on a page, (height, width, 3)."""
    return np.asarray(figure.axes[0].images[0].get_array())


def test_a_body_of_cells_has_no_gaps_and_stands_where_the_axes_say() -> None:
    """A turned and stretched grid: within its corners every pixel has a colour of the map, and outside none."""
    made = block((1.0, 1.0), (6, 6))
    turned = np.array(made.grid.points) @ np.array([[0.9, 0.5, 0.0], [-0.5, 0.9, 0.0], [0.0, 0.0, 1.0]])
    made.grid.points = turned
    figure = picture(made, Look("stress_xx"))
    image, (left, right, bottom, top) = colours(figure).astype(int), figure.axes[0].images[0].get_extent()
    rows, columns = np.indices(image.shape[:2])
    x = left + (columns + 0.5) / image.shape[1] * (right - left)
    y = top - (rows + 0.5) / image.shape[0] * (top - bottom)
    back = np.stack([x, y], -1) @ np.linalg.inv(np.array([[0.9, 0.5], [-0.5, 0.9]]))
    inside = ((back > 0.02) & (back < 0.98)).all(-1)
    outside = ((back < -0.02) | (back > 1.02)).any(-1)
    coloured = np.ptp(image, axis=-1) > 25
    assert coloured[inside].all()
    assert not coloured[outside].any()


def test_colours_say_how_much_in_grey_too() -> None:
    """stress_xx rises with x: so does the lightness of what is drawn, for every choice of colours."""
    for name in ("viridis", "cividis", "gray"):
        image = colours(picture(block((1.0, 0.5), (50, 25)), Look("stress_xx", colours=name)))
        grey = image[image.shape[0] // 2].astype(float) @ [0.299, 0.587, 0.114]
        middle = grey[20:-20]
        steps = middle[np.linspace(0, len(middle) - 1, 12).astype(int)]
        assert (np.diff(steps) > 0.0).all(), name


def test_what_is_asked_for_is_shown() -> None:
    made = block((1.0, 1.0, 1.0), (4, 4, 4))
    bounds = lambda look: np.reshape(prepared(made, look).bodies.bounds, (3, 2))  # noqa: E731
    assert bounds(Look(warp=10.0))[1].tolist() == [0.0, 2.0]
    assert bounds(Look(clip=plane("x<0.25", "<>")))[0].tolist() == [0.0, 0.25]
    assert bounds(Look(clip=plane("z", "<>")))[2].tolist() == [0.5, 1.0]
    assert bounds(Look(slice=plane("y=50 cm")))[1].tolist() == [0.5, 0.5]
    assert bounds(Look(broken=0.5))[0].tolist() == [0.0, 0.5]
    particles = block((1.0, 1.0, 1.0), (4, 4, 4), joined=False)
    assert prepared(particles, Look(slice=Plane(2))).bodies.points.n_points == 25
    inside, smooth = (prepared(made, Look("stress_xx", smooth=each)).shown for each in (False, True))
    assert (inside.in_cells, smooth.in_cells) == (True, False)
    assert (inside.finite.max(), smooth.finite.max()) == pytest.approx((1.75e8, 2e8))
    reference = Shot(made.grid, 0.0, UNITS, ("b",), moved=True)
    assert reference.warped(0.0).grid.points[:, 1] == pytest.approx(
        np.asarray(made.grid.points)[:, 1] - 0.1 * np.asarray(made.grid.points)[:, 0]
    )


def test_a_clip_beside_the_nodes_has_its_rim_and_no_slivers() -> None:
    """Nodes that a motion has moved by 1e-5 of a cell from the plane: of what is laid open the rim alone is drawn."""
    made = block((1.0, 1.0, 1.0), (6, 6, 6))
    points = np.asarray(made.grid.points)
    points[:, 1] += 1e-6 * np.random.default_rng(1).uniform(-1.0, 1.0, len(points))
    look = Look(clip=plane("y>0.5", "<>"))
    surface = prepared(made, look).bodies.surface
    lines = edges(surface, look, flat=False)
    middles = np.asarray(lines.cell_centers().points)
    laid = middles[np.abs(middles[:, 1] - 0.5) < 1e-9]
    rim = np.abs(laid[:, [0, 2]] - 0.5).max(1)
    assert len(laid) >= 24
    assert np.allclose(rim, 0.5)


def test_words_of_options() -> None:
    assert plane("x = 5 mm") == Plane(0, 0.005)
    assert plane("y>0.1", "<>") == Plane(1, 0.1, True)
    assert span("0:80 MPa") == (0.0, 8e7)
    assert span("-1e-3:2") == (-0.001, 2.0)
    assert span("-100:1e2 MPa") == (-1e8, 1e8)
    assert span("1 ms:1 s") == (0.001, 1.0)
    assert chosen(np.array([0.0, 1e-3, 2e-3]), "1:2 ms", False) == [1, 2]
    times = np.array([0.0, 1e-3, 2e-3, 3e-3])
    assert chosen(times, None, False) == [3]
    assert chosen(times, None, True) == [0, 1, 2, 3]
    assert chosen(times, "1.4 ms", True) == [1]
    assert chosen(times, "1 ms:2 ms", False) == [1, 2]
    for faulty, message in [
        (lambda: plane("w"), "is no plane"),
        (lambda: plane("x=5 kg"), "not in units of m"),
        (lambda: span("3"), "write it as LOW:HIGH"),
        (lambda: span("2:1"), "less than the second"),
        (lambda: chosen(times, "4:5", False), "no frame from 4 to 5 s; there are 4 from 0 to 0.003 s"),
        (lambda: picture(block((1.0, 1.0), (2, 2)), Look("heat")), "no field 'heat' in the frame; there is velocity"),
        (lambda: picture(block((1.0, 1.0), (2, 2)), Look("velocty")), "no field 'velocty' in the frame; did you mean 'velocity'"),
        (lambda: picture(block((1.0, 1.0), (2, 2)), Look(body="c")), "no body 'c'; there is b"),
        (lambda: picture(block((1.0, 1.0), (2, 2)), Look(slice=plane("x=3"))), "does not meet the body, which is from 0 to 1 m"),
        (lambda: picture(shot({"position": np.eye(3)}, 0.0), Look(warp=2.0)), "--warp needs displacements"),
        (lambda: picture(shot({"position": np.eye(3)}, 0.0), Look(broken=0.9)), "--broken needs the damage"),
        (lambda: save_figure(None, "x.bmp"), "a picture is .png"),
    ]:  # fmt: skip
        with pytest.raises(OutputError, match=re.escape(message)):
            faulty()


def test_a_window_lies_as_its_axes_say() -> None:
    for camera in CAMERAS:
        seen = window([(0.0, 1.0, 0.0, 2.0, 0.0, 3.0)], camera)
        assert np.stack([seen.right, seen.up, seen.towards]) @ np.stack(
            [seen.right, seen.up, seen.towards]
        ).T == pytest.approx(np.eye(3))
        assert np.linalg.det(np.stack([seen.right, seen.up, seen.towards])) == pytest.approx(1.0)
        assert seen.axes == {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2), "iso": None}[camera]
        assert seen.onto(seen.centre[None])[0] == pytest.approx(seen.middle)
        assert Frame.of(seen).height / Frame.of(seen).width == pytest.approx(seen.aspect)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two bodies, one of which flies away from the other."""
    out = tmp_path_factory.mktemp("view") / "out"
    bodies = [
        scenes.body(scenes.box(1.0, 0.5), 0.25, name="still"),
        scenes.body(scenes.box((1.5, 2.5), 0.5), 0.25, name="flies", velocity=["0.5", "0"]),
    ]
    wsph.run(scenes.scene(*bodies, output={"every": 0.25, "fields": ["velocity", "displacement", "stress"]}), out)
    return out


def test_frames_of_a_movie_have_one_size_and_one_range(run: Path, tmp_path: Path) -> None:
    count = len(frames(run))
    assert main(["view", str(run), "--field", "displacement_x", "--save", str(tmp_path / "all.gif")]) == 0
    assert (
        main(["view", str(run), "--field", "displacement_x", "--time", "0.3:0.8", "--save", str(tmp_path / "part.gif")])
        == 0
    )
    with Image.open(tmp_path / "all.gif") as movie:
        assert movie.n_frames == count
        first = np.asarray(movie.convert("RGB")).astype(int)
        movie.seek(count - 1)
        last = np.asarray(movie.convert("RGB")).astype(int)
    with Image.open(tmp_path / "part.gif") as movie:
        assert movie.n_frames == 2
    # The bar is the same; the body that flies is dark at first.
    assert np.abs(first - last)[-60:].max() <= 40
    assert np.abs(first - last).max() > 100


def test_an_mp4_is_written_by_imageio_or_says_what_it_needs(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written: list[tuple[int, ...]] = []

    class Writer:
        def __init__(self, path: Path, **_: object):
            path.write_bytes(b"mp4")

        def __enter__(self) -> "Writer":
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def append_data(self, page: np.ndarray) -> None:
            written.append(page.shape)

    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", types.ModuleType("imageio_ffmpeg"))
    v2 = types.ModuleType("imageio.v2")
    v2.get_writer = Writer
    monkeypatch.setitem(sys.modules, "imageio", types.ModuleType("imageio"))
    monkeypatch.setitem(sys.modules, "imageio.v2", v2)
    assert main(["view", str(run), "--body", "flies", "--save", str(tmp_path / "a.mp4")]) == 0
    assert len(written) == len(frames(run))
    assert len(set(written)) == 1
    assert not any(size % 2 for size in written[0][:2])
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["view", str(run), "--save", str(tmp_path / "b.mp4")]) == 2
    assert 'pip install "wsph[video]", or save a .gif' in capsys.readouterr().err


def test_pictures_of_a_folder(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for options in (["--body", "still", "--warp", "2"], ["--range", "0:1 Pa", "--time", "0.5"], ["--mesh", "--smooth"]):
        assert main(["view", str(run), "--field", "von_mises", *options, "--save", str(tmp_path / "a.png")]) == 0
        with Image.open(tmp_path / "a.png") as page:
            assert len(np.unique(np.asarray(page.convert("RGB")).reshape(-1, 3), axis=0)) > 50
    for arguments, message in [
        ([str(tmp_path)], "no frames.pvd"),
        ([str(run), "--save", str(tmp_path / "a.bmp")], "a picture is .png, .pdf or .svg, a movie .gif or .mp4"),
        ([str(run), "--body", "c", "--save", str(tmp_path / "a.png")], "no body 'c'; there is still, flies"),
        ([str(run), "--save", str(tmp_path / "none" / "a.png")], "cannot be written"),
    ]:
        assert main(["view", *arguments]) == 2
        assert message in capsys.readouterr().err


def test_frames_of_a_run_in_any_positions_warp_to_the_same(tmp_path: Path) -> None:
    scene = scenes.block(2, 4, velocity=["0.1*x", "0"], tables={"output": {"fields": ["displacement"]}})
    places = []
    for positions in ("current", "reference"):
        wsph.run(scene.with_(output={"positions": positions, "fields": ["displacement"]}), tmp_path / positions)
        places.append(np.asarray(read(*frames(tmp_path / positions)[-1]).warped(3.0).grid.points))
    assert places[0] == pytest.approx(places[1], abs=1e-12)


def test_results_draw_fields_probes_and_energies(tmp_path: Path) -> None:
    probes = [{"name": "middle", "at": [[0.5, 0.5]], "fields": ["stress", "velocity_x", "displacement"]}]
    result = wsph.run(scenes.block(2, 4, velocity=["0.1*x", "0"], tables={"probes": probes}))
    assert result.cells is not None
    assert result.cells.data["stress"].shape == (16, 6)
    for name in ("velocity", "stress_xx", "middle", "energy"):
        figure = result.plot(name, tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
        assert not misplaced(figure), name
    said = " ".join(text for text, _ in words(result.plot("middle")))
    assert all(unit in said for unit in ("Pa]", "m/s]", "m]", "time [s]"))
    assert "energy [mJ/m]" in " ".join(text for text, _ in words(result.plot("energy")))
    with pytest.raises(OutputError, match="no field 'heat' in the frame"):
        result.plot("heat")


def test_curves_of_history_and_probes_have_their_units_and_the_other_as_axis(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A load-displacement curve, of a probe against another that records less often, and columns over time."""
    entries = [scenes.held("-x", 2), {"body": "b", "face": "+x", "name": "push", "displacement": {"x": "-0.01*t"}}]
    probes = [
        {"name": "load", "of": "push", "fields": ["force", "work"], "every": 3},
        {"name": "end", "at": [[1.0, 0.5]], "fields": ["displacement"], "every": 7},
    ]
    made = scenes.scene(
        scenes.body(scenes.cube(2), 0.25), run={"end": 2.0, "cfl": 0.3}, boundary=entries, probes=probes
    )
    result, drawn = wsph.run(made, tmp_path / "out"), []
    monkeypatch.setattr(tables, "save_figure", lambda figure, path: drawn.append((figure, path)))

    def view(*options: str) -> Any:
        assert main(["view", str(tmp_path / "out"), *options, "--save", "curve.png"]) == 0
        return drawn.pop()[0]

    curve = view("--curve=-load.force_x", "--against=-end.displacement_x")
    line = curve.axes[0].lines[0]
    load = result.probes["load"]
    # Shown in millinewtons per metre and in millimetres.
    assert line.get_ydata() == pytest.approx(-1e3 * load["force_x"], rel=1e-12)
    assert line.get_xdata() == pytest.approx(10.0 * load["time"], rel=1e-2, abs=1e-9)
    said = " ".join(text for text, _ in words(curve))
    assert "−load.force_x [mN/m]" in said
    assert "−end.displacement_x [mm]" in said
    said = " ".join(text for text, _ in words(view("--curve", "reaction_b-1_x,work_push,load")))
    assert all(each in said for each in ("reaction_b-1_x", "work_push", "force_y", "[mN/m]", "J/m]", "time [s]"))
    for options, message in (
        (["--curve", "reaction_c"], "no column 'reaction_c'; there is step, time, dt, kinetic"),
        (["--curve", "load.force_z"], "end.displacement_x"),
        (["--curve", "load", "--against", "end"], "--against names one column: end has displacement_x, displacement_y"),
    ):
        assert main(["view", str(tmp_path / "out"), *options, "--save", "curve.png"]) == 2
        assert message in capsys.readouterr().err
    assert main(["view", str(tmp_path / "out"), "--curve", "load"]) == 2


def test_a_frame_without_names_is_drawn(tmp_path: Path) -> None:
    """Frames that know nothing of bodies, cells and units."""
    OutputFolder(tmp_path, ("vtu",)).frame(0.0, np.random.default_rng(0).random((9, 2)), {"velocity": np.ones((9, 2))})
    assert main(["view", str(tmp_path), "--save", str(tmp_path / "a.png")]) == 0


def test_a_window_to_turn_bodies_in(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As far as it goes without a screen; and without one it is refused."""
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(sys.modules["pyvista"], "OFF_SCREEN", True)
    assert main(["view", str(run), "--field", "stress_xx", "--mesh"]) == 0
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    assert main(["view", str(run)]) == 2
    assert "there is no display" in capsys.readouterr().err


def test_without_a_name_the_first_field_is_drawn_that_there_is() -> None:
    places = np.eye(3)
    assert (
        scalar(shot({"position": places, "damage": np.zeros(3), "stress": np.ones((3, 6))}, 0.0), "").name == "damage"
    )
    assert scalar(shot({"position": places, "damage": np.zeros(3), "velocity": places}, 0.0), "").name == "|velocity|"
