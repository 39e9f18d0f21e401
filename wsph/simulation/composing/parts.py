"""What each of several processes would have of a body."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.formulations.system import System
from wsph.ranks.slabs import Slab, TooFew, slabs
from wsph.scene.geometries import reach_of
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import BodyRun
from wsph.simulation.composing.setting import Method


def slabs_of(scene: Scene, run: BodyRun, method: Method, loads: np.ndarray) -> list[Slab] | None:
    """The slabs of a body of processes that have `loads` (size,) of others [visits of pairs]; None where each has all of it.
    Raises TooFew for one by itself."""
    reach, who = reach_of(scene, run.body, method.formulation), f"body {run.body.name!r}"
    try:
        return slabs(run.system.geometry.counts, len(loads), reach, who=who, loads=loads)
    except TooFew:
        if len(scene.bodies) == 1:
            raise
        return None


@dataclass(frozen=True)
class Part:
    """What a process has of a body: particles of its own, copies that it is told of, what it works on, in particles by their
    mean pairs, and memory [bytes]."""

    own: int
    copies: int
    worked: float
    nbytes: float


def part_of(system: System, slab: Slab) -> Part:
    """What a process with a slab of a body would have."""
    share = slab.nodes if system.count == slab.nodes.whole else slab.cells
    own, worked = share.high - share.low, system.count * slab.work / float(system.geometry.counts.visits.sum())
    sight = system.sight(slice(share.low, share.high), share.window)
    if sight is None:
        return Part(own, share.held - own, worked, system.nbytes / system.count * share.held)
    return Part(own, sight.moved - own, worked, system.nbytes - sight.spared)
