"""Ghost particles: images of a bar's particles across its ends, as He & Seaid 2016, 2.1 and fig 3, surround their bodies.

Ghosts continue the lattice outside, so that every particle has a full neighbourhood. Across an end that is held,
sigma_g = sigma and v_g = 2 v_end - v; across any other the stress is such that the end carries its load, sigma_g n =
2 t - sigma n, and the velocity is even. The paper prints no equation for these values; of the readings tried, this one has
its table of stable and unstable runs, and its errors to the third digit.

An even velocity says that nothing strains across a free face. A bar's waves do not mind; a beam surrounded by such ghosts is
11 and 33 % too fast at fifteen rows (height .1 and .05 m of length .5), and with gradients of the particles alone, ghosts
acting by their stress, it creates energy within some hundred steps. So only bars have them.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.boundary.conditions import Conditions
from wsph.geometry.lattice import Lattice


@dataclass(frozen=True)
class Ghosts:
    """Images, a row each: `source` (g,) particle, `place` (g, 1) in cells, `face` (g,) the particle at the end, `sign` (g,)
    of the normal there, `held` (g,) whether that particle's velocity is prescribed."""

    source: np.ndarray
    place: np.ndarray
    face: np.ndarray
    sign: np.ndarray
    held: np.ndarray


def ghosts(lattice: Lattice, conditions: Conditions, support: float) -> Ghosts:
    """The ghosts of a bar up to `support` [cells] outside its ends."""
    nodes, cells = lattice.centred
    layers = min(int(np.ceil(support)) - 1, len(cells))
    order = np.argsort(cells[:, 0])
    held = np.zeros(len(cells), bool)
    for values in conditions.entries.values():
        held[list(values)] = True
    source = np.concatenate([order[:layers], order[::-1][:layers]])
    face = np.repeat([order[0], order[-1]], layers)
    end = np.repeat([nodes.min(), nodes.max()], layers)[:, None]
    return Ghosts(source, 2.0 * end - cells[source], face, np.repeat([-1, 1], layers), held[face])


@cache
def ghost_kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel]:
    """Kernels over particles and ghosts: what all of them move like, and the ghosts' stress (volume times P)."""
    real, vec, mat = space.scalar, space.vec, space.mat
    Fields = fields_struct(space, layout)

    @wp.kernel(module="unique", enable_backward=False)
    def move(count: int, source: wp.array(dtype=wp.int32), face: wp.array(dtype=wp.int32), held: wp.array(dtype=wp.int32),
             fields: Fields, others_out: Fields):  # fmt: skip
        e = wp.tid()
        if e < count:
            others_out.velocity[e] = fields.velocity[e]
            others_out.displacement[e] = fields.displacement[e]
            return
        g = e - count
        v = fields.velocity[source[g]]
        u = fields.displacement[source[g]]
        if held[g] != 0:
            v = real(2.0) * fields.velocity[face[g]] - v
            u = real(2.0) * fields.displacement[face[g]] - u
        others_out.velocity[e] = v
        others_out.displacement[e] = u

    @wp.kernel(module="unique", enable_backward=False)
    def stress(count: int, source: wp.array(dtype=wp.int32), face: wp.array(dtype=wp.int32), held: wp.array(dtype=wp.int32),
               sign: wp.array(dtype=wp.int32), step: real, loads: wp.array(dtype=vec), stress_out: wp.array(dtype=mat)):  # fmt: skip
        g = wp.tid()
        s = stress_out[source[g]]
        if held[g] == 0:
            # A load is a force; stresses come times the volume.
            s[0, 0] = real(2.0) * real(sign[g]) * step * loads[face[g]][0] - s[0, 0]
        stress_out[count + g] = s

    return move, stress
