"""The setup of a body, from which a formulation builds its system."""

# pyright: strict

from dataclasses import dataclass

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.geometry.lattice import Lattice
from wsph.parts.part import Host
from wsph.plugins.formulations import Formulation
from wsph.protocols import Traits
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.units import Scales


@dataclass(frozen=True)
class Setup:
    """The scene, the body and all that a formulation builds a system from."""

    scene: Scene
    body: Body
    formulation: Formulation
    lattice: Lattice
    space: Space
    constitutive: Constitutive
    scales: Scales
    clock: Clock
    displacement: bool
    """Whether a probe or a frame asks for displacements, or for a density that follows from them."""

    @property
    def device(self) -> str:
        """The Warp device that the body lives on."""
        return self.clock.device

    @property
    def traits(self) -> Traits:
        """The traits of its formulation."""
        return self.formulation.traits

    @property
    def host(self) -> Host:
        """The body as its parts see it."""
        run, parts = self.scene.run, self.body.parts
        own = [part.support for part in parts.values() if part.support is not None]
        return Host(
            self.body.name,
            self.space,
            self.scales,
            self.lattice,
            self.constitutive,
            self.traits,
            run.correction,
            run.kernel,
            run.support or (own[0] if own else self.traits.support),
            not self.traits.pairwise or self.body.placement == "nodes",
            parts,
        )
