"""The contract of the right-hand sides of a one-set body, as its system calls them."""

# pyright: strict

from typing import Protocol

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array, Space, Struct
from wsph.backend.state import State
from wsph.formulations.lagrangian.form import Form
from wsph.parts.body_force import weightless
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


class ReferenceRates:
    """Right-hand sides in the reference configuration."""

    _unloaded: tuple[object, Array] | None = None

    def _alone(self, force: Struct, arrays: Arrays, count: int, space: Space) -> tuple[object, Array]:
        """Inertia and loads for the forces of the body alone: without gravity, damping and loads; made when they are first
        asked for."""
        if self._unloaded is None:
            self._unloaded = weightless(force, space), arrays.zeros("unloaded", 2 * count, space.vec)
        return self._unloaded

    def follow(self) -> bool:
        """Nothing here follows the motion."""
        return False

    def placed(self) -> None:
        """Nothing here follows where particles are."""

    def restored(self) -> None:
        """Nothing to recompute: the next evaluation does."""


def refuse_other(state: State) -> None:
    """Raise RuntimeError where the derived fields, which the rate of the rest takes, are of another state."""
    if state.derived is not None and state.derived.of is not state:
        raise RuntimeError(
            'rate(state, out, "rest") takes the deformation that the last rate of the velocity of the same state found;'
            " that was of another state"
        )
