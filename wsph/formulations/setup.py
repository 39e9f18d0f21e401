"""What a body is built from, and what a formulation can do."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.geometry.lattice import Lattice
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.units import Scales


@dataclass(frozen=True)
class Traits:
    """What a formulation can do, and what a run has to do for it."""

    takes: tuple[str, ...] = ()
    """Parts of a body that it takes, by their keys, beside damping."""
    needs_rate: bool = False
    """Whether a material has to give a rate law."""
    maps: bool = False
    """Whether cells may differ in size and direction."""
    splits_cracks: bool = False
    """Whether cracks part the particles on them, and so have to run along lines of the grid."""
    pairs_follow: bool = False
    """Whether pairs follow the motion on the host: `System.follow` before every step."""
    courant_follows: bool = False
    """Whether a particle's own Courant number follows its deformation."""
    measures: bool = False
    """Whether its limit is found from its right-hand sides, and can be found again about a deformed state."""
    tried: bool = False
    """Whether the guard tries the step of a jittered body for modes that grow: collocation can have some."""
    clumps: bool = False
    """Whether modes of neighbouring particles can grow about a stretched state."""
    pushable: bool = False
    """Whether interactions between bodies may change the velocities of its particles between steps."""


@dataclass(frozen=True)
class Setup:
    """What a body is built from."""

    scene: Scene
    body: Body
    lattice: Lattice
    space: Space
    constitutive: Constitutive
    scales: Scales
    clock: Clock
    displacement: bool
    """Whether a probe or a frame asks for displacements."""

    @property
    def device(self) -> str:
        """The Warp device that the body lives on."""
        return self.clock.device


@dataclass(frozen=True)
class Formulation:
    """A formulation by its name, for integrators of one or two `sets` of particles."""

    name: str
    sets: int
    traits: Traits
    build: Callable[[Setup], Any]
