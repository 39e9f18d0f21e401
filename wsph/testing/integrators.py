"""Checks that every integrator has to pass."""

# pyright: strict

import itertools
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.run import run
from wsph.testing.reactions import check_reactions
from wsph.testing.scenes import AMPLITUDE, vibrating_bar
from wsph.testing.steps import spectral_radius

GROWTH = 2e-3
"""Growth of a wave in a step that a limit may leave: some methods have none without, and say how little."""

INSIDE, FAR = 0.98, 2.0
"""Parts of a limit: at the one steps have to hold, and where they hold at the other the limit is far too small."""


def temporal_order(
    integrator: str | Mapping[str, object], courant: tuple[float, ...] = (0.2, 0.1, 0.05, 0.025), **scene: object
) -> float:
    """Order in time at a fixed spacing: slope of the differences between runs at halved time steps, by regression.

    `scene` are further arguments of `vibrating_bar`.
    """
    further: dict[str, Any] = scene
    states = [run(vibrating_bar(integrator, courant=c, **further)).particles["velocity"][:, 0] for c in courant]
    differences = [np.linalg.norm(a - b) for a, b in itertools.pairwise(states)]
    return float(np.polyfit(np.log(courant[:-1]), np.log(differences), 1)[0])


def check_integrator(
    integrator: str | Mapping[str, object],
    *,
    order: float,
    tolerance: float = 0.1,
    courant: tuple[float, ...] = (0.2, 0.1, 0.05, 0.025),
) -> None:
    """Run what a registered integrator must do: its order in time over the Courant numbers `courant`, the same bits again,
    both precisions agree, its `limit()` holds every wave of a bar, and the reactions of the bar's ends, with the work of one
    that is moved, are right. Raises AssertionError; warns of a limit far below what the method holds."""
    measured = temporal_order(integrator, courant)
    assert abs(measured - order) <= tolerance, f"{integrator}: order {measured:.3f} in time, not {order}"
    runs = [run(vibrating_bar(integrator, courant=courant[0])) for _ in range(2)]
    a, b = (r.particles["velocity"] for r in runs)
    assert np.array_equal(a, b), f"{integrator}: the same scene gave other bits"
    single = run(vibrating_bar(integrator, courant=courant[0], precision="f32")).particles["velocity"]
    gap = np.abs(single - a).max() / AMPLITUDE
    assert gap < 1e-4, f"{integrator}: single and double precision differ by {gap:.2e} of the velocity"
    check_limit(integrator)
    check_reactions(integrator, courant[0])


def check_limit(integrator: str | Mapping[str, object]) -> None:
    """Measure, by the matrix of the step of a bar of ten cells, what its waves are multiplied by at INSIDE of the limit that
    the integrator claims. Raises AssertionError where one grows by more than GROWTH a step; warns where none does at FAR
    times the limit. A limit of zero, of methods that amplify every undamped wave, claims nothing."""
    claimed = compose(_small(integrator, 0.1)).bodies[0].limit
    if claimed is None or not 0.0 < claimed < np.inf:
        return
    grown = spectral_radius(_small(integrator, INSIDE * claimed)) - 1.0
    assert grown <= GROWTH, (
        f"{integrator}: its limit() is a Courant number of {claimed:.4g} on a bar, where a wave grows by {grown:.2g} a step at"
        f" {INSIDE} of it; it holds up to {_held(integrator, claimed):.3g}"
    )
    if spectral_radius(_small(integrator, FAR * claimed)) <= 1.0 + 1e-6:
        text = f"{integrator}: its limit() is a Courant number of {claimed:.4g} on a bar, far too small: {FAR:g} times that holds"
        warnings.warn(text, RuntimeWarning, stacklevel=2)


def _held(integrator: str | Mapping[str, object], beyond: float) -> float:
    """The Courant number up to which no wave grows by more than GROWTH a step, below one where some does."""
    low, high = 0.0, beyond
    while high - low > 5e-3 * beyond:
        middle = 0.5 * (low + high)
        holds = spectral_radius(_small(integrator, middle)) - 1.0 <= GROWTH
        low, high = (middle, high) if holds else (low, middle)
    return low


def _small(integrator: str | Mapping[str, object], courant: float) -> Scene:
    return vibrating_bar(integrator, cells=10, courant=courant, periods=10.0)
