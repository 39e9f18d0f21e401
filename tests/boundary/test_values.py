"""Boundary values: the device's stack machine agrees with numpy, tables hold or interpolate, stages take their own times."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.values import BoundaryValues
from wsph.expressions import Expression, compile_expression
from wsph.scene.tables import Function


def on_device(
    values: list[Expression | Function],
    time: float,
    dt: float = 1e-3,
    c: float | tuple[float, float] = 0.0,
    x: float = 0.3,
) -> np.ndarray:
    """Values as the device imposes them on the velocities of particles at x, at time + c dt [s]."""
    space = Space(1)
    state = State(space, len(values), Layout((Field("velocity", 1, "m/s", leads=True),)), "cpu")
    conditions = Conditions()
    for k, value in enumerate(values):
        conditions.put("velocity", 0, np.array([k]), value)
    clock = Clock(dt, "cpu")
    clock.time.assign([time, dt])
    BoundaryValues(space, conditions, state, np.full((len(values), 1), x), {"velocity": 1.0}, 1.0, "cpu").impose(
        state, clock, c
    )
    return state.read("velocity")[:, 0]


EVERY = ["negate", "not x", "sin(x)", "cos(x)", "tan(x)", "asin(x)", "acos(x)", "atan(x)", "sinh(x)", "cosh(x)", "tanh(x)", "exp(x)", "log(x)", "log10(x)", "sqrt(x)",
         "abs(x-1)", "sign(x-1)", "floor(x*7)", "ceil(x*7)", "x+t", "x-t", "x*t", "x/t", "x^t", "min(x,t)", "max(x,t)", "atan2(x,t)",
         "x<t", "x<=t", "x>t", "x>=t", "x==t", "x!=t", "x and 0", "x or 0", "-x*y+z-2*pi"]  # fmt: skip


def test_every_operation_agrees_with_the_device() -> None:
    expressions = [compile_expression(text if text != "negate" else "-x") for text in EVERY]
    host = np.array([e(np.array([[0.3]]), 0.7)[0] for e in expressions])
    np.testing.assert_allclose(on_device(expressions, 0.7), host, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("c", [0.0, 0.5, (0.0, 1.0)])
def test_tables_alone_give_the_bits_that_they_give_beside_an_expression(c: float | tuple[float, float]) -> None:
    t, value = [0.0, 0.7004, 0.9], [0.1, -0.3, 0.7]
    tables: list[Expression | Function] = [
        Function.model_validate({"t": t, "value": value, "interp": way}) for way in ("linear", "step")
    ]
    beside = on_device([*tables, compile_expression("sin(x)*t")], 0.7, c=c)
    np.testing.assert_array_equal(on_device(tables, 0.7, c=c), beside[:2])
    assert beside[2] != 0.0


@settings(max_examples=40, deadline=None)
@given(
    st.recursive(
        st.sampled_from(["x", "t", "2.5", "pi"]),
        lambda e: st.builds(lambda a, o, b: f"({a}{o}{b})", e, st.sampled_from("+-*<"), e),
        max_leaves=12,
    )
)
def test_random_expressions_agree_with_the_device(text: str) -> None:
    expression = compile_expression(text)
    np.testing.assert_allclose(
        on_device([expression], 0.7)[0], expression(np.array([[0.3]]), 0.7)[0], rtol=1e-13, atol=1e-13
    )


def test_step_tables_hold_up_to_the_next_entry_and_ramps_interpolate() -> None:
    step = Function(t=[1.0, 2.0], value=[5.0, 7.0], interp="step")
    ramp = Function(t=[1.0, 2.0], value=[5.0, 7.0])
    times = (0.0, 1.0, 1.5, 2.0, 2.0 + 1e-13, 2.1, 9.0)
    assert [on_device([step], t)[0] for t in times] == [5.0, 5.0, 5.0, 5.0, 5.0, 7.0, 7.0]
    assert [on_device([ramp], t)[0] for t in (0.0, 1.0, 1.5, 2.0, 9.0)] == pytest.approx([5.0, 5.0, 6.0, 7.0, 7.0])


def test_values_are_taken_at_the_stage_or_as_the_mean_of_both_ends() -> None:
    ramp = Function(t=[0.0, 1.0], value=[0.0, 1.0])
    assert on_device([ramp], 0.2, dt=0.1, c=0.5)[0] == pytest.approx(0.25)
    step = Function(t=[0.0, 0.25], value=[1.0, 0.0], interp="step")
    assert on_device([step], 0.2, dt=0.1, c=(0.0, 1.0))[0] == pytest.approx(0.5)


def test_the_stack_never_outgrows_the_device() -> None:
    deepest = compile_expression("x+(" * 14 + "x" + ")" * 14)
    assert on_device([deepest], 0.0)[0] == pytest.approx(0.3 * 15)
