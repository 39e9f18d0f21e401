"""What each of several processes would have of a body."""

# pyright: strict

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsph.formulations.system import System
from wsph.geometry.geometry import Geometry
from wsph.plugins.formulations import Formulation
from wsph.ranks.slabs import Slab, TooFew, slabs, work_of
from wsph.scene.geometries import reach_of
from wsph.scene.scene import Scene

Held = tuple[Slab, Slab]
"""A slab of a process, and with all that it holds of others."""


def slabs_of(
    scene: Scene, geometries: Sequence[Geometry], formulation: Formulation, count: int
) -> list[list[Held] | None]:
    """The slabs of so many processes of the bodies of a scene, which are whole here; None of one that each has all of.
    Raises TooFew for one by itself."""
    found: list[list[Held] | None] = []
    loads = np.zeros(count)
    for body, geometry in zip(scene.bodies, geometries, strict=True):
        reach, who = reach_of(scene, body, formulation), f"body {body.name!r}"
        try:
            cut = slabs(geometry.counts, count, reach, who=who, loads=loads)
        except TooFew:
            if len(scene.bodies) == 1:
                raise
            found.append(None)
        else:
            loads += work_of(cut)
            counts = geometry.counts
            nodes, points = (each.astype(np.int64) for each in (counts.nodes, counts.points))
            found.append([(each, each.over(reach.around(each.layers), nodes, points)) for each in cut])
    return found


@dataclass(frozen=True)
class Part:
    """What a process has of a body: particles of its own, copies that it is told of, in so many numbers (`sent`), what it
    works on, in particles by their mean pairs, and memory [bytes]."""

    own: int
    copies: int
    sent: int
    worked: float
    nbytes: float


def part_of(system: System, held: Held) -> Part:
    """What a process with a slab of a body would have."""
    slab, wide = system.holding(held[0]), held[1]
    share = slab.nodes if system.count == slab.nodes.whole else slab.cells
    own, worked = share.high - share.low, system.count * slab.work / float(system.geometry.counts.visits.sum())
    sight = system.sight(slice(share.low, share.high), share.window)
    if sight is None:
        copies, nbytes = share.held - own, system.nbytes / system.count * share.held
        return Part(own, copies, copies * system.told, worked, nbytes)
    around = wide.nodes.held if system.count == slab.nodes.whole else wide.cells.held
    nbytes = (system.nbytes - sight.every) / system.count * around + sight.listed
    return Part(own, around - own, (sight.moved - own) * system.told, worked, nbytes)
