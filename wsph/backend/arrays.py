"""Device arrays by name: their memory, what a checkpoint keeps and what a trial has to undo follow from the names.

Whoever allocates an array that outlives a call asks its `Arrays` for it, so that none is left out of any of the three.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp
from warp._src.codegen import StructInstance

from wsph.backend.space import Array
from wsph.protocols import DeviceArray


def host(array: DeviceArray) -> np.ndarray:
    """The numbers of an array, on the host; on the CPU a view of them."""
    return array.numpy()


def put(array: DeviceArray, numbers: np.ndarray) -> None:
    """Overwrite an array with numbers of the host."""
    array.assign(numbers)


def changed(array: Array, numbers: np.ndarray) -> None:
    """Have an array have its own numbers on the host, which have been changed there."""
    if array.device is not None and not array.device.is_cpu:
        array.assign(numbers)


@dataclass(frozen=True)
class Named:
    """A device array. `kept`: a run continues from it; `reset` makes it as it was at the start, where a trial changes it."""

    array: Array
    kept: bool
    reset: Callable[[], None] | None


class Arrays:
    """The device arrays of a body or of an interaction. A `part` shares the register, under a name of its own."""

    def __init__(self, device: str, known: dict[str, Named] | None = None, prefix: str = ""):
        self.device = device
        self._known: dict[str, Named] = {} if known is None else known
        self._prefix = prefix

    def part(self, name: str) -> "Arrays":
        """The same register for a part: its names begin with "`name`."."""
        return Arrays(self.device, self._known, f"{self._prefix}{name}.")

    def take(self, name: str, array: Array, *, kept: bool = False, reset: Callable[[], None] | None = None) -> Array:
        """Register an array, in place of any that had the name before."""
        self._known[self._prefix + name] = Named(array, kept, reset)
        return array

    def zeros(self, name: str, n: int | tuple[int, ...], dtype: type, *, kept: bool = False) -> Array:
        """A new array of zeros, zero again after a trial. `kept`: a run goes on from it."""
        array = wp.zeros(n, dtype=dtype, device=self.device)
        return self.take(name, array, kept=kept, reset=array.zero_)

    def of(self, name: str, values: np.ndarray | list[float], dtype: type) -> Array:
        """A new array of values that do not change."""
        return self.take(name, wp.array(values, dtype=dtype, device=self.device))

    def changes(self, name: str, array: Array) -> Array:
        """Register an array whose values at the start are not zero, and which a run changes and goes on from."""
        start = array.numpy().copy()
        return self.take(name, array, kept=True, reset=lambda: array.assign(start))

    def adopt(self, holder: object, kept: dict[str, Array] | None = None) -> None:
        """Register every array that an object holds, in its structs and lists too; a run goes on from those `kept`."""
        goes_on = {id(array) for array in (kept or {}).values()}
        held = {name: value if isinstance(value, list) else [value] for name, value in vars(holder).items()}
        for name, value in ((name, value) for name, values in held.items() for value in values):
            if isinstance(value, wp.array):
                self._adopted(name, value, id(value) in goes_on)
            elif isinstance(value, StructInstance):
                self.part(name).adopt(value, kept)

    def _adopted(self, name: str, array: Array, kept: bool) -> None:
        # Views of other arrays are theirs.
        if array.deleter is not None:
            self.take(name, array, kept=kept)

    def __getitem__(self, name: str) -> Array:
        """The array of a name."""
        return self._known[self._prefix + name].array

    @property
    def nbytes(self) -> int:
        """Device memory of all of them [bytes]."""
        owned = (each.array for each in self._known.values() if each.array.deleter is not None)
        return sum({id(array): array.capacity for array in owned}.values())

    @property
    def kept(self) -> dict[str, Array]:
        """Those that a run goes on from, by name."""
        return {name: each.array for name, each in self._known.items() if each.kept}

    def reset(self) -> None:
        """Undo a trial: every array that steps change as it was at the start."""
        for each in self._known.values():
            if each.reset is not None:
                each.reset()
