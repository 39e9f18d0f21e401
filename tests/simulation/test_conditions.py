"""Functions that are called at events of a run in steps: conditions in words and as functions, the end, an error."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import wsph

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def bar() -> wsph.Scene:
    """The vibrating bar, an eighth of its period."""
    return wsph.load(EXAMPLES / "vibrating_bar.toml").with_(end="0.4 s")


@pytest.fixture(scope="module")
def rods() -> wsph.Scene:
    """A rod that flies 1 mm to one at rest."""
    scene = wsph.load(EXAMPLES / "two_rods.toml")
    away = {"type": "box", "min": ["101 mm", "0 mm"], "max": ["301 mm", "4 mm"]}
    return scene.with_(**{"bodies.1.shape": away, "bodies.0.velocity": [100.0, 0.0], "run.end": "15 us"})


def first(found: np.ndarray, times: np.ndarray) -> float:
    """The time of the first of a record at which something holds."""
    return times[np.argmax(found)]


def test_a_field_that_exceeds_a_value_is_found_at_its_step(bar: wsph.Scene) -> None:
    """At the step that a run looked at by hand finds, once, though it goes on for long; and bits are those of `wsph.run`."""
    name = bar.bodies[0].name
    with wsph.Simulation(bar) as sim:
        highest = {state.step: state[name]["stress_xx"].max() for state in sim.every(1)}
    level = 0.5 * max(highest.values())
    wanted = next(step for step, value in highest.items() if value > level)
    seen: list[int] = []
    with wsph.Simulation(bar) as sim:
        sim.when(f"{name}.stress_xx > {level} Pa", lambda state: seen.append(state.step), every=1)
        sim.run()
    assert seen[0] == wanted
    assert all(highest[step] > level >= highest[step - 1] for step in seen)
    whole = wsph.run(bar)
    assert np.array_equal(sim.result.particles["velocity"], whole.particles["velocity"])
    assert all(np.array_equal(sim.result.history[key], values) for key, values in whole.history.items())


def test_looked_at_by_blocks_it_comes_within_a_block(bar: wsph.Scene) -> None:
    seen: list[float] = []
    with wsph.Simulation(bar) as sim:
        sim.when("time >= 0.1 s", lambda state: seen.append(state.time))
        sim.run()
        dt = sim.state.dt
    assert len(seen) == 1
    assert 0.1 <= seen[0] < 0.1 + 100 * dt


def test_a_probe_a_column_and_a_function_say_the_same(bar: wsph.Scene) -> None:
    (probe,) = bar.probes
    column = next(iter(wsph.run(bar).probes[probe.name].keys() - {"time"}))
    record = wsph.run(bar).probes[probe.name]
    level = 0.5 * record[column].max()
    seen: dict[str, list[int]] = {"words": [], "function": [], "energy": [], "numbers": []}
    with wsph.Simulation(bar) as sim:
        sim.when(f"{probe.name}.{column} > {level}", lambda s: seen["words"].append(s.step), every=1)
        sim.when(
            lambda s: first(record[column] > level, record["time"]) <= s.time,
            lambda s: seen["function"].append(s.step),
            every=1,
        )
        sim.when("kinetic < 0.9 J/m2", lambda s: seen["energy"].append(s.step), every=1)
        sim.when(lambda s: s.numbers["kinetic"] < 0.9, lambda s: seen["numbers"].append(s.step), every=1)
        sim.run()
    assert seen["words"][0] == seen["function"][0]
    assert seen["energy"] == seen["numbers"]


def test_the_beginning_of_a_contact_is_called(rods: wsph.Scene) -> None:
    """A gap of 1 mm at 100 m/s: 10 us; the law of the faces pushes from a gap of none on."""
    seen: list[tuple[str, float]] = []
    with wsph.Simulation(rods) as sim:
        sim.when("contact", lambda state: seen.append(("any", state.time)), every=1)
        sim.when("contact short-long", lambda state: seen.append(("named", state.time)), every=1)
        sim.run()
        dt = sim.state.dt
        with pytest.raises(wsph.WsphError, match="this scene has no contact 'long-short'"):
            sim.when("contact long-short", print)
    assert [name for name, _ in seen[:2]] == ["any", "named"]
    assert abs(seen[0][1] - 10e-6) < 5 * dt


def test_a_crack_is_called_and_may_end_the_run() -> None:
    scene = wsph.load(EXAMPLES / "mode_one_strip.toml").with_(
        **{
            "bodies.0.spacing": "2 mm",
            "bodies.0.phase_field.length": "3 mm",
            "boundary.0.where": "y > 0.018",
            "boundary.1.where": "y < -0.018",
        }
    )
    seen: list[float] = []
    with wsph.Simulation(scene) as sim:

        def cracked(state: "wsph.simulation.stepping.state.State") -> None:
            seen.append(state["strip"]["damage"].max())
            sim.stop()

        sim.when("crack strip", cracked, every=20)
        result = sim.run()
    assert len(seen) == 1
    assert seen[0] > 0.5
    assert result.status == "interrupted"
    assert result.time < scene.run.end


def test_the_end_and_an_error_are_called(bar: wsph.Scene) -> None:
    seen: list[str] = []
    with wsph.Simulation(bar) as sim:
        sim.when("end", lambda state: seen.append(f"end {state.step}"))
        sim.when("error", lambda state: seen.append("error"))
        sim.run()
        steps = sim.steps_total
    assert seen == [f"end {steps}"]
    beyond = bar.with_(**{"run.cfl": 3.0, "run.guard": "off", "run.end": 10.0})
    with wsph.Simulation(beyond) as sim:
        sim.when("end", lambda state: seen.append("end of the second"))
        sim.when("error", lambda state: seen.append(f"failed at {state.step}"))
        with pytest.raises(wsph.Unstable):
            sim.run()
    assert sim.failure is not None
    assert seen[1:] == [f"failed at {sim.failure.step}"]


def test_what_is_taken_away_is_not_called(bar: wsph.Scene) -> None:
    seen: list[int] = []
    with wsph.Simulation(bar) as sim:
        away = sim.at(5, lambda state: seen.append(state.step))
        sim.step(12)
        away()
        away()
        sim.run()
    assert seen == [5, 10]


def test_what_a_callback_raises_comes_out_and_the_run_can_go_on(bar: wsph.Scene) -> None:
    seen: list[int] = []

    def refuses(state: "wsph.simulation.stepping.state.State") -> None:
        seen.append(state.step)
        if len(seen) == 1:
            raise ZeroDivisionError

    with wsph.Simulation(bar) as sim:
        sim.at(5, refuses)
        with pytest.raises(ZeroDivisionError):
            sim.run()
        assert sim.state.step == 5
        assert sim.run().status == "completed"
    assert seen[:3] == [5, 10, 15]


WRONG: list[tuple[str, Callable[[str], str]]] = [
    ("{bar}.von_misses > 1 Pa", lambda bar: f"'{bar}.von_misses' is nothing in this run; did you mean"),
    ("{bar}.stress > 1 Pa", lambda bar: f"'{bar}.stress' is no scalar field: name a component"),
    ("{bar}.stress_xx > 1 m", lambda bar: "'1 m' is not in units of Pa"),
    ("kinetik > 1", lambda bar: "'kinetik' is nothing in this run; did you mean 'kinetic'"),
    ("stress is high", lambda bar: "'stress is high' is no condition"),
    ("contact", lambda bar: "this scene has no contact"),
    ("crack", lambda bar: "this scene has no body that can crack"),
]


@pytest.mark.parametrize(("words", "said"), WRONG)
def test_words_that_name_nothing_are_refused(words: str, said: Callable[[str], str], bar: wsph.Scene) -> None:
    name = bar.bodies[0].name
    with wsph.Simulation(bar) as sim:
        with pytest.raises(wsph.WsphError) as error:
            sim.when(words.format(bar=name), print)
        assert said(name) in str(error.value)
        sim.stop()


def test_a_run_without_callbacks_ends_no_block_for_them(bar: wsph.Scene) -> None:
    """The hot path: as many blocks as without, and none for a condition that is looked at by blocks."""
    counts: list[int] = []
    seldom = bar.with_(**{"output.history": 1000})
    for register in (
        lambda sim: None,
        lambda sim: sim.when("time > 1 s", print),
        lambda sim: sim.when("time > 1 s", print, every=7),
    ):
        with wsph.Simulation(seldom) as sim:
            register(sim)
            counts.append(sum(1 for _ in sim))
    assert counts[0] == counts[1] < counts[2]
