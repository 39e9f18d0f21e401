"""A body does not know the names of its axes: relabelled and mirrored copies give the same answers."""

from itertools import permutations, product

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.output.fields import AXES, TENSOR

METHODS = [
    ("tsph", "small-strain"),
    ("ul-tsph", "updated-lagrangian"),
    ("leapfrog", "stress-points"),
    ("leapfrog", "total-lagrangian"),
    ("leapfrog", "updated-lagrangian"),
]
SIDES = [1.0, 1.5, 0.75]
VELOCITY = ["0.05*sin(2*Y) + 0.03*X*Z", "0.04*X*Y - 0.02*Z", "0.03*cos(3*X)*Y"]


def copy(method: tuple[str, str], new: tuple[int, ...], sign: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    """Places, velocities (n, 3) and stresses (n, 3, 3) in the axes of the first body, of its copy whose axis i is the
    first's axis new[i], turned round where sign[i] is -1. It is held at one side and loaded across another."""
    relabel = np.zeros((3, 3))
    relabel[np.arange(3), new] = sign
    old = ["", "", ""]
    for i, k in enumerate(new):
        old[k] = AXES[i] if sign[i] > 0 else f"(-{AXES[i]})"

    def face(name: str) -> str:
        i = new.index(AXES.index(name[1]))
        return (name[0] if sign[i] > 0 else {"-": "+", "+": "-"}[name[0]]) + AXES[i]

    def told(text: str) -> str:
        for name, place in zip("XYZ", old, strict=True):
            text = text.replace(name, place)
        return f"({text})"

    velocity = [("-" if sign[i] < 0 else "") + told(VELOCITY[k]) for i, k in enumerate(new)]
    shape = scenes.box(*[(0.0, SIDES[k]) if sign[i] > 0 else (-SIDES[k], 0.0) for i, k in enumerate(new)])
    load = {"body": "b", "face": face("+y"), "stress": {face("+y")[1] * 2: -0.03}}
    body = scenes.body(shape, 0.25, velocity=velocity, material=scenes.material("jaumann"))
    run = {"integrator": method[0], "formulation": method[1], "end": 1.0, "cfl": 0.3, "guard": "off"}
    scene = scenes.scene(
        body, run=run, boundary=[scenes.held(face("-x"), 3), load], output={"fields": ["velocity", "stress"]}
    )
    particles = wsph.run(scene).particles
    stress = np.zeros((len(particles["stress"]), 3, 3))
    for k, (i, j) in enumerate((AXES.index(a), AXES.index(b)) for a, b in TENSOR):
        stress[:, i, j] = stress[:, j, i] = particles["stress"][:, k]
    places = particles["position"] @ relabel
    order = np.lexsort(np.round(places, 9).T)
    back = places, particles["velocity"] @ relabel, relabel.T @ stress @ relabel
    return tuple(each[order] for each in back)


@pytest.mark.parametrize("method", METHODS, ids="-".join)
def test_relabelled_and_mirrored_copies_give_the_same_answers(method: tuple[str, str]) -> None:
    """Every permutation of the axes, and mirror images in one axis and in all: to 3e-14, a few roundings a step."""
    first = copy(method, (0, 1, 2), (1, 1, 1))
    for new, sign in product(permutations(range(3)), [(1, 1, 1), (-1, 1, 1), (-1, -1, -1)]):
        places, velocity, stress = copy(method, new, sign)
        assert np.abs(places - first[0]).max() < 1e-12
        assert np.abs(velocity - first[1]).max() < 1e-13 * np.abs(first[1]).max(), (new, sign)
        assert np.abs(stress - first[2]).max() < 1e-13 * np.abs(first[2]).max(), (new, sign)
