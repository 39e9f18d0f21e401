"""What frames, probes and judgements read of a body of two sets."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cached_property

import numpy as np

from wsph.backend.arrays import host
from wsph.backend.domain import any_of
from wsph.boundary.conditions import Conditions
from wsph.formulations.system import System
from wsph.formulations.taylor.judgement import closed, turned
from wsph.formulations.taylor.part import Part
from wsph.sph.around import Around
from wsph.sph.averages import OUTWARDS, Averages, average, outward_weights, ranges
from wsph.sph.second_order import between
from wsph.sph.weights import Weights


class TwoSetReading(System):
    """A body of two sets as others read it, of which its system tells `conditions` and the weights of interpolation and of
    gradient from the real to the virtual particles, `to_virtual`, and back, `to_real`. Of a body that processes share all
    of them read displacements and densities together."""

    conditions: Conditions
    _support: float
    _part: Part
    _parted: tuple[np.ndarray, np.ndarray, np.ndarray] | None
    _around: Around | None = None

    @property
    def to_virtual(self) -> tuple[Weights, Weights]:
        """Weights of interpolation and of gradient, nondimensional, from the real to the virtual particles."""
        raise NotImplementedError

    @property
    def to_real(self) -> tuple[Weights, Weights]:
        """Those from the virtual to the real particles."""
        raise NotImplementedError

    def filtered(self, name: str) -> np.ndarray:
        """A field of the real particles without its odd-even part, which the virtual particles do not see: averaged to the
        virtual ones and back, particles on a face as they are. (n, width), nondimensional.

        A displacement is extrapolated to the faces where nothing prescribes it: a corner that a load pulls at drifts, by a
        quarter of the displacement of a pulled sheet of `ul-tsph` where this is within 0.6 %. In smooth waves the average
        and the values as they are have errors of the same size.
        """
        values = self.state.read(name)
        if name == "displacement":
            back = self._outward(self.at_virtual(name))
            for (field, component), held in self.conditions.entries.items():
                if field == "velocity":
                    back[list(held), component] = values[list(held), component]
            return back
        to_virtual, to_real = self.to_virtual[0], self.to_real[0]
        back = average(to_real, average(to_virtual, values))
        if self.state.bounded(name):
            back = np.clip(back, *ranges(to_real, *ranges(to_virtual, values, values)))
        return np.where(~self.lattice.on_face[:, None], back, values)

    @cached_property
    def _outwards(self) -> Weights:
        return outward_weights(self.lattice, self._outward_support)

    @property
    def _outward_support(self) -> float:
        return max(self._support, OUTWARDS)

    def _outward(self, values: np.ndarray) -> np.ndarray:
        """Values (cells, k) of the virtual particles as they are at the real ones, extrapolated to faces, (n, k)."""
        if self.domain.size == 1:
            return average(self._outwards, values)
        self._around = self._around or Around(self.geometry, self._outward_support)
        return self._around.averaged(values, average)

    def fault(self) -> str:
        """The word for cracks that have closed: their sides do not see each other, and would pass through each other."""
        if self._parted is None or not any_of(self.domain, len(self._parted[0]) > 0):
            return ""
        below, above, axis = self._parted
        u, normal = self.filtered("displacement"), self.lattice.frame.axes.T[axis]
        if "deformation" in self.state.layout:
            dim = self.space.dim
            F = np.eye(dim) + self.state.read("deformation").reshape(-1, dim, dim)[below]
            normal = np.linalg.solve(F.transpose(0, 2, 1), normal[:, :, None])[:, :, 0]
            normal /= np.linalg.norm(normal, axis=1)[:, None]
        own = self.share.owns(below)
        apart = ((u[above] - u[below]) * normal).sum(1)[own]
        return closed(apart, self.position[below[own]], u[self.share.own], self.scales.length, self.domain)

    def current_density(self) -> np.ndarray:
        """Density of every particle, (n,), nondimensional: rho_0/J where it evolves a deformation, in small strain
        rho_0/(1 + tr eps) from the displacements.

        Their gradient is that of the virtual particles, which see whole cells, extrapolated to the faces. Strains along free
        normals, which a stress state drops, are not in it.
        """
        if "deformation" in self.state.layout:
            return super().current_density()
        dilation = self._outward(np.trace(self._strained(), axis1=1, axis2=2)[:, None])[:, 0]
        return self.density / (1.0 + dilation)

    def _strained(self) -> np.ndarray:
        """The gradient of the displacements at the virtual particles, (cells, dim, dim)."""
        weights, gradient = self.to_virtual
        row, indices, g = weights.pairs.rows(), host(weights.pairs.indices), host(gradient.values)
        u = self.state.read("displacement")
        found = np.zeros((weights.pairs.targets, self.space.dim, self.space.dim))
        np.add.at(found, row, (u[indices] - average(weights, u)[row])[:, :, None] * g[:, None, :])
        return found

    def doubt(self) -> str:
        """The words for a body that has turned beyond small strain, where its displacements are kept."""
        if not self.traits.small_strain or self.space.dim == 1 or "displacement" not in self.state.layout:
            return ""
        return turned(self.name, self._strained()[self._part.virtual.own], self.domain)

    def at_virtual(self, name: str) -> np.ndarray:
        """A field interpolated to the virtual particles, (cells, width), nondimensional."""
        return average(self.to_virtual[0], self.state.read(name))

    def at_particles(self, particles: np.ndarray, name: str) -> list[Averages]:
        displacement, width = name == "displacement", self.state.widths[name]
        back = Averages.of(self._outwards if displacement else self.to_real[0]).only(particles)
        back = back.through(Averages.of(self.to_virtual[0]))

        def but(asis: np.ndarray) -> Averages:
            there = np.flatnonzero(asis[particles])
            return back.but(there, Averages.themselves(particles[there]))

        if displacement:
            return [but(held) for held in self.conditions.prescribed("velocity", width, self.count).T]
        return [but(self.lattice.on_face)] * width

    def _between(self, points: np.ndarray, name: str) -> Averages:
        """The virtual particles' field (real averaged to virtual) is interpolated, because an odd-even field at the real
        particles is invisible to the virtual ones."""
        return between(self.lattice, points, at_nodes=False).through(Averages.of(self.to_virtual[0]))
