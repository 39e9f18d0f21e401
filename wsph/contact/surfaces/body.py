"""A body as its surface sees it."""

# pyright: strict

from collections.abc import Mapping
from typing import Protocol

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.contact.touched import TouchedSystem
from wsph.geometry.geometry import Geometry
from wsph.parts.part import Attached
from wsph.protocols import Traits


class SurfacedForm(Protocol):
    """How a body's forces are found, as far as its surface asks."""

    @property
    def averaged(self) -> bool:
        """Whether gradients are averaged over the edges of the cells."""
        ...


class SurfacedSystem(TouchedSystem, Protocol):
    """The system of a body that can have a surface: its particles are the nodes or the cells of its geometry."""

    @property
    def space(self) -> Space: ...

    @property
    def clock(self) -> Clock: ...

    @property
    def geometry(self) -> Geometry: ...

    @property
    def traits(self) -> Traits: ...

    @property
    def form(self) -> SurfacedForm: ...

    @property
    def attached(self) -> Mapping[str, Attached]:
        """Its parts on the device, by their keys."""
        ...

    @property
    def breaks(self) -> bool:
        """Whether the body can break."""
        ...
