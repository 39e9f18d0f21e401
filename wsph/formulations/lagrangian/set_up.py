"""Pairs, weights and moments in the reference configuration: found once, in double precision whatever the run's."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from dataclasses import dataclass

import numpy as np
import warp as wp

from wsph.backend.space import Array, Space
from wsph.formulations.lagrangian.weights import QUANTA, set_up_kernel
from wsph.geometry.geometry import Geometry
from wsph.geometry.gradients import NodalGradients
from wsph.geometry.lattice import Lattice
from wsph.parts.part import Host
from wsph.sph.averages import visible
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.rows import rows_of
from wsph.sph.smoothing import SUPPORT


@dataclass(frozen=True)
class Reference:
    """The reference configuration as points see it, in the body's own lengths, m points and n particles (ghosts included):
    `place` (n, dim), `centre` (m, dim), `moment` (m, dim, dim), the inverse second moments, zero where a point sees too
    little, `spread` (m,), there infinite, and `rank` (m,), how many directions it sees; `weight` (pairs,). In place of the
    weights' times r: `gradients`, those of the cells around a particle, or `slope` (pairs, dim), those of a point's own
    cell, volume times the gradient's weight."""

    pairs: Pairs
    weight: np.ndarray
    place: np.ndarray
    centre: np.ndarray
    moment: np.ndarray
    spread: np.ndarray
    rank: np.ndarray
    gradients: NodalGradients | None = None
    slope: np.ndarray | None = None


def find_reference(
    host: Host, particles: np.ndarray, points: np.ndarray, quantum: str, device: str, position: np.ndarray
) -> Reference:
    """Pairs, weights, means and moments. `particles` (n, dim) and `points` (m, dim) in units of cells, `position` of the
    particles [m]; `quantum` is the precision whose quanta weights are multiples of."""
    body, space, separate, stretch = host.geometry, Space(host.space.dim), not host.traits.pairwise, None
    if isinstance(body, Lattice) and not body.mapped:
        # In cells of the grid, so that moments of cells of any aspect can be inverted; then in the body's own lengths.
        stretch = body.frame.axes * body.steps(host.scales.length)
    about = position - body.middle
    place = about / host.scales.length if stretch is None else particles @ stretch.T
    grid = place if stretch is None else particles
    reach = np.full(len(points), host.support)
    while True:
        pairs = _visible(body, points, particles, reach, device, separate, host.at_nodes)
        weight, centre, moment, spread, rank = _moments(host, space, pairs, points, particles, grid, quantum, device)
        isolated = np.flatnonzero(rank < space.dim)
        # A point of a shape's odd corner may need to see further.
        if not len(isolated) or not separate or reach.max() > 2.0 * host.support:
            break
        reach[isolated] *= 1.5
    alone = rank < space.dim
    if stretch is not None:
        back = np.linalg.inv(stretch)
        if not (stretch == body.axes).all():
            whole = np.linalg.inv(np.where(alone[:, None, None], np.eye(space.dim), moment))
            spread = np.einsum("ki,nij,kj->n", stretch, whole, stretch)
        moment, centre = back.T @ moment @ back, centre @ stretch.T
        moment = 0.5 * (moment + moment.transpose(0, 2, 1))
    moment[alone] = 0.0
    spread[alone] = np.inf
    return Reference(pairs, weight, place, centre if separate else place, moment, spread, rank)


def _visible(
    body: Geometry,
    points: np.ndarray,
    particles: np.ndarray,
    reach: np.ndarray,
    device: str,
    separate: bool,
    at_nodes: bool,
) -> Pairs:
    """Pairs from points to particles whose lines cross no crack."""
    nodes, cells = body.off_cracks if body.cracks else (particles, points)
    off_cracks = cells if separate or not at_nodes else nodes, nodes if at_nodes else cells
    return visible(find_pairs(points, particles, reach, device, same=not separate), body, *off_cracks)


def _moments(
    host: Host,
    space: Space,
    pairs: Pairs,
    points: np.ndarray,
    particles: np.ndarray,
    grid: np.ndarray,
    quantum: str,
    device: str,
) -> tuple[np.ndarray, ...]:
    """Weights (pairs,), means (m, dim), inverse second moments (m, dim, dim), spreads and ranks (m,) of places `grid`."""
    m = len(points)
    shapes = ((pairs.count, wp.float64), (m, space.vec), (m, space.mat), (m, wp.float64), (m, wp.int32))
    found: list[Array] = [wp.zeros(n, dtype=dtype, device=device) for n, dtype in shapes]
    inputs = [wp.float64(host.support / SUPPORT), wp.float64(QUANTA[quantum]), rows_of(space, pairs)]
    inputs += [wp.array(a, dtype=space.vec, device=device) for a in (points, particles, grid)]
    kernel = set_up_kernel(space, host.smoothing, not host.traits.pairwise)
    wp.launch(kernel, m, device=device, inputs=inputs, outputs=found)
    weight, centre, moment, spread, rank = (each.numpy() for each in found)
    return weight, centre, moment, spread, rank
