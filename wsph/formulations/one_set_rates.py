"""The contract of the right-hand sides of a one-set body, as its system calls them."""

# pyright: strict

from typing import Protocol

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.formulations.lagrangian.form import Form
from wsph.parts.part import Attached, Neighbourhood
from wsph.sph.pairs import Pairs


class Rates(Protocol):
    """The right-hand sides of a body, and its pairs."""

    form: Form
    holding: Array
    """Forces per mass that hold spurious modes, of the last evaluation, (n,) vec, where there are any."""

    @property
    def pairs(self) -> int: ...

    @property
    def neighbours(self) -> Pairs: ...

    @property
    def seen(self) -> Neighbourhood | None: ...

    def attach(self, parts: list[Attached]) -> None: ...

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]: ...

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None: ...

    def refresh(self, state: State) -> None: ...

    def held_energy(self, state: State) -> float: ...

    def follow(self) -> bool: ...

    def placed(self) -> None: ...

    def restored(self) -> None: ...
