"""Checks of what an integrator says that the boundaries of a body do to it."""

# pyright: strict

import warnings
from collections.abc import Mapping

import numpy as np

from wsph.errors import WsphError
from wsph.plugins.integrators import sets
from wsph.plugins.registry import load
from wsph.scene.scene import Scene
from wsph.simulation.result import Result
from wsph.simulation.run import run
from wsph.testing.scenes import bar

SHARE = 0.02
"""Part by which impulses and works may differ: methods on two sets of particles know them to the order of their step."""

PULL, SPEED = 1e-3, 1e-3
"""Traction [Pa] on the end of a bar of E = 1 Pa, and the speed [m/s] of an end that is moved."""


def check_reactions(integrator: str | Mapping[str, object], courant: float) -> None:
    """Check the reaction of a bar's held end while the other is pulled, by the momentum of the bar, and the work of a moved
    end, by that of leapfrog. Raises AssertionError. A method that refuses moved ends is not asked for their work, one on two
    sets of particles, whose faces carry stress, for no reactions."""
    name = integrator if isinstance(integrator, str) else str(integrator["name"])
    if sets(load("integrators", name)) == 1:
        pulled = _run(_held(integrator, courant, traction={"x": PULL}))
        time = pulled.history["time"]
        _check_impulse(integrator, pulled, "wall", PULL * (time[-1] - time[0]))
    motion = {"x": f"{SPEED}*sin(pi*t)"}
    try:
        moved = _run(_held(integrator, courant, velocity=motion))
    except WsphError:
        return
    known = _run(_held("leapfrog", 0.1, velocity=motion))
    work, right = (float(each.history["external_work"][-1]) for each in (moved, known))
    assert abs(work - right) <= SHARE * abs(right), (
        f"{integrator}: the work of an end that is moved is {work:.4g} J, where leapfrog has {right:.4g} J"
    )


def _run(scene: Scene) -> Result:
    """Run a scene; that a method makes energy is no matter here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return run(scene)


def _held(integrator: str | Mapping[str, object], courant: float, **end: object) -> Scene:
    """A bar at rest, held on the left, for a time in which waves cross it one and a half times."""
    boundary = [
        {"body": "bar", "face": "-x", "name": "wall", "fixed": ["x"]},
        {"body": "bar", "face": "+x", "name": "end", **end},
    ]
    return bar(integrator, courant=courant, end=1.5, boundary=boundary, output={"history": 1})


def _check_impulse(integrator: object, result: Result, name: str, load: float) -> None:
    """The change of momentum is the impulse of the load and of the reactions, each the mean of its step."""
    history = result.history
    change = float(history["momentum_x"][-1] - history["momentum_x"][0])
    reaction = float(history[f"reaction_{name}_x"][1:] @ np.diff(history["time"]))
    right = change - load
    assert abs(reaction - right) <= SHARE * abs(load), (
        f"{integrator}: the reactions of a held end have an impulse of {reaction:.4g} N s, where the momentum of the bar asks for"
        f" {right:.4g} N s: what is set in a stage has to reach the accepted state by `combine` alone"
    )
