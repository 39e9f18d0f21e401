"""What each of several processes would have of a body."""

# pyright: strict

from dataclasses import dataclass

from wsph.backend.domain import Share
from wsph.formulations.system import System
from wsph.geometry.grid import layers_of, plan
from wsph.geometry.meshes.layered import Layered
from wsph.ranks.slabs import TooFew, slabs
from wsph.scene.geometries import reach_of
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import BodyRun
from wsph.simulation.composing.setting import Method


def shares_of(scene: Scene, run: BodyRun, method: Method, count: int) -> list[Share] | None:
    """What so many processes have of the particles of a body; None where each has all. Raises TooFew for one by itself."""
    body, geometry = run.body, run.system.geometry
    reach, joined = reach_of(scene, body, method.formulation)
    if isinstance(geometry, Layered):
        nodes, cells = geometry.layers.nodes, geometry.layers.points
    else:
        assert body.shape is not None
        assert body.spacing is not None
        grid = plan(body.shape, body.spacing, body.lattice_rotate)
        layers = layers_of(body.shape, grid, 0, int(grid.count[0]) + 1)
        nodes, cells = layers[:, 0], layers[:-1, 1]
    try:
        found = slabs(nodes, cells, count, reach, joined=joined, who=f"body {body.name!r}")
    except TooFew:
        if len(scene.bodies) == 1:
            raise
        return None
    at_cells = joined and not isinstance(geometry, Layered) and run.system.count == cells.sum()
    return [each.cells if at_cells else each.nodes for each in found]


@dataclass(frozen=True)
class Part:
    """What a process has of a body: particles of its own, copies that it is told of, in so many numbers (`sent`), particles
    that it works on, and memory [bytes]."""

    own: int
    copies: int
    sent: int
    worked: float
    nbytes: float


def part_of(system: System, share: Share) -> Part:
    """What a process with a share of the particles would have."""
    own = share.high - share.low
    sight = system.sight(slice(share.low, share.high), share.window)
    if sight is None:
        copies, nbytes = share.held - own, system.nbytes / system.count * share.held
        return Part(own, copies, copies * system.told, own + system.copied * copies, nbytes)
    # Of the launches that go through pairs one in three is of its own alone.
    copies, worked = sight.moved - own, (own + 2 * sight.stressed) / 3
    return Part(own, copies, copies * system.told, worked, system.nbytes - sight.spared)
