"""Energy that holds spurious modes: warned of by name, found in the summary, and silent where it is small or near rest."""

import json
import warnings
from pathlib import Path

import pytest
import tomli_w

import wsph
from tests import scenes
from tests.scenes import Data, body, box, held, scene
from wsph.cli import main
from wsph.simulation.checks import HELD_FLOOR, HELD_WARNING, Held

SAID = r"step \d+: control of spurious modes .* % of the internal energy of body 'b': .* finer spacing, or another"


def bent(rows: int, formulation: str = "stress-points", **keys: Data) -> wsph.Scene:
    """A cantilever that is thrown upwards at its end. Of one row of cells its points see no bending at all."""
    beam = body(box(1.0, 0.1), 0.1 / rows, velocity=["0", "1e-3*x*x"], **keys)
    return scene(beam, run={"formulation": formulation, "end": 3.0}, boundary=[held("-x", 2)])


def test_a_bent_row_of_cells_is_warned_of_once_and_found() -> None:
    with pytest.warns(RuntimeWarning, match=SAID) as seen:
        result = wsph.run(bent(1))
    assert len([each for each in seen if "spurious" in str(each.message)]) == 1
    (finding,) = result.summary["findings"]
    part = float(finding.partition(" has ")[2].partition(" %")[0]) / 100.0
    energy = result.summary["energy"]
    assert part > 0.9 * energy["hourglass"] / (energy["hourglass"] + energy["strain"]) > HELD_WARNING


@pytest.mark.parametrize(("formulation", "keys"), [
    ("stress-points", {}), ("total-lagrangian", {"placement": "nodes"}), ("total-lagrangian", {"residual": False, "hourglass": {"coefficient": 1.0}}),
], ids=str)  # fmt: skip
def test_eight_rows_are_not(formulation: str, keys: Data) -> None:
    assert wsph.run(bent(8, formulation, **keys)).summary["findings"] == []


def test_a_body_that_flies_and_turns_undeformed_is_not() -> None:
    """Its internal energies are roundings of each other."""
    turning = scenes.block(velocity=["1e-3*(1 - y)", "1e-3*x"], run={"end": 0.5, "precision": "f32"})
    assert wsph.run(turning).summary["findings"] == []
    (finding,) = wsph.run(scenes.block(run={"end": 0.5})).summary["findings"]
    assert finding.startswith("unlikely: nothing moves")


def test_the_largest_part_is_of_the_largest_energies_so_far() -> None:
    mine = Held()
    assert mine.look(21, 0.5, 1.5, 0.02) == pytest.approx(0.04)
    # It has sprung back: what is left of the strain energy is no measure.
    assert mine.look(22, 0.01, 1.51, 0.02) == pytest.approx(0.04)
    assert mine.look(23, 2.0, 3.0, 0.02) == pytest.approx(0.01)
    assert (mine.worst, mine.step) == (pytest.approx(0.04), 21)
    assert Held().look(21, 0.0, 1.0, 1e-4) == pytest.approx(1e-4 / HELD_FLOOR)
    assert Held().look(21, 0.0, 0.0, 0.0) == 0.0


def test_what_is_unlikely_is_a_finding_with_its_key(tmp_path: Path) -> None:
    soft = body(box(1.0, 0.1), 0.05, material=scenes.material(density=7850.0, youngs_modulus=210.0))
    made = scene(soft, run={"end": 2.0}, boundary=[held("-x", 2), {"body": "b", "face": "+x", "traction": {"y": 1e3}}])
    found = wsph.run(made, tmp_path / "out", throw=False).summary["findings"]
    assert any("bodies.0.material: a modulus of 210 Pa" in each and "slower than in a gel" in each for each in found)
    assert any("boundary.1.traction.y: 1000 Pa is 4.76 times Young's modulus" in each for each in found)
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["findings"] == found


def test_what_a_run_warns_of_is_a_finding_once_also_after_a_checkpoint(tmp_path: Path) -> None:
    """Beyond the limit of its steps, with energy from nowhere: said of both, whatever filters do with warnings."""
    made = scenes.block(
        velocity=["0.1*x*(1 - x)", "0"],
        run={"integrator": "rk4", "cfl": 1.5, "end": 6.0, "guard": "warn"},
        tables={"stop": {"energy": 1e9}, "checkpoint": {"every": 5}},
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        straight = wsph.run(made, tmp_path / "straight").summary["findings"]
    warned = list(dict.fromkeys(str(each.message) for each in caught))
    assert straight == warned
    assert len(straight) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wsph.run(made.with_(**{"run.end": 5.0}), tmp_path / "cut")
        assert wsph.run(made, tmp_path / "cut", resume=True).summary["findings"] == straight


def test_that_energy_swings_is_said_once_also_after_a_checkpoint(tmp_path: Path) -> None:
    """Short waves near the limit of their steps."""
    made = scenes.block(
        velocity=["0.01*sin(31.4*x)*cos(31.4*y)", "0.01*cos(31.4*x)"],
        run={"formulation": "stress-points", "cfl": 0.62, "end": 4.0},
        tables={"stop": {"energy": 0.05}, "checkpoint": {"every": 5}},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        straight = wsph.run(made, tmp_path / "straight").summary["findings"]
        wsph.run(made.with_(**{"run.end": 3.0}), tmp_path / "cut")
        resumed = wsph.run(made, tmp_path / "cut", resume=True).summary["findings"]
    assert len([each for each in straight if "energy swings" in each]) == 1
    assert resumed == straight


def test_what_is_little_beside_what_comes_later_is_no_finding() -> None:
    """The first node that a ball touches is pushed in by itself; what matters is what the body takes up in the end."""
    mine = Held()
    mine.look(21, 1e-5, 1e-5, 0.5e-5)
    assert mine.found
    mine.look(22, 1.0, 1.0, 1e-3)
    assert not mine.found


def test_a_body_is_measured_by_those_that_strike_it() -> None:
    """What flies at a body that rests is what both will have."""
    soft = {"material": scenes.material("neo-hookean")}
    ball = body({"type": "disc", "center": [0.0, 1.0], "radius": 1.0}, 0.1, "ball", velocity=[0.0, -0.05], **soft)
    plate = body(box((-2.0, 2.0), (-1.0, 0.0)), 0.1, "plate", **soft)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = wsph.run(scene(ball, plate, run={"end": 6.0, "cfl": "auto"}, contact=[{"between": ["ball", "plate"]}]))
    assert result.summary["findings"] == []


def test_findings_outlive_a_checkpoint_and_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = bent(1).with_(checkpoint={"every": 30}, **{"run.cfl": 0.25})
    with pytest.warns(RuntimeWarning, match=SAID):
        straight = wsph.run(made, tmp_path / "straight").summary
    dt = straight["dt"]
    made = wsph.Scene(
        **made.data() | {"run": {"formulation": "stress-points", "integrator": "leapfrog", "end": 3.0, "dt": dt}}
    )
    with pytest.warns(RuntimeWarning, match=SAID):
        wsph.run(made.with_(**{"run.end": 1.5}), tmp_path / "cut")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # it was warned of before
        resumed = wsph.run(made, tmp_path / "cut", resume=True).summary
    assert resumed["findings"] == straight["findings"] != []
    assert json.loads((tmp_path / "cut" / "summary.json").read_text())["findings"] == straight["findings"]
    (tmp_path / "bent.toml").write_text(tomli_w.dumps(made.data()))
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert main(["run", str(tmp_path / "bent.toml"), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    assert f"finding: {straight['findings'][0]}" in said.out
    assert "warning: step" in said.err
