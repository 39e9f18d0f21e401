"""The system of a body as what acts between bodies takes it."""

# pyright: strict

from typing import Protocol

import numpy as np

from wsph.backend.domain import Domain, Share
from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.constitutive.constitutive import Constitutive
from wsph.sph.pairs import Pairs
from wsph.units import Scales


class TouchedSystem(Protocol):
    """The system of a body that others touch, n particles; a body has it whose formulation is `pushable`. Nondimensional but
    for `position` (n, dim) and `spacing` [m]."""

    @property
    def constitutive(self) -> Constitutive: ...

    @property
    def scales(self) -> Scales: ...

    @property
    def spacing(self) -> float: ...

    @property
    def count(self) -> int: ...

    @property
    def position(self) -> np.ndarray: ...

    @property
    def volume(self) -> np.ndarray: ...

    @property
    def density(self) -> float: ...

    @property
    def state(self) -> State: ...

    @property
    def domain(self) -> Domain:
        """The processes that share the body."""
        ...

    @property
    def share(self) -> Share:
        """The part of the particles of the whole body that it has."""
        ...

    @property
    def free_components(self) -> np.ndarray:
        """1 where a component of the velocity is free, 0 where it is prescribed, (n dim,)."""
        ...

    @property
    def neighbours(self) -> Pairs:
        """The particles that each is joined to."""
        ...

    @property
    def breakable_weights(self) -> Array | None:
        """Weights of the `neighbours`, zero where a pair has broken; None where none can."""
        ...
