"""A body as its surface sees it."""

# pyright: strict

from typing import Protocol

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.constitutive.constitutive import Constitutive
from wsph.geometry.geometry import Geometry
from wsph.protocols import Traits
from wsph.sph.pairs import Pairs
from wsph.units import Scales


class SurfacedForm(Protocol):
    """How a body's forces are found, as far as its surface asks."""

    @property
    def averaged(self) -> bool:
        """Whether gradients are averaged over the edges of the cells."""
        ...


class SurfacedSystem(Protocol):
    """The system of a body that can have a surface: its particles are the nodes or the cells of its geometry. All
    nondimensional but for `position` (n, dim) and `spacing` [m]."""

    @property
    def space(self) -> Space: ...

    @property
    def clock(self) -> Clock: ...

    @property
    def scales(self) -> Scales: ...

    @property
    def geometry(self) -> Geometry: ...

    @property
    def traits(self) -> Traits: ...

    @property
    def constitutive(self) -> Constitutive: ...

    @property
    def form(self) -> SurfacedForm: ...

    @property
    def spacing(self) -> float: ...

    @property
    def position(self) -> np.ndarray: ...

    @property
    def volume(self) -> np.ndarray: ...

    @property
    def density(self) -> float: ...

    @property
    def state(self) -> State: ...

    @property
    def free_components(self) -> np.ndarray:
        """1 where a component of the velocity is free, 0 where it is prescribed, (n dim,)."""
        ...

    @property
    def breaks(self) -> bool:
        """Whether the body can break."""
        ...

    @property
    def neighbours(self) -> Pairs:
        """The particles that each is joined to."""
        ...

    @property
    def breakable_weights(self) -> Array | None:
        """Weights of the `neighbours`, zero where a pair has broken; None where none can."""
        ...
