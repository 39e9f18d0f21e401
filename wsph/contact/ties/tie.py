"""A tie: two surfaces glued together by springs, which break where they are to have a strength.

Vertices of the finer body (of the first, where both are as fine) within half a spacing of the other's surface keep the point
of it that is nearest and the gap to it, in the frame of the face. Springs of K eps A against what changes of it, in all
directions and of both signs: eps = 1/(h_1/(2 M_1) + h_2/(2 M_2)), M = rho c^2, h spacings, A the area of the faces around
the vertex that look at the other body. So a tie gives way like 1/K of half a cell of each body: of a wave of wave number k
it reflects about k (h_1 + h_2)/(4 K) of the amplitude, on bodies of one material.

Processes that share the bodies each find the bonds that their particles hang on, whatever bond that may be of others too, so
that there is nothing to tell; of all each keeps an equal part, which it finds in any case.

A bond whose traction is above `strength` at the end of a step is broken from then on, and what it held is dissipated; so is
one whose vertex or face has gone with cells that died.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false, reportAttributeAccessIssue=false

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.space import Array, Space
from wsph.contact.meeting.dealt import Dealt
from wsph.contact.meeting.structs import candidates_struct
from wsph.contact.surfaces.laws import Ground, Law
from wsph.contact.surfaces.surface import Surface
from wsph.contact.ties.bonds import Bonds, bonds_between
from wsph.contact.ties.kernels import answer_kernel, bonds_struct, part_kernel, pull_kernel
from wsph.errors import Refused
from wsph.scene.scene import Scene
from wsph.scene.touch.contact import Contact
from wsph.units import Scales

STIFFER, STIFFEST = 4.0, 10.0
"""Stiffness of a tie over that of contacts in the same step, and the most: it is there all the time, so that what it gives
way shows more; beyond the most little is gained."""


class Tie(Law):
    """A tie of a scene, as a law between two surfaces."""

    def __init__(
        self,
        part: Contact,
        one: Surface,
        other: Surface,
        space: Space,
        scales: Scales,
        clock: Clock,
        domain: Domain = WHOLE,
    ):
        """Raises Refused where no vertex is near enough to be glued."""
        self.name, self._part, self._space, self._clock = part.name, part, space, clock
        self._sides = (other, one) if other.spacing < one.spacing * (1.0 - 1e-9) else (one, other)
        own, far = self._sides
        found = bonds_between(own.mesh, far.mesh, max(own.spacing, far.spacing) * scales.length)
        if found.count == 0:
            raise Refused(
                f"contact {part.name!r}: no vertex of body {own.name!r} is within half a spacing of the surface of {far.name!r}"
                " and faces it: a tie has nothing to hold; let them touch"
            )
        self.bonds = found
        self._give = 0.5 * own.spacing / own.modulus + 0.5 * far.spacing / far.modulus
        self.stiffness = (part.number or STIFFER) / self._give
        self._strength = space.scalar((part.strength or 0.0) / scales.stress)
        self._area = found.area / scales.length ** (space.dim - 1)
        self._gap = found.gap / scales.length
        self._square = self._unit_square()
        count, device = found.count, clock.device
        self._dealt = Dealt(count, clock, domain)
        self._dealt.deal(np.arange(count))
        self._struct, self._rows = self._on_device(found)
        self._corner: Array = wp.zeros((count, space.dim), dtype=space.vec, device=device)
        self._stored: Array = wp.zeros(count, dtype=wp.float64, device=device)
        self._lost: Array = wp.zeros(count, dtype=wp.float64, device=device)
        self._traction: Array = wp.zeros(count, dtype=space.scalar, device=device)

    def _on_device(self, found: Bonds) -> tuple[Any, Any]:
        space, device = self._space, self._clock.device
        bonds, rows = bonds_struct(space)(), candidates_struct()()
        bonds.vertex = wp.array(found.vertex, dtype=wp.int32, device=device)
        bonds.corners = wp.array(found.corners, dtype=wp.int32, device=device)
        bonds.weights = wp.array(found.weights, dtype=space.vec, device=device)
        bonds.gap = wp.array(self._gap, dtype=space.vec, device=device)
        bonds.area = wp.array(self._area, dtype=space.scalar, device=device)
        bonds.whole = wp.ones(found.count, dtype=wp.int32, device=device)
        own, far = self.sides
        needed = own.here[found.vertex] | far.here[found.corners].any(1)
        needed[self._dealt.own] = True
        self._found = np.flatnonzero(needed)
        self._which: Array = wp.array(self._found, dtype=wp.int32, device=device)
        which, offsets, indices = found.answers(far.here)
        for name, values in (("which", which), ("offsets", offsets), ("indices", indices)):
            setattr(rows, name, wp.array(values, dtype=wp.int32, device=device))
        return bonds, rows

    @property
    def sides(self) -> tuple[Surface, Surface]:
        """That of the vertices, and that of the faces."""
        return self._sides

    @property
    def searches(self) -> bool:
        """What is glued stays so."""
        return False

    def near(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Rows of the vertices and of the faces that its kernels read or write, by the bodies' names."""
        none, found = np.zeros(0, np.int64), self._found
        own, far = self.sides
        return {own.name: (self.bonds.vertex[found], none), far.name: (self.bonds.corners[found].ravel(), none)}

    def act(self) -> None:
        """Add its forces to those of the surfaces (launches)."""
        (own, far), launch = self.sides, self._clock.launch
        inputs = [self._which, self._space.scalar(self.stiffness), self._struct, own.struct, far.struct]
        outputs = [own.force, self._corner, self._stored, self._traction]
        if len(self._found):
            launch(pull_kernel(self._space), len(self._found), inputs, outputs)
        if len(self._rows.which):
            launch(answer_kernel(self._space), len(self._rows.which), [self._rows, self._corner], [far.force])

    def close(self) -> None:
        """Break what was pulled too hard in the last evaluation (a launch, of a tie with a strength)."""
        if self._part.strength is not None:
            outputs = [self._struct.whole, self._stored, self._lost]
            inputs = [self._strength, self._traction]
            self._clock.launch(part_kernel(self._space), self.bonds.count, inputs, outputs)

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness where the scene leaves it open; whether it does."""
        if self._part.number is None:
            self.stiffness = min(STIFFER * stiffness, STIFFEST) / self._give
        return self._part.number is None

    def bound(self, surface: Surface) -> tuple[float, float]:
        """A bound of the square of the frequency that it adds to each of the two bodies, whose relative motion sees the
        masses of both; it damps nothing."""
        return self.stiffness * self._square, 0.0

    def _unit_square(self) -> float:
        """The bound of a stiffness of 1."""
        own, far = self.sides
        at_own, at_far = np.zeros(own.n), np.zeros(far.n)
        at_own[self.bonds.vertex] = self._area
        # (sum |J_c| x_c)^2 <= sum |J_c| times sum |J_c| x_c^2, J_c of the weights and of what turns the gap.
        share = self.bonds.weights + self.bonds.turning[:, None]
        np.add.at(at_far, self.bonds.corners, share * (share.sum(1) * self._area)[:, None])
        return own.square(at_own) + far.square(at_far)

    def renew(self, surface: Surface, rows: np.ndarray) -> None:
        """A surface was remade: `rows` (old n,) are those of its old vertices, -1 where they are gone."""
        found, own = self.bonds, surface is self.sides[0]
        vertex = rows[found.vertex] if own else found.vertex
        corners = found.corners if own else rows[found.corners]
        gone = (vertex < 0) | (corners < 0).any(1)
        if not own:
            there = {tuple(face) for face in np.sort(surface.mesh.faces, 1).tolist()}
            gone |= np.array([tuple(face) not in there for face in np.sort(corners, 1).tolist()])
        self._break(gone)
        # What is gone holds nothing and pulls nothing, wherever it is.
        self.bonds = replace(found, vertex=np.where(gone, 0, vertex), corners=np.where(gone[:, None], 0, corners))
        whole = self._struct.whole
        self._struct, self._rows = self._on_device(self.bonds)
        self._struct.whole = whole

    def _break(self, gone: np.ndarray) -> None:
        self._dealt.gather(self._struct.whole, self._stored, self._lost)
        whole, stored, lost = (np.array(each.numpy()) for each in (self._struct.whole, self._stored, self._lost))
        lost[gone] += stored[gone]
        stored[gone], whole[gone] = 0.0, 0
        for array, values in ((self._struct.whole, whole), (self._stored, stored), (self._lost, lost)):
            array.assign(values)

    @property
    def pushes(self) -> list[tuple[Array, float]]:
        """The forces on the corners of the far faces, with the factor of the first body's."""
        return [(self._corner.flatten(), 1.0 if self.sides[1].name == self._part.names[0] else -1.0)]

    @property
    def energies(self) -> list[Array]:
        """What is stored and dissipated, by bond."""
        return [self._stored, self._lost]

    @property
    def stored(self) -> float:
        """Energy of the springs now, nondimensional."""
        return self._dealt.total(self._stored)

    @property
    def dissipated(self) -> float:
        """Energy that was in bonds when they broke, so far, nondimensional."""
        return self._dealt.total(self._lost)

    def force(self, surface: Surface) -> np.ndarray:
        """The sum of its forces on one of the two surfaces at the last evaluation, nondimensional (dim,)."""
        self.gather()
        on_far = self._corner.numpy().sum((0, 1), dtype=np.float64)
        return on_far if surface is self.sides[1] else -on_far

    @property
    def broken(self) -> int:
        """The number of broken bonds."""
        self._dealt.gather(self._struct.whole)
        return int((self._struct.whole.numpy() == 0).sum())

    def kept(self) -> dict[str, Array]:
        """What a run goes on from, by name."""
        return {"whole": self._struct.whole, "stored": self._stored, "lost": self._lost}

    def shares(self) -> dict[str, Share]:
        """The parts of these that this process has."""
        return self._dealt.shares(list(self.kept()))

    def gather(self) -> None:
        """Have `pushes` and `energies` of all processes (on the host)."""
        self._dealt.gather(self._corner, self._stored, self._lost)


def ties(scene: Scene, surface_of: Callable[[str], Surface], ground: Ground) -> list[Tie]:
    """The ties of a scene."""
    return [
        Tie(
            part,
            surface_of(part.names[0]),
            surface_of(part.names[1]),
            ground.space,
            ground.scales,
            ground.clock,
            ground.domain,
        )
        for part in scene.contact
        if part.law == "tie"
    ]
