"""The setup of a body, from which a formulation builds its system."""

# pyright: strict

from dataclasses import dataclass

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, on_grid
from wsph.parts.part import Host
from wsph.plugins.formulations import Formulation
from wsph.protocols import Traits
from wsph.scene.geometries import support_of
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.units import Scales


@dataclass(frozen=True)
class Setup:
    """The scene, the body and all that a formulation builds a system from; `geometry`, the body cut into cells."""

    scene: Scene
    body: Body
    formulation: Formulation
    geometry: Geometry
    space: Space
    constitutive: Constitutive
    scales: Scales
    clock: Clock
    displacement: bool
    """Whether a probe or a frame asks for displacements, or for a density that follows from them."""

    @property
    def boundaries(self) -> dict[int, str]:
        """The boundaries of the body that hold or load it, by their numbers in the scene, with their names."""
        own = [each.body == self.body.name and each.periodic is None for each in self.scene.boundary]
        return {k: name for k, name in enumerate(self.scene.boundary_names) if own[k]}

    @property
    def lattice(self) -> Lattice:
        """Its geometry, of a body that the lines of a grid cut."""
        return on_grid(self.geometry)

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
        run, edges = self.scene.run, self.along_edges
        return Host(
            self.body.name,
            self.space,
            self.scales,
            self.geometry,
            self.constitutive,
            self.traits,
            run.correction,
            run.kernel,
            support_of(self.scene, self.body, self.formulation),
            not self.traits.pairwise or self.body.placement == "nodes" or edges,
            edges,
            self.at_corners,
            self.body.parts,
            self.body.initial is not None and bool(self.body.initial.stress),
        )

    @property
    def at_corners(self) -> bool:
        """Whether points see the corners of their own cells alone: by default, where they have places of their own. A scene
        that names a support or a kernel asks for a kernel's pairs."""
        return self.traits.corners and not self.scene.run.kernel_by

    @property
    def along_edges(self) -> bool:
        """Whether particles stand on the faces, with pairs along the edges of the cells: by default, where the formulation
        can. A scene that names a support or a kernel asks for a kernel's pairs; parts that need every direction, cracks and
        contact between balls take them too."""
        run, placement = self.scene.run, self.body.placement
        if (
            not self.traits.edges
            or placement == "cells"
            or self.geometry.cracks
            or not isinstance(self.geometry, Lattice)
        ):
            return False
        if run.kernel_by or run.correction == "paper":
            return False
        if any(part.acts and part.every_direction for part in self.body.parts.values()):
            return False
        return placement == "nodes" or self.body.name not in self.scene.balls
