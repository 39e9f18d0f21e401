"""Typical mistakes of a newcomer: each has a message with the way out, before a kernel of the run is compiled."""

import re
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from spoilt_scenes import BEAM, YIELDING, spoilt

import wsph
from wsph.errors import WsphError

Mistake = tuple[dict[str, Any], str]

REFUSED: dict[str, Mistake] = {
    "a key that is misspelt": ({"bodies.0.spcing": 0.001}, r"bodies.0.spcing: unknown key; did you mean 'spacing'"),
    "a table that is misspelt": ({"boundry": []}, r"boundry: unknown key; did you mean 'boundary'"),
    "a model that is misspelt": ({"bodies.0.material.model": "elastc"}, r"no entry named 'elastc'.*did you mean 'elastic'"),
    "an integrator that there is not": ({"run.integrator": "verlet"}, r"no entry named 'verlet' in wsph.integrators.*Installed"),
    "a number in quotes without a unit": ({"bodies.0.spacing": "0.001"}, r"has no unit: write 0.001 without quotes"),
    "a unit in small letters": ({"bodies.0.material.youngs_modulus": "210 gpa"}, r"unknown unit 'gpa'; did you mean 'GPa'"),
    "a force for a stress": ({"boundary.1.traction": {"y": "2 kN"}}, r"not in units of Pa: a force is spread over an area, as in N/mm2"),
    "milliseconds for a velocity": ({"boundary.1": {"body": "beam", "face": "+x", "velocity": {"y": "5 ms"}}}, r"a velocity is in m/s"),
    "a mass for a density": ({"bodies.0.material.density": "7.85 g"}, r"a density is a mass per volume, as in g/cm3"),
    "a temperature in C": ({"bodies.0.initial": {"stress": {"xx": "20 C"}}}, r"unknown unit 'C'; did you mean 'degC'"),
    "a negative density": ({"bodies.0.material.density": -1.0}, r"-1.0 must be above 0 kg/m3"),
    "an incompressible material": ({"bodies.0.material.poisson_ratio": 0.5}, r"must be below 0.5"),
    "a Poisson ratio in per cent": ({"bodies.0.material.poisson_ratio": 30.0}, r"must be below 0.5"),
    "a field of a material left out": ({"bodies.0.material.density": None}, r"density: is missing: elastic needs it \[kg/m3\]"),
    "a spacing that does not divide": ({"bodies.0.spacing": 0.003}, r"the nearest that do: 0.0025 m, 0.00333333333333 m"),
    "cfl and dt": ({"run.dt": 1e-8}, r"exactly one of cfl and dt is needed: both are given"),
    "a step beyond the limit": ({"run.cfl": 5.0}, r"beyond its stability limit .*use run.cfl <="),
    "a face of another dimension": ({"boundary.0.face": "-z"}, r"'-z' does not exist in 2D"),
    "a face without a sign": ({"boundary.0.face": "x"}, r"'x' is no face; write -x, \+x"),
    "a place where nothing is": ({"boundary.0": {"body": "beam", "where": "x < -1", "fixed": ["x"]}}, r"selects no particle"),
    "a place along one axis where nothing is": ({"boundary.0": {"body": "beam", "where": "x < -1", "fixed": ["x"]}}, r"selects no particle of 'beam', whose particles have x from 0 to 0.05 m$"),
    "a force per volume where nothing is": ({"bodies.0.body_force": {"where": "x + y > 1", "x": 1.0}}, r"body_force.0.where: 'x \+ y > 1' selects no particle: they have x from 0 to 0.05 m, y from 0 to 0.01 m$"),
    "the signs of C": ({"boundary.0": {"body": "beam", "where": "x < 0.01 && y > 0", "fixed": ["x"]}}, r"boundary.0.where: cannot read the expression .*; write and for &&"),
    "a sign of C for or": ({"boundary.0": {"body": "beam", "where": "(x < 0.01) || !(y > 0)", "fixed": ["x"]}}, r"; write or for \|\|; write not for !"),
    "the signs of numpy": ({"boundary.0": {"body": "beam", "where": "(x < 0.01) & (y > 0)", "fixed": ["x"]}}, r"is not arithmetic over x, y, z, t; write and for &"),
    "a product of comparisons": ({"boundary.0": {"body": "beam", "where": "(x < 0.01)*(y > 0)", "fixed": ["x"]}}, r'is no comparison; write one, as in "x <= 0.1", or several, as in "x <= 0.1 and y > 0"'),
    "a probe at one point": ({"probes.0.at": [0.05, 0.005]}, r"probes.0.at: \[0.05, 0.005\] is one point, and at is a list of them: write at = \[\[0.05, 0.005\]\]"),
    "a probe at one point with units": ({"probes.0.at": ["50 mm", "5 mm"]}, r'write at = \[\["50 mm", "5 mm"\]\]'),
    "an assignment for a comparison": ({"boundary.0": {"body": "beam", "where": "x = 0", "fixed": ["x"]}}, r"write =="),
    "a name of Python's": ({"boundary.1.traction": {"y": "1e6*math.sin(t)"}}, r"math.sin"),
    "a probe outside": ({"probes.0.at": [[0.5, 0.005]]}, r"does not lie in one body; 'beam' reaches from"),
    "a field that is misspelt": ({"probes.0.fields": ["displacment"]}, r"no field is named 'displacment'; did you mean 'displacement'"),
    "a body that is misspelt": ({"boundary.0.body": "bean"}, r"no body is named 'bean'; did you mean 'beam'"),
    "a function that is misspelt": ({"boundary.1.traction": {"y": "psh"}}, r"functions: push"),
    "a table of another unit": ({"functions.push.value": ["0 mm", "-2 mm"]}, r"boundary.1.traction.y: .*functions.push.value: '0 mm' is not in units of Pa"),
    "a table of two units": ({"functions.push.value": ["0 MPa", "-2 mm"]}, r"functions.push.value: '-2 mm' is not in units of Pa"),
    "an angle in radians": ({"bodies.0.shape.rotate": "0.5 rad"}, r"an angle is a plain number, in degrees: write 28.6478"),
    "an angle with its unit": ({"bodies.0.shape.rotate": "30 deg"}, r"an angle is a plain number, in degrees: write 30$"),
    "the state of 2D left out": ({"bodies.0.state": None}, r'"stress" or "strain" is needed in 1D and 2D'),
    "a shape of another dimension": ({"bodies.0.shape.min": [0.0] * 3, "bodies.0.shape.max": [1.0] * 3}, r"has 3 coordinates in a scene of dim = 2"),
    "corners the wrong way round": ({"bodies.0.shape.max": [-0.05, 0.01]}, r"must lie below max"),
    "a list of tables written as a table": ({"boundary": {"body": "beam"}}, r"must be a list of tables: write \[\[boundary\]\]"),
    "nothing prescribed": ({"boundary.0": {"body": "beam", "face": "-x"}}, r"nothing is prescribed: give velocity"),
    "a device that there is not": ({"run.device": "gpu"}, r"'gpu' is no device: write .auto., .cpu., .cuda."),
    "an integrator in a foreign form": ({"run.integrator": "tsph", "run.formulation": "total-lagrangian"}, r"tsph"),
    "contact of bodies that overlap": ({"ball": True, "bodies.1.shape.min": [0.02, 0.0], "bodies.1.shape.max": [0.03, 0.01], "contact": [{"between": ["beam", "ball"]}]}, r"overlap at .*move or shorten one of them"),
}  # fmt: skip

SILENT: dict[str, Mistake] = {
    "a density in g/cm3": ({"bodies.0.material.density": 7.85}, r'faster than in any solid .*"7.85 g/cm3" is 7850 kg/m3'),
    "a modulus in GPa": ({"bodies.0.material.youngs_modulus": 210.0, "run.end": 1.0}, r'slower than in a gel: is it "210 GPa"'),
    "a modulus times a thousand": ({"bodies.0.material.youngs_modulus": 210e12, "run.end": 1e-6}, r"waves of 1\d\d km/s.*is it in MPa"),
    "a yield stress in MPa": ({"bodies.0.material": {**YIELDING, "yield_stress": 350.0}}, r"yield_stress: 350 Pa is 2e-09 of Young's modulus.*MPa"),
    "a yield stress in kPa": ({"bodies.0.material": {**YIELDING, "yield_stress": 350e9}}, r"yield_stress: 3.5e\+11 Pa is above Young's modulus"),
    "an initial velocity in mm/s": ({"bodies.0.velocity": [0.0, -50000.0]}, r"bodies.0.velocity: 5e\+04 m/s is \S+ times the speed of waves"),
    "a prescribed velocity in mm/s": ({"boundary.1": {"body": "beam", "face": "+x", "velocity": {"x": "1e4*t/1e-5"}}}, r"boundary.1.velocity.x: \S+ m/s is \S+ times the speed"),
    "a traction in kPa": ({"functions.push.value": [0.0, -2e12]}, r"boundary.1.traction.y: 2e\+12 Pa is 9.52 times Young's modulus"),
    "a force in mN": ({"boundary.1": {"body": "beam", "face": "+x", "force": {"y": 2e10}}, "run.cfl": "auto"}, r"boundary.1.force.y, over its faces: 2e\+12 Pa is 9.52 times Young's modulus"),
    "a pressure in kPa": ({"boundary.1": {"body": "beam", "face": "+x", "pressure": 2e12}, "run.cfl": "auto"}, r"boundary.1.pressure: 2e\+12 Pa"),
    "gravity in mm/s2": ({"gravity": {"y": -9810.0}}, r'gravity.y: 9810 m/s2 is 1e\+03 times .*"9810 mm/s2"'),
    "an end in us": ({"run.end": 20.0}, r"run.end: \S+ steps of \S+ s to the end of 20 s.*is it in ms or us"),
    "a run of one step": ({"run.end": 1e-8}, r"run.end: the run is 1 step of 4.15e-07 s: a wave crosses the body in"),
    "a table in ms": ({"functions.push.t": [1.0, 10.0]}, r"functions.push: is 0 to the end of the run at 2e-05 s"),
    "a table in ms from zero on": ({"functions.push.t": [0.0, 10.0]}, r'functions.push: its table begins to act after the end of the run at 2e-05 s, where it is -4 of -2e\+06.*"10 ms"'),
    "a table in place in ms": ({"functions.push": {"t": [0.0, 10.0], "y": [0.0, 0.01], "value": [[0.0, 0.0], [1e6, 2e6]]}}, r"functions.push: its table begins to act after the end of the run at 2e-05 s: its next"),
    "an end in ms": ({"run.end": 1.5}, r"run.end: 3.\d*e\+06 steps of \S+ s to the end of 1.5 s.*is it in ms or us"),
    "fifteen thousand frames": ({"output": {"every": "0.1 us"}, "run.end": 1.5e-3}, r"output.every: 3.6e\+03 frames are to be written"),
    "a function that nothing names": ({"functions.pull": {"t": [0.0, 1.0], "value": [0.0, 1.0]}}, r"functions.pull: nothing names it"),
    "no contact": ({"ball": True}, r"bodies 'beam' and 'ball' meet on their ways and nothing acts between them.*\[\[contact\]\]"),
    "bodies that overlap": ({"ball": True, "bodies.1.shape.min": [0.02, 0.0], "bodies.1.shape.max": [0.03, 0.01]}, r"overlap at .*nothing acts between them"),
    "nothing that moves": ({"boundary.1": None, "functions": {}}, r"nothing moves: no body has a velocity"),
    "a whole force on the face that is held, at first": ({"boundary.0.steps": ["one"], "steps": [{"name": "one", "duration": "10 us"}, {"name": "two", "duration": "10 us"}], "run.end": None, "boundary.1": {"body": "beam", "face": "-x", "force": {"y": 1e3}}}, r"boundary.1.force.y: pulls at particles that boundary.0 holds"),
    "a load on the face that is held": ({"boundary.1.face": "-x"}, r"boundary.1.traction.y: pulls at particles that boundary.0 holds"),
    "a body that is held throughout": ({"boundary.0": {"body": "beam", "where": "x >= 0", "fixed": ["x", "y"]}}, r"selects every particle of body 'beam'"),
    "frames of nothing between": ({"output": {"fields": ["stress"]}}, r"output.fields: frames are those of the start and the end alone, as output.every is not given"),
    "a probe of every second": ({"probes.0.every": "1 s"}, r"probes.0.every: 1 s is longer than the run"),
    "frames in every step": ({"output": {"every": 1}, "run.end": 2e-2}, r"output.every: \S+ frames are to be written"),
}  # fmt: skip


def test_there_are_forty_and_twenty_that_were_silent() -> None:
    assert len(REFUSED) + len(SILENT) >= 40
    assert len(SILENT) >= 20


@pytest.mark.parametrize("mistake", list(REFUSED))
def test_a_mistake_is_refused_with_the_way_out(mistake: str) -> None:
    changes, message = REFUSED[mistake]
    with pytest.raises(WsphError, match=message):
        wsph.compose(wsph.Scene(**spoilt(changes)))


def said(data: dict[str, Any]) -> list[str]:
    """What is said of a scene before it runs."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wsph.compose(wsph.Scene(**data))
    return [str(each.message) for each in caught if "spurious modes" not in str(each.message)]


def test_of_the_scene_that_is_right_nothing_is_said() -> None:
    assert said(BEAM) == []


@pytest.mark.parametrize("mistake", list(SILENT))
def test_a_mistake_that_a_scene_may_have_is_said(mistake: str) -> None:
    changes, message = SILENT[mistake]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wsph.compose(wsph.Scene(**spoilt(changes)))
    found = [str(each.message) for each in caught if "spurious modes" not in str(each.message)]
    assert any(re.search(message, each) for each in found), found
    assert len(found) <= 2, found


def test_contact_that_never_comes_to_be_is_said_at_the_end() -> None:
    data = spoilt(
        {"ball": True, "run.cfl": "auto", "bodies.1.velocity": [0.0, 1.0], "contact": [{"between": ["beam", "ball"]}]}
    )
    with pytest.warns(
        RuntimeWarning, match="contact 'beam-ball' had no force in any of the 1?[0-9]+ rows of the history"
    ):
        wsph.run(wsph.Scene(**data))


def test_a_slip_is_said_before_the_step_that_it_makes_too_long_is_refused() -> None:
    scene = wsph.Scene(**spoilt({"boundary.1": {"body": "beam", "face": "+x", "pressure": 2e12}}))
    with pytest.raises(wsph.Refused, match="beyond its stability limit"), pytest.warns(RuntimeWarning, match="boundary.1.pressure: 2e"):  # fmt: skip
        wsph.compose(scene)
