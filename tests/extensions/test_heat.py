"""A part of a body is one file, `heat.py`, and one line of `wsph.parts.table`, in whose place `add_part` stands here."""

import csv
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.extensions.heat import Heat
from tests.extensions.untouched import knowing
from tests.scenes import bar, block, material
from wsph.errors import Refused, SceneError
from wsph.scene.tables import add_part, remove_part

MATTER = {"material": material(density=2.0)}
HEAT = {"conductivity": "0.6 W/m", "specific_heat": 3.0, "initial": "1 + cos(pi*x)"}
KAPPA = 0.6 / (2.0 * 3.0)
RUN = {"formulation": "total-lagrangian"}


@pytest.fixture
def heat() -> Iterator[None]:
    """The line of the table, for one test."""
    add_part(Heat, wsph.Scene)
    yield
    remove_part(Heat, wsph.Scene)


def exact(x: np.ndarray, t: Any) -> np.ndarray:
    """1 + cos(pi x) in a bar of length 1 that no heat leaves: the cosine decays at the rate kappa pi^2."""
    return 1.0 + np.exp(-KAPPA * np.pi**2 * t) * np.cos(np.pi * x)


def rod(cells: int, run: dict[str, Any] | None = None, heat: dict[str, Any] | None = None, **keys: Any) -> wsph.Scene:
    """A bar with heat, at a step of dx^2/(5 kappa): two fifths of the limit where neighbours alone conduct."""
    step = {} if run and "cfl" in run else {"dt": 0.2 / (KAPPA * cells**2)}
    return bar(cells, heat={**HEAT, **(heat or {})}, run={**RUN, **step, **(run or {})}, **MATTER, **keys)


@pytest.mark.usefixtures("heat")
def test_a_cosine_decays_as_the_closed_form_says() -> None:
    """By `rk4`, whose error in time is far below that in space: of second order."""
    tables = {"output": {"fields": ["temperature"]}}
    ends = [wsph.run(rod(cells, {"integrator": "rk4"}, tables=tables)) for cells in (10, 20, 40)]
    errors = [end.error(lambda x, t: exact(x[:, 0], t), "temperature") for end in ends]
    assert errors[-1] < 4e-4
    assert np.log2(np.divide(errors[:-1], errors[1:])).min() > 1.9


@pytest.mark.usefixtures("heat")
def test_frames_and_probes_read_it_by_its_name(tmp_path: Path) -> None:
    tables = {
        "output": {"fields": ["temperature"], "formats": ["npz"], "every": "0.5 s"},
        "probes": [{"name": "near-the-end", "at": [[0.125]], "fields": ["temperature"]}],
    }
    result = wsph.run(rod(20, tables=tables), tmp_path / "out")
    probe = result.probes["near-the-end"]
    np.testing.assert_allclose(probe["temperature"], exact(np.array(0.125), probe["time"]), atol=5e-3)
    first, *_, last = sorted((tmp_path / "out" / "frames").iterdir())
    np.testing.assert_allclose(np.load(first)["temperature"], exact(np.load(first)["position"][:, 0], 0.0), rtol=1e-14)
    assert np.array_equal(np.load(last)["temperature"], result.field("temperature"))
    with open(tmp_path / "out" / "history.csv") as file:
        assert "thermal" in next(csv.reader(file))


@pytest.mark.usefixtures("heat")
def test_its_energy_is_on_the_ledger_and_nothing_else_changes() -> None:
    """rho c times the integral of T is 2 * 3 * 1, and stays that while the bar vibrates as it does without heat."""
    velocity = ["1e-3*cos(pi*x)"]
    with_heat = wsph.run(rod(20, velocity=velocity))
    without = wsph.run(bar(20, run={**RUN, "dt": with_heat.summary["dt"]}, velocity=velocity, **MATTER))
    energy = with_heat.summary["energy"]
    assert energy["thermal"] == pytest.approx(6.0, rel=1e-14)
    assert energy["external_work"] == pytest.approx(6.0 + without.summary["energy"]["external_work"], rel=1e-14)
    assert np.abs(with_heat.history["residual"] - without.history["residual"]).max() < 1e-14 * 6.0
    for column in ("kinetic", "strain", "momentum_x"):
        # With a part at its nodes a body has lists of pairs, and else none: the same but for roundings.
        expected = without.history[column]
        assert (
            np.abs(with_heat.history[column] - expected).max() < 1e-12 * np.abs(without.history["kinetic"]).max() ** 0.5
        )
    assert "thermal" not in without.history


@pytest.mark.usefixtures("heat")
def test_a_step_beyond_its_limit_is_refused_by_name() -> None:
    tables = {"output": {"fields": ["temperature"]}}

    def spread(**run: Any) -> float:
        """The range of the temperature in the end, of a step in it at first."""
        return float(np.ptp(wsph.run(rod(20, run, {"initial": "1 + (x < 0.5)"}, tables=tables)).field("temperature")))

    limit = wsph.compose(rod(20)).bodies[0].longest_steps["heat"]
    told = r"body 'b': a time step of .* s is beyond what heat can take, limit (\S+) s; use run.dt <= (\1);"
    with pytest.raises(Refused, match=told) as refused:
        wsph.compose(rod(20, {"dt": 1.01 * limit}))
    way_out = float(re.search(told, str(refused.value))[2])
    assert way_out == pytest.approx(limit, rel=1e-3)
    assert spread(dt=way_out) < 1.0
    assert wsph.compose(rod(20, {"cfl": "auto"})).dt == pytest.approx(0.95 * limit)
    with pytest.warns(RuntimeWarning, match="what heat can take"):
        assert spread(dt=1.5 * limit, guard="warn") > 1e3


@pytest.mark.usefixtures("heat")
def test_no_heat_crosses_a_crack() -> None:
    cut = block(heat={**HEAT, "initial": "1 + (x < 0.5)"}, cracks=[{"from": [0.5, 0.0], "to": [0.5, 1.0]}],
                run={**RUN, "dt": 2e-3, "end": 0.1}, tables={"output": {"fields": ["temperature"]}})  # fmt: skip
    result = wsph.run(cut)
    assert np.array_equal(result.field("temperature"), np.where(result.particles["position"][:, 0] < 0.5, 2.0, 1.0))


@pytest.mark.usefixtures("heat")
def test_what_it_cannot_do_is_refused() -> None:
    for keys, message in (
        (
            {"run": {"formulation": "stress-points"}},
            "heat is a part of the one-set form total-lagrangian, not of 'stress",
        ),
        ({"run": {"correction": "paper"}}, "ghosts have no temperature"),
        ({"jitter": 0.1}, "heat needs a lattice of one spacing"),
    ):
        with pytest.raises(Refused, match=message):
            wsph.compose(rod(10, **keys))
    with pytest.raises(SceneError, match="bodies.0.heat.initial: an initial temperature does not depend on t"):
        rod(10, heat={"initial": "x*t"})
    with pytest.raises(SceneError, match=r"bodies.0.heat.initial_: unknown key; did you mean 'initial'\?"):
        rod(10, heat={"initial_": 1.0})


def test_without_its_line_nothing_knows_it() -> None:
    with pytest.raises(SceneError, match="bodies.0.heat: unknown key"):
        rod(10)
    assert knowing("viscosity")
    assert not knowing("heat")
