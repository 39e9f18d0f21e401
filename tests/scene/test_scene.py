"""Scenes: a fault gives one message with its key, its value and what is right; nothing is composed, nothing written."""

import copy
import re
import tomllib
from pathlib import Path

import pytest
import tomli_w

import wsph
from tests import scenes
from wsph.cli import main
from wsph.errors import SceneError

TEXT = (Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml").read_text()
DATA = tomllib.loads(TEXT)


def changed(change: dict) -> dict:
    """The shock bar with dotted keys changed (None removes)."""
    data = copy.deepcopy(DATA)
    for path, value in change.items():
        *keys, last = path.split(".")
        place = data
        for key in keys:
            place = place[int(key)] if isinstance(place, list) else place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value
    return data


def faults(change: dict) -> list[str]:
    """Its faults then."""
    with pytest.raises(SceneError) as caught:
        wsph.Scene(**changed(change))
    return [str(fault) for fault in caught.value.faults]


ROWS: list[tuple[dict, str]] = [
    ({"schema": 2}, r"^schema: 2 is none of 1"),
    ({"schema": None}, r"^schema: is missing"),
    ({"dim": 4}, r"^dim: 4 is none of 1, 2 or 3"),
    ({"dim": "1"}, r"^dim: '1' is none of 1, 2 or 3"),
    ({"run.integrator": None}, r"^run.integrator: is missing"),
    ({"run.integrator": "tshp"}, r"^run.integrator: no entry named 'tshp' .*did you mean 'tsph'\?"),
    ({"run.end": None}, r"^run.end: is missing"),
    ({"run.end": "10"}, r"^run.end: '10' has no unit: write 10 without quotes"),
    ({"run.end": "10 m"}, r"^run.end: '10 m' is not in units of s"),
    ({"run.end": -1.0}, r"^run.end: -1.0: must be greater than 0$"),
    ({"run.end": float("nan")}, r"^run.end: nan is not a finite number"),
    ({"run.dt": 1e-5}, r"^run: exactly one of cfl and dt is needed: both are given"),
    ({"run.cfl": None}, r"^run: exactly one of cfl and dt is needed: neither is given"),
    ({"run.cfl": 0.0}, r"^run.cfl: 0.0: must be greater than 0$"),
    ({"run.precision": "f16"}, r"^run.precision: 'f16' is none of 'f64' or 'f32'"),
    ({"run.device": "gpu"}, r"^run.device: 'gpu' is no device: write .auto., .cpu., .cuda. or .cuda:1"),
    ({"run.threads": -1}, r"^run.threads: -1: must be greater than or equal to 0$"),
    ({"run.guard": "on"}, r"^run.guard: 'on' is none of 'refuse', 'warn' or 'off'"),
    ({"run.kernel": "cubic"}, r"^run.kernel: 'cubic' is none of 'cubic-spline' or 'wendland-c2'"),
    ({"run.cfll": 1.0}, r"^run.cfll: unknown key; did you mean 'cfl'\?"),
    ({"bodies": []}, r"^bodies: \[\]: .*at least 1 item"),
    ({"bodies.0.name": 3}, r"^bodies.0.name: 3 must be a string"),
    ({"bodies.0.spacing": 0.03}, r"^bodies.0.spacing: 0.03 m does not divide .* nearest that do: 0.0294117647059 m, 0.030303030303 m"),
    ({"bodies.0.spacing": "1 kg"}, r"^bodies.0.spacing: '1 kg' is not in units of m"),
    ({"bodies.0.spacing": -0.01}, r"^bodies.0.spacing: -0.01 is not above zero"),
    ({"bodies.0.state": None}, r'^bodies.0.state: "stress" or "strain" is needed in 1D and 2D'),
    ({"bodies.0.state": "plane"}, r"^bodies.0.state: 'plane' is none of 'stress' or 'strain'"),
    ({"bodies.0.jitter": 0.9}, r"^bodies.0.jitter: 0.9: must be less than or equal to 0.5$"),
    ({"bodies.0.velocity": ["x", "x"]}, r"^bodies.0.velocity: has 2 components in a scene of dim = 1"),
    ({"bodies.0.shape.type": "bx"}, r"^bodies.0.shape.type: 'bx' is none of 'box', .*; did you mean 'box'\?"),
    ({"bodies.0.shape.min": [0.0, 0.0]}, r"^bodies.0.shape: min has 2 coordinates and max 1"),
    ({"bodies.0.shape.max": [-1.0]}, r"^bodies.0.shape: min \[0.0\] must lie below max \[-1.0\]"),
    ({"bodies.0.shape": {"type": "box", "min": [0.0, 0.0], "max": [1.0, 1.0]}}, r"^bodies.0.shape: has 2 coordinates in a scene of dim = 1"),
    ({"bodies.0.material.model": "elastc"}, r"^bodies.0.material.model: no entry named 'elastc' .*did you mean 'elastic'\?"),
    ({"bodies.0.material.model": None}, r"^bodies.0.material.model: is missing"),
    ({"bodies.0.material.density": -2000.0}, r"^bodies.0.material.density: -2000.0 must be above 0 kg/m3"),
    ({"bodies.0.material.density": "2000"}, r"^bodies.0.material.density: '2000' has no unit"),
    ({"bodies.0.material.density": None}, r"^bodies.0.material.density: is missing: elastic needs it \[kg/m3\]"),
    ({"bodies.0.material.poisson_ratio": 0.5}, r"^bodies.0.material.poisson_ratio: 0.5 must be below 0.5"),
    ({"bodies.0.material.youngs_modulus": "80 MPaa"}, r"unknown unit 'MPaa'; did you mean 'MPa'"),
    ({"bodies.0.material.young_modulus": 1.0}, r"^bodies.0.material.young_modulus: unknown key; did you mean 'youngs_modulus'\?"),
    ({"functions.pulse.t": [1.0, 0.5]}, r"^functions.pulse: t must increase"),
    ({"functions.pulse.value": [1.0]}, r"^functions.pulse: t and value must have the same number"),
    ({"functions.pulse.expression": "t"}, r"^functions.pulse: either a table .* or an expression"),
    ({"boundary.0.body": "rod"}, r"^boundary.0.body: no body is named 'rod'; there is bar"),
    ({"boundary.0.face": "-y"}, r"^boundary.0.face: '-y' does not exist in 1D"),
    ({"boundary.0.face": "left"}, r"^boundary.0.face: 'left' is no face; write -x, "),
    ({"boundary.0.where": "x <= 0"}, r"^boundary.0: exactly one of where, face and patch is needed"),
    ({"boundary.0.velocity": {"y": 1.0}}, r"^boundary.0.velocity.y: is none of x"),
    ({"boundary.0.velocity": {"x": "pulze"}}, r"^boundary.0.velocity.x: 'pulze' is no number, quantity \[m/s\], expression or function.*functions: pulse"),
    ({"boundary.0.velocity": {}}, r"^boundary.0: nothing is prescribed"),
    ({"boundary.1.fixed": ["z"]}, r"^boundary.1: 'z' is none of x"),
    ({"probes.0.fields": ["stres_xx"]}, r"^probes.0.fields: no field is named 'stres_xx'; did you mean 'stress_xx'\?"),
    ({"probes.0.fields": []}, r"^probes.0.fields: \[\]: .*at least 1 item"),
    ({"probes.0.at": [[0.5, 0.5]]}, r"^probes.0.at: \[0.5, 0.5\] has 2 coordinates"),
    ({"probes.0.name": "../evil"}, r"^probes.0.name: '../evil': a name has at most 100 of a to z"),
    ({"probes.0.every": 0}, r"^probes.0.every: 0 steps: from 1 to 2\^53 "),
    ({"probes.1.name": "fixed-end"}, r"^probes.1.name: 'fixed-end' names another probe"),
    ({"probes.0.reduce": "max"}, r"^probes.0: reduce .* goes with where"),
    ({"output.formats": ["vtk"]}, r"^output.formats.0: 'vtk' is none of 'vtu', 'vtkhdf', 'xdmf' or 'npz'; did you mean 'vtu'\?"),
    ({"output.every": "-1 ms"}, r"^output.every: '-1 ms' is not above zero"),
    ({"output.fields": ["velocity", "velocity"]}, r"^output.fields: 'velocity' is named twice"),
    ({"boundary.0.where": "x", "boundary.0.face": None}, r"^boundary.0.where: 'x' is no comparison"),
    ({"boundary.0.where": "x < t", "boundary.0.face": None}, r"^boundary.0.where: 'x < t' uses t"),
    ({"boundary.0.where": "z <= 0", "boundary.0.face": None}, r"uses z, which a scene of dim = 1 does not have"),
    ({"boundary.0.velocity": {"x": "2*y"}}, r"^boundary.0.velocity.x: '2\*y' uses y, which a scene of dim = 1"),
    ({"boundary.0.fixed": ["x"]}, r"^boundary.0: 'x' is prescribed twice"),
    ({"functions.t": {"expression": "1"}}, r"^functions.t: 't' is a name of the expressions"),
    ({"bodies.0.velocity": ["pulse"]}, r"^bodies.0.velocity: 'pulse' is a table; an initial velocity is"),
    ({"bodies.0.spacing": 1e-12}, r"^bodies.0.spacing: gives 1e\+12 particles; a 32-bit index has room for 3.36e\+07"),
    ({"bodies.0.material.density": "1e999999 kg/m3"}, r"is not a finite number"),
    ({"bodies.0.material.density": "1 kg99999999"}, r"power beyond 9"),
    ({"run.cfl": "1"}, r"^run.cfl: '1' is a string; this is a plain number: write 1"),
    ({"run.integrator": {"name": "tsph", "stages": 3}}, r"^run.integrator.stages: unknown key; tsph knows no options"),
    ({"dim": 1.0}, r"^dim: 1.0 must be a whole number"),
    ({"boundary": {}}, r"^boundary: must be a list of tables: write \[\[boundary\]\]"),
    ({"probes.1.name": "FIXED-END"}, r"^probes.1.name: 'FIXED-END' names another probe"),
    ({"probes.1.body": "rod"}, r"^probes.1.body: no body is named 'rod'"),
    ({"boundary.0.velocity": {"x": "1 MPa"}}, r"^boundary.0.velocity.x: .*'1 MPa' is not in units of m/s"),
    ({"bodies.0.velocity": [float("nan")]}, r"^bodies.0.velocity.0: nan is not a finite number"),
    ({"bodies.0.velocity": ["t"]}, r"^bodies.0.velocity: .*does not depend on t"),
    ({"functions.pulse.value": ["1 MPa", 0.0]}, r"^boundary.0.velocity.x: .*functions.pulse.value: '1 MPa' is not in units of m/s"),
    ({"functions.pulse.value": ["1", 0.0]}, r"^functions.pulse.value.0: '1' has no unit: write 1 without quotes"),
    ({"functions.pulse.value": ["1 mpa", 0.0]}, r"^functions.pulse.value.0: unknown unit 'mpa'; did you mean 'MPa'"),
    ({"run.cfl": "1 mm"}, r"^run.cfl: '1 mm' is a string; this is a plain number: write 0.001, in m$"),
    ({"bodies.0.jitter": "0.1 MPa"}, r"^bodies.0.jitter: '0.1 MPa' is a string; this is a plain number: write 100000, in Pa$"),
    ({"bodies.0.name": ""}, r"^bodies.0.name: '' has .*: a name has printed characters"),
    ({"bodies.0.shape": {"min": [0.0], "max": [1.0]}}, r"^bodies.0.shape.type: is missing"),
    ({"bodies.0.shape.mni": 1}, r"^bodies.0.shape.mni: unknown key; did you mean 'min'"),
    ({"bodies.0.shape": {"type": "union", "shapes": [{"type": "box", "min": [0.0], "max": [1.0]}, {"type": "box", "min": [1.0], "max": [2.0], "mxa": 1}]}}, r"^bodies.0.shape.shapes.1.mxa: unknown key; did you mean 'max'"),
    ({"bodies.0.shape": {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}}, r"^bodies.0.shape: has 2 coordinates in a scene of dim = 1"),
    ({"bodies.0.shape": {"type": "disc", "center": [0.0], "radius": 1.0}}, r"^bodies.0.shape: a disc is of 2 dimensions; \[0.0\] has 1 coordinates"),
    ({"bodies.0.shape": {"type": "difference", "shapes": [{"type": "box", "min": [0.0], "max": [1.0]}, {"type": "box", "min": [0.3], "max": [0.2]}]}}, r"^bodies.0.shape.shapes.1: min \[0.3\] must lie below"),
    ({"bodies.0.shape.rotate": 30.0}, r"^bodies.0.shape.rotate: a rotation has no place in 1D"),
    ({"bodies.0.spacing": [0.1, 0.1]}, r"^bodies.0.spacing: \[0.1, 0.1\] has 2 numbers in 1D"),
    ({"bodies.0.cracks": [{"from": [0.5], "to": [0.6]}]}, r"^bodies.0.cracks.0: a crack needs 2D or 3D"),
    ({"gravity": {"y": -9.81}}, r"^gravity.y: is none of x"),
    ({"bodies.0.damping": {"rate": "-1 1/s"}}, r"^bodies.0.damping.rate: '-1 1/s': must be greater than or equal to 0$"),
    ({"self": 1}, r"^self: unknown key; known: schema, title, dim, run, "),
    ({"output.fields": ["velocty"]}, r"^output.fields: no field is named 'velocty'; did you mean 'velocity'\?"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), ROWS, ids=lambda v: ",".join(v) if isinstance(v, dict) else "")
def test_one_fault_gives_one_message(change: dict, message: str) -> None:
    found = faults(change)
    assert len(found) == 1, found
    assert re.search(message, found[0]), found[0]


@pytest.mark.parametrize(("change", "message"), ROWS, ids=lambda v: ",".join(v) if isinstance(v, dict) else "")
def test_from_the_shell_it_is_exit_2_and_nothing_is_composed_or_written(
    change: dict, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wsph.simulation.run.compose", lambda scene: pytest.fail("composed"))
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(changed(change)))
    assert main(["run", str(path), "-o", str(tmp_path / "out")]) == 2
    (said,) = capsys.readouterr().err.strip().splitlines()
    assert said.removeprefix("error: ").startswith(f"{path}: "), said
    assert re.search(message.removeprefix("^"), said), said
    assert [p.name for p in tmp_path.iterdir()] == ["scene.toml"]


def test_the_python_api_takes_the_same_keys_and_gives_them_back() -> None:
    scene = wsph.Scene(**copy.deepcopy(DATA))
    again = wsph.Scene(**scene.data())
    assert again == scene
    assert scene.with_(cfl=0.5).run.cfl == 0.5
    assert scene.with_(dt=1e-5).run.cfl is None
    assert scene.with_(**{"bodies.0.spacing": 0.02}).bodies[0].spacing == 0.02
    assert scene.bodies[0].spacing == 0.01
    with pytest.raises(SceneError, match="there is no entry '7'"):
        scene.with_(**{"bodies.7.spacing": 0.02})
    with pytest.raises(SceneError, match="run.speling: unknown key; known: integrator, end, "):
        scene.with_(speling=1)


def test_unknown_keys_do_not_hide_faults_between_tables() -> None:
    found = faults({"run.cfll": 1.0, "boundary.0.body": "rod"})
    assert len(found) == 2
    assert any("run.cfll" in f for f in found)
    assert any("no body is named 'rod'" in f for f in found)


@pytest.mark.parametrize(
    ("path", "entry"),
    [("dim.x.y", "x"), ("bodies.x.spacing", "x"), ("bodies.7.spacing", "7"), ("bodies.0.shape.min.5", "5")],
)
def test_overrides_that_lead_nowhere(path: str, entry: str) -> None:
    with pytest.raises(SceneError, match=f"{path}: there is no entry '{entry}'"):
        wsph.Scene(**copy.deepcopy(DATA)).with_(**{path: 1})


@pytest.mark.parametrize(
    ("spacing", "lengths"), [({"cells": 40}, 0.05), ({"cells": [20, 5]}, (0.1, 0.2)), ("50 mm", 0.05)], ids=str
)
def test_a_spacing_may_count_cells(spacing: object, lengths: object) -> None:
    """Across the longest edge, or along every axis."""
    block = scenes.body(scenes.box(2.0, 1.0), 1.0) | {"spacing": spacing}
    assert scenes.scene(block).bodies[0].spacing == pytest.approx(lengths, rel=1e-14)


@pytest.mark.parametrize(
    "spacing",
    [{"cells": 0}, {"cells": 2.5}, {"cells": [1, 2, 3]}, {"cell": 3}, {"cells": True}, {"cells": "4"}],
    ids=str,
)
def test_cells_that_count_nothing_are_refused_by_name(spacing: object) -> None:
    block = scenes.body(scenes.box(2.0, 1.0), 1.0) | {"spacing": spacing}
    with pytest.raises(SceneError, match=r"bodies.0.spacing: .*cells"):
        scenes.scene(block)
