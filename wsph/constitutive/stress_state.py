"""Stress states: which components a law keeps in 1D, 2D and 3D, and how they are packed."""

import math
from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.backend.space import Space


@dataclass(frozen=True)
class StressState:
    """Stress components that are kept, normals first, and the normals whose stress is zero by the state."""

    name: str
    components: tuple[tuple[int, int], ...]
    free: tuple[int, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """ "xx", "xy", ..."""
        return tuple("xyz"[i] + "xyz"[j] for i, j in self.components)

    def wave_speed(self, bulk: float, shear: float, density: float) -> float:
        """Fastest longitudinal wave: sqrt(E/rho) in uniaxial stress, sqrt(E/(rho (1 - nu^2))) in plane stress,
        sqrt((K + 4G/3)/rho) otherwise."""
        modulus = bulk + 4.0 * shear / 3.0
        if len(self.free) == 2:
            modulus = 9.0 * bulk * shear / (3.0 * bulk + shear)
        elif len(self.free) == 1:
            modulus = 4.0 * shear * (bulk + shear / 3.0) / modulus
        return math.sqrt(modulus / density)


STRESS_STATES: dict[tuple[int, str | None], StressState] = {
    (1, "stress"): StressState("uniaxial stress", ((0, 0),), (1, 2)),
    (1, "strain"): StressState("uniaxial strain", ((0, 0), (1, 1), (2, 2))),
    (2, "stress"): StressState("plane stress", ((0, 0), (1, 1), (0, 1)), (2,)),
    (2, "strain"): StressState("plane strain", ((0, 0), (1, 1), (2, 2), (0, 1))),
    (3, None): StressState("three-dimensional", ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))),
}


@cache
def packing(space: Space, state: StressState) -> tuple[wp.Function, wp.Function]:
    """Warp functions unpack(packed) -> 3x3 tensor and pack(tensor) -> packed."""
    stress, tensor = space.packed(len(state.components)), space.tensor
    count = len(state.components)
    # Constant vectors, not wp.static of a loop variable: Warp 1.19 resolves those only when it compiles, so a kernel's hash
    # then depends on what else was compiled before, and the first warm start compiles again.
    integers = wp.types.vector(length=count, dtype=wp.int32)
    rows, columns = integers(*[i for i, _ in state.components]), integers(*[j for _, j in state.components])

    @wp.func
    def unpack(packed: stress) -> tensor:
        full = tensor()
        for c in range(wp.static(count)):
            full[rows[c], columns[c]] = packed[c]
            full[columns[c], rows[c]] = packed[c]
        return full

    @wp.func
    def pack(full: tensor) -> stress:
        packed = stress()
        for c in range(wp.static(count)):
            packed[c] = full[rows[c], columns[c]]
        return packed

    return unpack, pack


@cache
def unit_normal(space: Space) -> wp.Function:
    """Warp function: the unit normal rate along axis k."""
    tensor, real = space.tensor, space.scalar

    @wp.func
    def unit(k: int) -> tensor:
        rate = tensor()
        rate[k, k] = real(1.0)
        return rate

    return unit
