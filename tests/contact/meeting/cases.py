"""Scenes of bodies that meet, and what is read from their runs."""

from typing import Any

import numpy as np

import wsph
from tests import scenes

SPEED = float(np.sqrt(1.0 / (1.0 - 0.3**2) * (1.0 - 0.3**2) * (1.0 - 0.3) / ((1.0 + 0.3) * (1.0 - 2.0 * 0.3))))
"""Of waves in the bodies of `tests.scenes` at plane strain: sqrt((1 - nu)/((1 + nu)(1 - 2 nu)))."""


def rods(cells: int, form: str, *, ratio: float = 1.0, run: dict[str, Any] | None = None, **contact: Any) -> wsph.Scene:
    """Two rods of length 1 and four cells high, without Poisson's ratio, that hit each other at +-.005 of the wave speed;
    the second one's cells are `ratio` times as large."""
    h = 1.0 / cells
    made = [
        scenes.body(scenes.box((x, x + 1.0), 4.0 * h), spacing, name, velocity=[v, 0.0], state="stress",
                    material=scenes.material(poisson_ratio=0.0))
        for name, x, v, spacing in (("a", 0.0, 0.005, h), ("b", 1.0 + 0.1 * h, -0.005, ratio * h))
    ]  # fmt: skip
    settings = {"formulation": form, "end": 2.6, "cfl": 0.3, **(run or {})}
    return scenes.scene(*made, run=settings, contact=[{"between": ["a", "b"], **contact}])


def mean_velocity(run: Any, number: int) -> np.ndarray:
    """Of an upright box on the x axis at the end, weighed by mass, (dim,): nodes on faces stand for half as much."""
    here = run.particles["body"] == number
    x, v = run.particles["position"][here], run.particles["velocity"][here]
    nodes = x[:, 1].min() < 1e-12
    ends = (np.abs(x - x.min(0)) < 1e-9) | (np.abs(x - x.max(0)) < 1e-9)
    mass = np.where(ends & nodes, 0.5, 1.0).prod(1)
    return mass @ v / mass.sum()


def corner_on_corner(offset: float, form: str = "stress-points", cells: int = 20, speed: float = 0.03, *,
                     ratio: float = 1.0, run: dict[str, Any] | None = None, turn: float = 45.0, **contact: Any) -> wsph.Scene:  # fmt: skip
    """Two squares of side 1, corners towards each other; the second is off by `offset` cells."""
    h, half = 1.0 / cells, np.sqrt(0.5)
    gap = 0.05 * h
    made = []
    for name, x, y, v, spacing in (("a", -half - gap, 0.0, 1.0, h), ("b", half + gap, offset * h, -1.0, ratio * h)):
        shape = scenes.box((x - 0.5, x + 0.5), (y - 0.5, y + 0.5)) | {"rotate": turn}
        made.append(scenes.body(shape, spacing, name, velocity=[0.5 * speed * SPEED * v, 0.0]))
    settings = {"formulation": form, "end": 9.0 / SPEED, **(run or {})}
    return scenes.scene(*made, run=settings, contact=[{"between": ["a", "b"], **contact}])


def face_on_face(overlap: float, form: str = "stress-points", cells: int = 20, speed: float = 0.03, *,
                 ratio: float = 1.0, run: dict[str, Any] | None = None, **contact: Any) -> wsph.Scene:  # fmt: skip
    """Two squares of side 1 whose faces overlap by `overlap` cells only."""
    h = 1.0 / cells
    gap = 0.05 * h
    made = []
    for name, x, y, v, spacing in (("a", -1.0 - gap, 0.0, 1.0, h), ("b", 0.0, 1.0 - overlap * h, -1.0, ratio * h)):
        made.append(scenes.body(scenes.box((x, x + 1.0), (y, y + 1.0)), spacing, name,
                                velocity=[0.5 * speed * SPEED * v, 0.0]))  # fmt: skip
    settings = {"formulation": form, "end": 9.0 / SPEED, **(run or {})}
    return scenes.scene(*made, run=settings, contact=[{"between": ["a", "b"], **contact}])


OFFSETS = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
OVERLAPS = (0.01, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0)


def made_in(run: Any) -> tuple[float, float, float]:
    """Energy that the contact has made, of the kinetic energy at the start, at the worst instant and at the end (below zero:
    lost), and the momentum at the end over that of one body."""
    history = run.history
    start = float(np.asarray(history["kinetic"])[0])
    numerical = np.asarray(history["contact_numerical"])
    momentum = np.abs([np.asarray(history[f"momentum_{axis}"])[-1] for axis in "xy"]).max()
    return -float(numerical.min()) / start, -float(numerical[-1]) / start, float(momentum)
