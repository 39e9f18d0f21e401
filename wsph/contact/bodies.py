"""Bodies that others can push, as what acts between them sees them."""

# pyright: strict

from typing import Protocol, cast

import numpy as np

from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.constitutive.constitutive import Constitutive
from wsph.protocols import PushedBody
from wsph.sph.pairs import Pairs
from wsph.units import Scales


class PushedSystem(Protocol):
    """The system of a body whose formulation is `pushable`. Nondimensional but for `position` and `spacing` [m]."""

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


def pushed(run: PushedBody) -> PushedSystem:
    """The system of a body whose traits say that it is pushable."""
    return cast(PushedSystem, run.system)
