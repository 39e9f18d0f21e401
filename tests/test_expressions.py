"""Expressions: the grammar and its caps."""

import math

import numpy as np
import pytest

from wsph.expressions import compile_expression, names_in


@pytest.mark.parametrize(
    ("text", "value"),
    [("2*x^2", 0.5), ("2*x**2", 0.5), ("-x^2", -0.25), ("2^3^2", 512.0), ("sin(pi*x)", 1.0), ("x < 1 and not (t > 0)", 1.0),
     ("0 < x <= 0.5", 1.0), ("min(x, t) + max(1, 2)", 2.0), ("atan2(1, 1)", math.pi / 4), ("abs(-3) + sign(-2)", 2.0), ("x >= 0.5 or x > 9", 1.0)],
)  # fmt: skip
def test_arithmetic(text: str, value: float) -> None:
    assert compile_expression(text)(np.array([[0.5]]), 0.0)[0] == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [("__import__('os')", "unknown function"), ("x.real", "not arithmetic"), ("lambda: 1", "not arithmetic"), ("[x]", "not arithmetic"),
     ("x if x else y", "not arithmetic"), ("xx + 1", "unknown name"), ("sin(x, y)", "takes 1 argument"), ("x +", "cannot read"),
     ("sine(x)", "did you mean 'sin'"), ("x^65", "exponent is at most 64"), ("1e400", "no number"), ("'a'", "not arithmetic"), ("", "cannot read"),
     ("+".join(["x"] * 150), "more than 200"), ("x+(" * 40 + "x" + ")" * 40, "nested"), ("1 " * 600, "at most 1000 characters"), ("min(x, y=1)", "unknown function|not arithmetic"), ("True", "not arithmetic")],
)  # fmt: skip
def test_what_is_not_arithmetic_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        compile_expression(text)


@pytest.mark.parametrize(("text", "message"), [("a =", "cannot read"), ("a = 1", "write == to compare"), ("+".join(["a"] * 150), "more than 200"), ("a " * 600, "at most 1000")])  # fmt: skip
def test_the_names_of_what_cannot_be_read_are_refused_as_it_is(text: str, message: str) -> None:
    for read in (names_in, compile_expression):
        with pytest.raises(ValueError, match=message):
            read(text)


def test_names_beside_the_variables_have_values_wherever_they_stand() -> None:
    """In either operand of and, or, too, of which the first is code of its own."""
    a, b = np.array([1.0, 3.0]), np.array([5.0, 0.0])
    for text, wanted in (("a > 2 and b < 1", [0.0, 1.0]), ("a < 2 or b > 9", [1.0, 0.0]), ("not a > 2", [1.0, 0.0])):
        assert compile_expression(text, ("a", "b"))(np.zeros((2, 1)), values=[a, b]).tolist() == wanted, text


def test_comparisons_widen_by_the_tolerance() -> None:
    x = np.array([[-1e-9], [0.0], [1e-9]])
    assert compile_expression("x <= 0")(x, tolerance=1e-8).tolist() == [1.0, 1.0, 1.0]
    assert compile_expression("x < 0")(x, tolerance=1e-8).tolist() == [0.0, 0.0, 0.0]
    assert compile_expression("x == 0")(x, tolerance=1e-10).tolist() == [0.0, 1.0, 0.0]
