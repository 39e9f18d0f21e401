"""Numbers that people read off laws between two surfaces: the force on the first, and the work on both."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Protocol

import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.output.fields import AXES
from wsph.reporting import Term

CHUNKS = 64
"""Threads that a sum is spread over, whatever the size of a surface: candidates come and go."""


class Read(Protocol):
    """A law as it is read: `pushes` are arrays of forces, each with the factor that makes their sum that on its first
    surface; `energies` arrays of what it stores and has dissipated, float64."""

    name: str

    @property
    def pushes(self) -> Sequence[tuple[Array, float]]: ...

    @property
    def energies(self) -> Sequence[Array]: ...

    def gather(self) -> None: ...


@cache
def _kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel]:
    dim, module = space.dim, space.module("contact_reading")

    @kernel(module=module)
    def add_forces(force: wp.array(dtype=space.vec), factor: wp.float64, sums_out: wp.array2d(dtype=wp.float64)):
        chunk = wp.tid()
        n = force.shape[0]
        for k in range(n * chunk // wp.static(CHUNKS), n * (chunk + 1) // wp.static(CHUNKS)):
            for a in range(wp.static(dim)):
                sums_out[chunk, a] = sums_out[chunk, a] + factor * wp.float64(force[k][a])

    @kernel(module=module)
    def add_energies(energy: wp.array(dtype=wp.float64), sums_out: wp.array2d(dtype=wp.float64)):
        chunk = wp.tid()
        n = energy.shape[0]
        for k in range(n * chunk // wp.static(CHUNKS), n * (chunk + 1) // wp.static(CHUNKS)):
            sums_out[chunk, dim] = sums_out[chunk, dim] - energy[k]

    return add_forces, add_energies


@cache
def _clear_kernel() -> wp.Kernel:
    @kernel()
    def clear(sums_out: wp.array2d(dtype=wp.float64)):
        chunk = wp.tid()
        for a in range(sums_out.shape[1]):
            sums_out[chunk, a] = wp.float64(0.0)

    return clear


class LawNumbers:
    """The numbers of a law (`wsph.reporting.Reported`): its force on its first surface in the last evaluation, and its work
    on both, less what it stores and has dissipated.

    _sums  # (CHUNKS, dim + 1) float64
    """

    kind = "contact"

    def __init__(self, law: Read, space: Space, clock: Clock):
        self.name, self._law, self._space, self._clock = law.name, law, space, clock
        self._sums: Array = wp.zeros((CHUNKS, space.dim + 1), dtype=wp.float64, device=clock.device)
        width = space.dim + 1
        forces = {f"force_{AXES[a]}": [Term(self._sums, a, CHUNKS, width)] for a in range(space.dim)}
        work = {"work": [Term(self._sums, space.dim, CHUNKS, width)]}
        self.numbers: Mapping[str, Sequence[Term]] = (forces if law.pushes else {}) | work

    def gather(self) -> None:
        """Sum them up, as they are (launches)."""
        self._law.gather()
        add_forces, add_energies = _kernels(self._space)
        self._clock.launch(_clear_kernel(), CHUNKS, [], [self._sums])
        for force, factor in self._law.pushes:
            self._clock.launch(add_forces, CHUNKS, [force, wp.float64(factor)], [self._sums])
        for energy in self._law.energies:
            self._clock.launch(add_energies, CHUNKS, [energy], [self._sums])
