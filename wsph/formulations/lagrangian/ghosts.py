"""Ghost particles: images of a bar's particles across its ends, as He & Seaid 2016, 2.1 and fig 3, surround their bodies.

Ghosts continue the lattice outside, so that every particle has a full neighbourhood. Across an end that is held,
sigma_g = sigma and v_g = 2 v_end - v; across any other the stress is such that the end carries its load, sigma_g n =
2 t - sigma n, and the velocity is even. The paper prints no equation for these values; of the readings tried, this one has
its table of stable and unstable runs, and its errors to the third digit.

An even velocity says that nothing strains across a free face. A bar's waves do not mind; a beam surrounded by such ghosts is
11 and 33 % too fast at fifteen rows (height 0.1 and 0.05 m of length 0.5), and with gradients of the particles alone, ghosts
acting by their stress, it creates energy within some hundred steps. So only bars have them.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
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
def image_struct(space: Space) -> type:
    """Struct of the ghosts as kernels take them: `count` particles come before them; source, face, sign and held (g,)
    int32."""
    integers = wp.array(dtype=wp.int32)
    annotations = {"count": int, "source": integers, "face": integers, "sign": integers, "held": integers}
    return wp.struct(type("Images", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def _move_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Displacements and velocities of particles and ghosts, over both."""
    real, Fields, Images = space.scalar, fields_struct(space, layout), image_struct(space)

    @kernel()
    def move(images: Images, fields: Fields, others_out: Fields):
        e = wp.tid()
        if e < images.count:
            others_out.velocity[e] = fields.velocity[e]
            others_out.displacement[e] = fields.displacement[e]
            return
        g = e - images.count
        v = fields.velocity[images.source[g]]
        u = fields.displacement[images.source[g]]
        if images.held[g] != 0:
            v = real(2.0) * fields.velocity[images.face[g]] - v
            u = real(2.0) * fields.displacement[images.face[g]] - u
        others_out.velocity[e] = v
        others_out.displacement[e] = u

    return move


@cache
def _stress_kernel(space: Space) -> wp.Kernel:
    """The ghosts' stress, volume times P, over the ghosts."""
    real, vec, mat, Images = space.scalar, space.vec, space.mat, image_struct(space)

    @kernel()
    def stress(images: Images, step: real, loads: wp.array(dtype=vec), stress_out: wp.array(dtype=mat)):
        g = wp.tid()
        s = stress_out[images.source[g]]
        if images.held[g] == 0:
            # A load is a force; stresses come times the volume.
            s[0, 0] = real(2.0) * real(images.sign[g]) * step * loads[images.face[g]][0] - s[0, 0]
        stress_out[images.count + g] = s

    return stress


class GhostLayer:
    """The ghosts of a bar on the device."""

    def __init__(
        self, found: Ghosts, space: Space, layout: Layout, count: int, step: float, clock: Clock, arrays: Arrays
    ):
        """`count` particles, `step` the length of a cell, nondimensional."""
        self._space, self._clock, self._step = space, clock, space.scalar(step)
        self._images = image_struct(space)()
        self._images.count = count
        for name in ("source", "face", "sign", "held"):
            setattr(self._images, name, arrays.of(name, getattr(found, name).astype(np.int32), wp.int32))
        self._ghosts, self._everyone = len(found.source), np.concatenate([np.arange(count), found.source])
        counts = {name: 1 for name in dict(layout) if name not in ("velocity", "displacement")}
        self.state = State(space, len(self._everyone), layout, clock.device, counts=counts)
        arrays.take("state", self.state.buffer)
        self._move = _move_kernel(space, layout)

    def joined(self, values: np.ndarray) -> np.ndarray:
        """Values of particles, (n, ...), with those of the ghosts' sources behind them."""
        return values[self._everyone]

    def follow(self, state: State) -> Any:
        """The fields of particles and ghosts in a state, as kernels take them (a launch)."""
        self._clock.launch(self._move, len(self._everyone), [self._images, state.struct], [self.state.struct])
        return self.state.struct

    def answer(self, loads: wp.array, corrected: wp.array) -> None:
        """Stresses of the ghosts, from those of the particles (a launch)."""
        self._clock.launch(_stress_kernel(self._space), self._ghosts, [self._images, self._step, loads], [corrected])
