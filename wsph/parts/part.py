"""The contract of a body's optional parts.

A part is one file. Its class is its table in a scene, and it adds to a body by the methods that it overrides: refusals,
fields of the state, terms in the loops over pairs, and an `Attached` on the device, which closes a step and has entries on
the ledger. A method that is not overridden adds nothing, and a body without the part pays nothing.
"""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.space import Array, Space
from wsph.backend.state import Field, State
from wsph.constitutive.constitutive import Constitutive
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, on_grid
from wsph.parts.terms import PairTerm, Points, RateTerm, Response, StressTerm
from wsph.protocols import Entry, Traits
from wsph.quantities import Model
from wsph.ranks.kept import Rows
from wsph.sph.pairs import Pairs
from wsph.sph.smoothing import SUPPORT
from wsph.units import Scales


@dataclass(frozen=True)
class Host:
    """The body that a part belongs to, as the part sees it. `correction`, `smoothing` and `support` [spacings] are those of
    the run; `parts` the body's own by their keys; `at_nodes`: whether particles are the lattice's nodes; `edges`: whether
    pairs are the edges of its cells, and no kernel's; `corners`: whether points see the corners of their own cells, and no
    kernel's; `stressed`: whether it begins with a stress."""

    name: str
    space: Space
    scales: Scales
    geometry: Geometry
    constitutive: Constitutive
    traits: Traits
    correction: str
    smoothing: str
    support: float
    at_nodes: bool
    edges: bool
    corners: bool
    parts: "Mapping[str, Part]"
    stressed: bool = False

    @property
    def lattice(self) -> Lattice:
        """Its geometry, of a body that the lines of a grid cut."""
        return on_grid(self.geometry)

    @property
    def youngs_modulus(self) -> float:
        """[Pa]"""
        return self.constitutive.youngs_modulus

    @property
    def smoothing_length(self) -> float:
        """h of the kernel [m], or of points that see the corners of their own cells the size of those."""
        return self.geometry.size if self.corners else self.support / SUPPORT * self.geometry.spacing

    @property
    def locks(self) -> bool:
        """Whether its volume is so hard to change that one constraint a particle would lock it: in two and three
        dimensions, without free normals, from a Poisson's ratio of LOCKING on."""
        bulk, shear = self.constitutive.material.moduli()
        ratio = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)
        return self._confined and ratio >= LOCKING

    @property
    def flows(self) -> bool:
        """Whether its law can flow, and change its shape alone, where nothing frees the volume."""
        return self._confined and self.constitutive.laws.dissipates

    @property
    def _confined(self) -> bool:
        return self.space.dim > 1 and not self.constitutive.state.free

    @property
    def breaks(self) -> bool:
        """Whether the body can break."""
        return any(part.breaks for part in self.parts.values())


@dataclass(frozen=True)
class Parts:
    """The `points` and `particles` that a process of a `domain` has of a body's."""

    domain: Domain
    points: Share
    particles: Share

    @classmethod
    def whole(cls, points: int, particles: int) -> "Parts":
        """All of them."""
        return cls(WHOLE, Share.all(points), Share.all(particles))

    def rows(self) -> tuple[Rows, Rows]:
        """Where points and particles stand in those of all processes."""
        return Rows.of(self.points), Rows.of(self.particles)


@dataclass(frozen=True)
class Neighbourhood:
    """Points of a body and the particles that they see, on the device and nondimensional: m points, n particles.

    pairs, weight      # from points to particles; (pairs,)
    points             # struct of the points' own arrays (`wsph.parts.terms.points_struct`)
    mean               # mean displacement of a point's particles, (m,) vec, where points have places of their own
    gradient           # displacement gradient as pairs see it, (m,) mat
    spread, volume     # sum w r^2 (m,), volumes of points (m,), on the host
    position           # of the particles, on the host, (n, dim) [m]
    split              # the parts of the body's points and particles that they are
    back, back_weight  # pairs from particles to points, where points have places of their own
    """

    pairs: Pairs
    weight: Array
    points: Points
    mean: Array
    gradient: Array
    spread: np.ndarray
    volume: np.ndarray
    position: np.ndarray
    split: Parts
    back: Pairs | None = None
    back_weight: Array | None = None


LOCKING = 0.45
"""Poisson's ratio from which a constraint of the volume at every particle locks a body: cantilevers of four to eight rows
are 7, 13 and 41 % too stiff at 0.49, 0.499 and 0.4999 by a kernel's pairs."""

BROKEN = 0.95
"""Damage above which a point counts as broken, and its deformation is ignored."""


class Attached:
    """A part on the device, for one body."""

    ledger: tuple[Entry, ...] = ()
    """Its entries of the energy ledger."""
    limit: float = np.inf
    """The longest time step that it can take, nondimensional."""
    response: object = None
    """The struct that its `Response` takes and writes."""
    share: Array | None = None
    """The points' shares (m,) where the part reduces them, or None."""
    weight: Array | None = None
    """Weights of the pairs (pairs,), zero for broken ones, where pairs can break, or None."""
    damage: Array | None = None
    """Damage of the points at the end of the last step, (m,), that a run goes on from, where they can break, or None."""

    def rate(self, state: State, out: State) -> None:
        """Write the time derivatives of its own fields (launches)."""

    def advance(self) -> None:
        """Close a step (launches)."""

    def rows(self) -> dict[str, Rows]:
        """Where what it keeps stands in what all processes keep, by the names of its arrays."""
        return {}

    def restored(self) -> None:
        """Recompute whatever depends on the kept arrays, after a checkpoint has put them back."""

    def fracture(self) -> dict[str, float]:
        """Figures of the fracture that it caused, by name, energies nondimensional; empty where it breaks nothing."""
        return {}


class Part(Model):
    """Base of the parts' tables. Every default here adds nothing."""

    key: ClassVar[str] = ""
    """Its key in a body of a scene."""
    switchable: ClassVar[bool] = False
    """Whether it is there by default, and `false` takes it away."""
    breaks: ClassVar[bool] = False
    """Whether the body can break by it: its state then carries a damage."""
    frees: ClassVar[bool] = False
    """Whether particles may lose all of their neighbours."""
    offers: ClassVar[tuple[str, ...]] = ()
    """Fields of its own that frames and probes can have."""
    holds_modes: ClassVar[bool] = False
    """Whether it holds spurious modes."""
    support: ClassVar[float | None] = None
    """Support that a body with it has where the scene names none [spacings]."""
    formal: ClassVar[int] = 2
    """The order in the spacing that a smooth motion can have with it: 1 where it scales with the spacing itself."""

    @property
    def acts(self) -> bool:
        """Whether it does anything: a part that is switched off adds nothing."""
        return True

    @property
    def every_direction(self) -> bool:
        """Whether it takes pairs in every direction, a kernel's, where the edges of the cells would be too few."""
        return self.breaks or self.support is not None

    @property
    def attaches(self) -> bool:
        """Whether it may have something of its own on the device."""
        return type(self).attach is not Part.attach

    @property
    def selections(self) -> dict[str, str]:
        """Its keys that select particles by an expression."""
        return {}

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        """Whether a formulation can take it."""
        return traits.one_set

    def refuse(self, host: Host) -> None:
        """Raise Refused for what it cannot do on this body."""

    def warning(self, host: Host) -> str:
        """A warning to whoever uses it on this body, or "" for none."""
        return ""

    def fields(self, host: Host) -> tuple[Field, ...]:
        """Fields that it adds to the state."""
        return ()

    def coefficients(self, host: Host) -> dict[str, float]:
        """Numbers that its terms take, nondimensional, by the names that the terms give them."""
        return {}

    def pair_term(self, host: Host) -> PairTerm | None:
        """A force between particles that are their own points."""
        return None

    def stress_term(self, host: Host) -> StressTerm | None:
        """A stress that the stress of a point calls forth."""
        return None

    def rate_term(self, host: Host) -> RateTerm | None:
        """A stress that the velocity gradient calls forth, at points with places of their own."""
        return None

    def response(self, host: Host) -> Response | None:
        """The answer of a point in place of its law, or None."""
        return None

    def attach(self, host: Host, seen: Neighbourhood, state: State, clock: Clock, arrays: Arrays) -> Attached | None:
        """Put the part on the device; None where it has nothing there. Evaluations write its fields to `state`; its arrays
        are registered in `arrays`."""
        return None
