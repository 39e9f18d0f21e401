"""Supports: where the stress of a linear motion is uniform, and what is refused before a kernel is compiled."""

import re

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.scenes import driven
from wsph.plugins.formulations import FORMULATIONS
from wsph.simulation.compose import compose

GRADIENT = np.array([[0.03, 0.02, -0.01], [0.01, -0.02, 0.015], [-0.012, 0.008, 0.025]])


def patch(dim: int, cells: int, run: dict) -> wsph.Scene:
    """A block whose faces are all driven with a linear velocity, which it begins with."""
    velocity = ["+".join(f"({GRADIENT[i, j]})*{'xyz'[j]}" for j in range(dim)) for i in range(dim)]
    faces = [driven(side + axis, **dict(zip("xyz", velocity, strict=False))) for axis in "xyz"[:dim] for side in "+-"]
    return scenes.block(dim, cells, run={"end": 1.0, "cfl": 0.2, **run}, velocity=velocity, tables={"boundary": faces})


def gap(made: wsph.Scene) -> float:
    """Largest difference of a stress from the middle one, of the largest component."""
    stress = wsph.run(made).particles["stress"]
    middle = np.median(stress, axis=0)
    return float(np.abs(stress - middle).max() / np.abs(middle).max())


@pytest.mark.parametrize(
    ("dim", "cells", "support", "gate"),
    [
        (1, 12, 1.45, 1e-12),
        (1, 12, 1.8, 5e-3),
        (2, 8, 1.55, 1e-12),
        (2, 8, 1.8, 2e-3),
        (3, 5, 1.6, 1e-12),
        (3, 5, 1.8, 5e-4),
    ],
)
def test_stress_points_have_the_uniform_stress_of_a_linear_motion(
    dim: int, cells: int, support: float, gate: float
) -> None:
    assert gap(patch(dim, cells, {"formulation": "stress-points", "support": support})) < gate


@pytest.mark.parametrize("support", [1.2, 1.8, 3.6, 6.0])
def test_two_sets_have_it_with_any_support(support: float) -> None:
    assert gap(patch(1, 16, {"integrator": "tsph", "support": support, "guard": "off", "cfl": 0.5})) < 1e-12
    assert gap(patch(2, 8, {"integrator": "ul-tsph", "support": support, "guard": "off", "cfl": 0.5})) < 1e-12


@pytest.mark.parametrize("each", FORMULATIONS, ids=lambda each: f"{each.name} of {each.sets}")
def test_a_support_beyond_what_a_form_takes_is_refused_by_name(each) -> None:
    integrator = "leapfrog" if each.sets == 1 else {"small-strain": "tsph", "updated-lagrangian": "ul-tsph"}[each.name]
    high = each.traits.supports[1]
    run = {"integrator": integrator, "formulation": each.name}
    said = re.escape(f"the {each.name} form takes 0 to {high:g} spacings") + ".*without the key it is"
    for support in (high + 0.01, 100.0):
        with pytest.raises(wsph.Refused, match=f"run.support = {support:g}: {said}"):
            compose(scenes.block(1, 16, run={**run, "support": support}))
    compose(scenes.block(1, 16, run={**run, "support": high, "guard": "off"}))
