"""The limit of a time step between measurements: what following it costs, that estimates hold, and what they catch."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.stability.shares import share
from wsph.simulation.compose import compose
from wsph.stability.limit import MOST_UNSURE, UNSURE
from wsph.stability.margins import HELD
from wsph.validation.case import example


def block(form: str, model: str, velocity: list[str], *, dim: int = 2, cells: int = 8, **run: Any) -> wsph.Scene:
    """A free block that vibrates with strains of tens of per cent."""
    return scenes.block(
        dim, cells, model=model, velocity=velocity, run={"formulation": form, "cfl": 0.3, "end": 20.0} | run
    )


def column(speed: float, **run: Any) -> wsph.Scene:
    """The twisting column with four cells across, at `speed` times its speed."""
    w = 105.0 * speed
    velocity = [f"-{w}*sin(pi*z/12)*y", f"{w}*sin(pi*z/12)*x", "0"]
    return example("twisting_column").with_(
        **{"bodies.0.spacing": 0.25, "bodies.0.velocity": velocity, "probes": [], **run}
    )


def squeezed(**run: Any) -> wsph.Scene:
    """A block of a law that stiffens, compressed to a half of its length within a hundred steps."""
    ends = [scenes.held("-x", 2), scenes.driven("+x", x=-0.1)]
    keys = {"formulation": "stress-points", "end": 5.0} | run
    return scenes.block(2, 16, model="neo-hookean", run=keys, tables={"boundary": ends}, velocity=["-0.1*x", "0"])


WAVES = ["0.4*sin(3*x)", "0"]

RUNS = {
    "the column": column(1.0),
    "the column, close to the limit": column(1.0, cfl="auto"),
    "the column at twice its speed": column(2.0),
    "the column at four times its speed": column(4.0),
    "elastic": block("stress-points", "elastic", WAVES),
    "close to the limit": block("stress-points", "neo-hookean", WAVES, cfl="auto", end=60.0),
    "along edges": block("total-lagrangian", "neo-hookean", WAVES),
    "by rates": block("stress-points", "jaumann", WAVES),
    "pairs that follow": block("updated-lagrangian", "jaumann", ["0.1*sin(3*x)", "0"], cfl=0.2),
    "four stages": block("total-lagrangian", "elastic", WAVES, integrator="rk4", cfl=0.9),
    "a fixed step": block("stress-points", "elastic", WAVES, cfl=None, dt=0.05),
    "viscosity": scenes.block(2, 8, model="neo-hookean", velocity=WAVES, viscosity={"alpha": 0.3, "kind": "pair"},
                              run={"formulation": "total-lagrangian", "cfl": 0.2, "end": 40.0}),
}  # fmt: skip


@pytest.mark.parametrize("which", RUNS)
def test_it_takes_five_per_cent_of_the_right_hand_sides_at_most(which: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = share(RUNS[which])
    assert found.result is not None
    assert found.result.status == "completed", found.result.reason
    assert found.evaluations <= 0.05, (found.measured, found.steps)


LAWS = [
    ("stress-points", "elastic", 2, ["0.5*sin(3*x)", "0"]),
    ("stress-points", "neo-hookean", 2, ["-.4*x", "-.4*y"]),
    ("stress-points", "neo-hookean", 3, ["-.3*x", "0.1*z", "-.3*y"]),
    ("stress-points", "jaumann", 2, ["-0.5*sin(3*x)", "0"]),
    ("total-lagrangian", "elastic", 2, ["0.4*y", "0"]),
    ("total-lagrangian", "neo-hookean", 2, ["0.5*sin(3*x)", "0"]),
    ("total-lagrangian", "jaumann", 2, ["-.4*x", "-.4*y"]),
    ("updated-lagrangian", "jaumann", 2, ["0.3*x", "0"]),
    ("stress-points", "elastic", 1, ["-0.3*x"]),
]


@pytest.mark.parametrize(("form", "model", "dim", "velocity"), LAWS, ids=str)
def test_estimates_are_below_what_is_measured(form: str, model: str, dim: int, velocity: list[str]) -> None:
    """To the part that a limit itself leaves (2 %), and no more than a third below it."""
    scene = block(form, model, velocity, dim=dim, cells=6 if dim == 3 else 8, guard="off", cfl=0.2)
    composition = compose(scene)
    composition.compile()
    run = composition.bodies[0]
    stability, first = run.stability, run.limit
    assert first is not None
    composition.program.prepare(15)
    most = 1.0
    for _ in range(8):
        composition.program.run(15)
        composition.publish()
        distortion = run.diagnostics.measure(run.system.state).distortion
        growth = stability.estimate()
        estimate = first / growth * np.exp(-min(UNSURE * np.log(distortion), MOST_UNSURE))
        run.system.forget_motions()
        stability.measure()
        assert run.limit is not None
        assert HELD * estimate <= run.limit <= 1.5 * estimate
        most = max(most, distortion)
    assert most > 1.08


class TestSuddenCompression:
    """The limit falls to a half within a hundred steps."""

    def test_without_a_guard_it_ends_badly(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            off = wsph.run(squeezed(dt=self.step(), guard="off"), throw=False)
        assert (
            off.status != "completed"
            or off.summary["energy"]["residual"] < -0.02 * off.summary["energy"]["external_work"]
        )

    def test_a_fixed_step_is_stopped(self) -> None:
        with pytest.raises(
            wsph.Unstable, match="stability limit has fallen below its Courant number by deformation"
        ) as caught:
            wsph.run(squeezed(dt=self.step()).with_(output={"history": 10}))
        assert caught.value.time < 3.0

    def test_a_step_that_adapts_is_shortened_in_time(self) -> None:
        result = wsph.run(squeezed(cfl="auto").with_(output={"history": 10}))
        assert result.history["dt"][-1] < 0.7 * result.history["dt"][0]
        energy = result.summary["energy"]
        assert abs(energy["residual"]) < 2e-3 * abs(energy["external_work"])

    @staticmethod
    def step() -> float:
        """A step of 0.9 of the limit at the start."""
        run = compose(squeezed(cfl="auto")).bodies[0]
        return 0.9 / 0.95 * run.time_step.dt


@pytest.mark.parametrize("which", ["estimated", "measured again"])
def test_a_run_resumes_to_the_same_bits(which: str, tmp_path: Path) -> None:
    whole, end = (squeezed(cfl="auto"), 3.0) if which == "estimated" else (column(4.0), 0.12)
    whole = whole.with_(output={"history": 10}, checkpoint={"every": 50})
    straight = wsph.run(whole)
    wsph.run(whole.with_(end=end), tmp_path / "out")
    resumed = wsph.run(whole, tmp_path / "out", resume=True)
    for name, values in straight.history.items():
        np.testing.assert_array_equal(resumed.history[name], values)
    for name, values in straight.particles.items():
        np.testing.assert_array_equal(resumed.particles[name], values)
