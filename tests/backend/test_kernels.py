"""The decorator of kernels: what it refuses, and what a launch knows of what it made."""

from collections.abc import Callable

import pytest
import warp as wp

from wsph.backend.kernels import is_ranged, kernel
from wsph.backend.launch import Launch

Numbers = wp.array(dtype=float)


def copied(first: int, a: Numbers, b_out: Numbers):
    i = first + wp.tid()
    b_out[i] = a[i]


def whole(a: Numbers, b_out: Numbers):
    b_out[wp.tid()] = a[wp.tid()]


def unmarked(a: Numbers, b_out: Numbers):
    if a[0] > 0.0:
        a[0] = b_out[0]


def by_another_name(a: Numbers, b_out: Numbers):
    c = a
    for k in range(3):
        c[k] += b_out[k]


def by_an_atomic(a: Numbers, b_out: Numbers):
    wp.atomic_add(a, 0, b_out[0])


def backwards(b_out: Numbers, a: Numbers):
    b_out[0] = a[0]


def crowded(
    a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int, i: int, j: int, k: int, m: int, n_out: Numbers
):
    n_out[0] = 1.0


def local_copy(first: int, a: Numbers, b_out: Numbers):
    m = wp.vec3(a[first])
    m[0] = 1.0
    b_out[first] = m[0]


def test_a_ranged_kernel_is_known_to_its_launches() -> None:
    for function, ranged in ((copied, True), (local_copy, True), (whole, False)):
        made = kernel(ranged=ranged)(function)
        assert is_ranged(made) == ranged == Launch(made, 1, [], [], "cpu").divisible


def test_a_range_of_a_launch_does_its_rows_alone() -> None:
    a, b = wp.array([1.0, 2.0, 3.0, 4.0], dtype=float, device="cpu"), wp.zeros(4, dtype=float, device="cpu")
    Launch(kernel(ranged=True)(copied), 4, [a], [b], "cpu").run(1, 3)
    assert b.numpy().tolist() == [0.0, 2.0, 3.0, 0.0]


@pytest.mark.parametrize(
    ("function", "ranged", "says"),
    [
        (copied, False, "copied is not ranged"),
        (whole, True, "whole is ranged"),
        (unmarked, False, "unmarked writes a"),
        (by_another_name, False, "by_another_name writes a"),
        (by_an_atomic, False, "by_an_atomic writes a"),
        (backwards, False, "backwards has an input behind an output"),
        (crowded, False, "crowded has 13 arguments, at most 12"),
    ],
)
def test_a_kernel_says_what_it_does(function: Callable[..., None], ranged: bool, says: str) -> None:
    with pytest.raises(TypeError, match=says):
        kernel(ranged=ranged)(function)
