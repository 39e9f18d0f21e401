"""The state of a body: one flat buffer with typed views, velocity first."""

from functools import lru_cache

import numpy as np
import warp as wp

from wsph.constitutive import Constitutive
from wsph.space import Space


@lru_cache(maxsize=None)
def fields_struct(space: Space, width: int, internals: int) -> type:
    """Struct of the typed views, as kernels take it."""
    annotations = {
        "velocity": wp.array(dtype=space.vec),
        "stress": wp.array(dtype=space.vector(width)),
        "internals": wp.array(dtype=space.vector(max(internals, 1))),
        "deformation": wp.array(dtype=space.mat),
        "displacement": wp.array(dtype=space.vec),
    }
    return wp.struct(type("Fields", (), {"__annotations__": annotations, "__module__": __name__}))


class State:
    """Fields of `n` points, nondimensional. Fields that the scene does not ask for are empty arrays.

    velocity       # (n,), vec
    stress         # Cauchy, packed, (n,), vector(width)
    internals      # (n,), vector(number of internals), or empty
    deformation    # H = F - I, (n,), dim x dim, or empty
    displacement   # (n,), vec, or empty
    """

    def __init__(self, space: Space, n: int, constitutive: Constitutive, device: str,
                 displacement: bool = False, deformation: bool = False):  # fmt: skip
        self.space, self.n, self.device = space, n, device
        internals = len(constitutive.internals)
        types = {
            "velocity": (space.dim, space.vec),
            "stress": (constitutive.width, space.vector(constitutive.width)),
            "internals": (internals, space.vector(max(internals, 1))),
            "deformation": (space.dim**2 * deformation, space.mat),
            "displacement": (space.dim * displacement, space.vec),
        }
        widths = {name: width for name, (width, _) in types.items()}
        self.widths = {name: width for name, width in widths.items() if width}
        self.buffer = wp.zeros(n * sum(widths.values()), dtype=space.scalar, device=device)
        self.type = fields_struct(space, constitutive.width, internals)
        self.struct = self.type()
        self.start: dict[str, int] = {}
        start = 0
        for name, (width, dtype) in types.items():
            view = self._view(start, n if width else 0, dtype)
            setattr(self.struct, name, view)
            if width:
                self.start[name] = start
            start += n * width

    def _view(self, start: int, n: int, dtype: type) -> wp.array:
        if n == 0:
            return wp.empty(0, dtype=dtype, device=self.device)
        size = np.dtype(self.space.numpy).itemsize
        return wp.array(ptr=self.buffer.ptr + start * size, dtype=dtype, shape=n, device=self.device, copy=False)

    def index(self, name: str, particle: np.ndarray | int, component: int) -> np.ndarray | int:
        """Where a component of a field of a particle stands in the buffer."""
        return self.start[name] + particle * self.widths[name] + component

    def read(self, name: str) -> np.ndarray:
        """A copy of a field, (n, width), nondimensional, in double precision."""
        start, width = self.start[name], self.widths[name]
        return self.buffer.numpy()[start : start + self.n * width].reshape(self.n, width).astype(np.float64)

    def write(self, name: str, values: np.ndarray) -> None:
        """Set a field from (n, width) nondimensional values."""
        start, width = self.start[name], self.widths[name]
        everything = self.buffer.numpy().copy()
        everything[start : start + self.n * width] = np.asarray(values, self.space.numpy).reshape(-1)
        self.buffer.assign(everything)

    @property
    def nbytes(self) -> int:
        """Device memory [bytes]."""
        return self.buffer.capacity
