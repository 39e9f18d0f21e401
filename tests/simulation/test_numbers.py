"""Numbers that people read off: columns, units, probes `of` what has them, at every cadence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp

import wsph
from tests.scenes import body, box, held, scene
from wsph.backend.clock import Clock
from wsph.errors import SceneError
from wsph.reporting import Term
from wsph.scene.probes import Probe
from wsph.simulation.probing.numbers import NumberRecorder, Numbers, column, components, unit
from wsph.units import Scales


@dataclass
class Said:
    """Something with numbers."""

    name: str
    kind: str
    numbers: Mapping[str, Sequence[Term]]
    gathered: int = 0

    def gather(self) -> None:
        self.gathered += 1


def floats(values: Any) -> wp.array:
    return wp.array(values, dtype=wp.float64, device="cpu")


def test_columns_are_named_as_they_are_for_every_kind() -> None:
    def names(kind: str, dim: int) -> list[str]:
        numbers = [number for field in ("force", "torque", "work") for number in components(field, dim)]
        return [column(Said("a", kind, {}), number) for number in numbers]

    assert names("reaction", 1) == ["reaction_a_x", "work_a"]
    assert names("contact", 2) == ["contact_a_x", "contact_a_y", "contact_a_torque", "contact_a_work"]
    assert names("tool", 3)[3:] == ["tool_a_torque_x", "tool_a_torque_y", "tool_a_torque_z", "tool_a_work"]
    assert names("section", 2)[2] == "section_a_moment"
    assert names("section", 3)[3] == "section_a_moment_x"
    assert [unit("force_x", dim) for dim in (1, 2, 3)] == ["N/m2", "N/m", "N"]
    assert [unit("torque", dim) for dim in (2, 3)] == ["N", "N m"]


def test_a_number_is_the_sum_of_its_terms_in_si_on_the_host_and_in_a_probe() -> None:
    """Strides, factors, several arrays and several terms in one; scales of a force and of a work differ by a length."""
    table, other = floats([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]]), floats([7.0, 8.0])
    said = Said(
        "a",
        "tool",
        {
            "force_x": [Term(table, 1, 3, 2), Term(table, 0, 1, 1, -2.0), Term(other, 1)],
            "force_y": [],
            "torque": [Term(other)],
            "work": [Term(other, 0, 2, 1, 0.5)],
        },
    )
    scales = Scales(2.0, 0.5, 3.0)
    stress = 3.0 * 16.0
    wanted = {"force_x": 66.0 * stress * 2.0, "force_y": 0.0, "torque": 7.0 * stress * 4.0, "work": 7.5 * stress * 4.0}
    found = Numbers([said], scales, 2)
    assert found.values() == pytest.approx(list(wanted.values()), rel=1e-15)
    assert list(found.units.items()) == [("tool_a_x", "N/m"), ("tool_a_y", "N/m"), ("tool_a_torque", "N"), ("tool_a_work", "J/m")]  # fmt: skip
    probe = Probe(name="p", of="a", fields=["work", "torque", "force"])
    recorder = NumberRecorder(probe, "probes.0", [said], scales, Clock(1.0, "cpu"), 2, True)
    recorder.record()
    recorder.flush([0])
    columns = recorder.columns()
    assert list(columns) == ["work", "torque", "force_x", "force_y"]
    assert {name: float(values[0]) for name, values in columns.items()} == pytest.approx(wanted, rel=1e-15)
    assert said.gathered == 2


def pulled(**keys: Any) -> wsph.Scene:
    entries = [
        held("-x", 2),
        {"body": "b", "face": "+x", "name": "pull", "traction": {"x": "1e-3*sin(5*t)", "y": 2e-4}},
    ]
    planes = [{"name": "cut", "body": "b", "point": [0.5, 0.2], "normal": [1.0, 0.0]}]
    probes = [
        {"name": "held", "of": "b-1", "fields": ["force"], "every": 1},
        {"name": "pulled", "of": "pull", "fields": ["work", "force"], "every": 7},
        {"name": "cut", "of": "cut", "fields": ["force", "torque"], "every": 1},
        {"name": "seldom", "of": "cut", "fields": ["torque"], "every": 0.4},
    ]
    run = {"end": 2.0, "cfl": 0.3, "formulation": "stress-points"}
    given = {"boundary": entries, "sections": planes, "probes": probes, "output": {"history": 1}} | keys
    return scene(body(box(1.0, 0.4), 0.1), run=run, **given)


def test_probes_record_at_every_cadence_what_the_history_has() -> None:
    result = wsph.run(pulled())
    history, steps = result.history, result.history["step"]
    assert list(result.probes["held"]) == ["time", "force_x", "force_y"]
    for axis in "xy":
        assert np.array_equal(result.probes["held"][f"force_{axis}"], history[f"reaction_b-1_{axis}"])
        assert np.array_equal(result.probes["cut"][f"force_{axis}"], history[f"section_cut_{axis}"])
    assert np.array_equal(result.probes["cut"]["torque"], history["section_cut_moment"])
    seventh = [*range(0, steps[-1], 7), steps[-1]]
    assert np.array_equal(result.probes["pulled"]["work"], history["work_pull"][seventh])
    times = result.probes["seldom"]["time"]
    assert len(times) == 6
    assert np.array_equal(
        result.probes["seldom"]["torque"], history["section_cut_moment"][np.isin(history["time"], times)]
    )
    units = result.summary["units"]
    assert units["probes"]["cut"] == {"time": "s", "force_x": "N/m", "force_y": "N/m", "torque": "N"}
    assert units["history"]["work_pull"] == "J/m"
    assert units["history"]["momentum_x"] == "N s/m"
    assert list(units["history"]) == list(history)


def test_a_run_that_records_them_has_the_bits_of_one_that_does_not() -> None:
    whole, bare = wsph.run(pulled()), wsph.run(pulled(probes=[], sections=[]))
    for name in ("velocity", "stress"):
        assert np.array_equal(whole.particles[name], bare.particles[name])


def test_a_resumed_run_has_the_same_bits(tmp_path: Path) -> None:
    made = pulled(checkpoint={"every": 5})
    straight = wsph.run(made)
    wsph.run(made.with_(end=1.0), tmp_path / "cut")
    resumed = wsph.run(made, tmp_path / "cut", resume=True)
    for name, columns in straight.probes.items():
        for key, values in columns.items():
            assert np.array_equal(values, resumed.probes[name][key]), (name, key)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"of": "pul"}, "probes.0.of: nothing that has numbers is named 'pul'; did you mean 'pull'?"),
        ({"fields": ["torque"]}, "probes.0.fields.0: 'pull' has no torque: it has force, work"),
        ({"fields": ["stress"]}, "probes.0: of 'pull' fields are force, torque, work: 'stress' is none of"),
        ({"where": "x > 0", "reduce": "mean"}, "probes.0: exactly one of at, line, where and of is needed"),
        ({"body": "b"}, "probes.0: body goes with at, line and where"),
        ({"fields": ["force", "force"]}, "probes.0.fields: 'force' is named twice"),
    ],
)
def test_faults_name_their_keys(changes: dict, message: str) -> None:
    probe = {"name": "p", "of": "pull", "fields": ["force"]} | changes
    with pytest.raises(SceneError, match=message):
        wsph.run(pulled(probes=[probe]))
