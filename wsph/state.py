"""The state of a body: one flat buffer with typed views, velocity first."""

from functools import cache

import numpy as np
import warp as wp

from wsph.constitutive import Constitutive
from wsph.space import Space

Layout = tuple[tuple[str, int], ...]
"""Name and width of every field of a state, in the order of the buffer."""


@cache
def fields_struct(space: Space, layout: Layout) -> type:
    """Struct of the typed views of the fields that there are, as kernels take it."""
    annotations = {name: wp.array(dtype=_type(space, name, width)) for name, width in layout}
    return wp.struct(type("Fields", (), {"__annotations__": annotations, "__module__": __name__}))


def _type(space: Space, name: str, width: int) -> type:
    return space.mat if name == "deformation" else space.vector(width)


def layout_of(
    space: Space,
    constitutive: Constitutive,
    displacement: bool = False,
    deformation: bool = False,
    spin: bool = False,
) -> Layout:
    """Fields and widths of a state, velocity first."""
    widths = {
        "velocity": space.dim,
        "stress": constitutive.width,
        "internals": len(constitutive.internals),
        "deformation": space.dim**2 * deformation,
        "spin": space.dim * (space.dim - 1) // 2 * spin,
        "displacement": space.dim * displacement,
    }
    return tuple((name, width) for name, width in widths.items() if width)


class State:
    """Fields of `n` points, or of as many as `counts` says for a field, nondimensional. What is not asked for is not there.

    velocity       # (n,), vec
    stress         # Cauchy, packed, (n,), vector(width)
    internals      # (n,), vector(number of internals), where the material has any
    deformation    # H = F - I, (n,), dim x dim, where the formulation evolves it
    spin           # skew part of the velocity gradient, above the diagonal, where a formulation hands it on
    displacement   # (n,), vec, where a frame or a probe asks for it
    """

    def __init__(self, space: Space, n: int, layout: Layout, device: str, counts: dict[str, int] | None = None):
        self.space, self.n, self.device, self.layout = space, n, device, layout
        self.widths = dict(self.layout)
        self.counts = dict.fromkeys(self.widths, n) | (counts or {})
        self.source: State | None = None  # the law's rates at L = 0, where a system keeps them
        self.buffer = wp.zeros(sum(self.counts[k] * w for k, w in layout), dtype=space.scalar, device=device)
        self.type = fields_struct(space, self.layout)
        self.struct = self.type()
        self.start: dict[str, int] = {}
        address = self.buffer.ptr or 0
        start, size = 0, np.dtype(space.numpy).itemsize
        for name, width in self.layout:
            self.start[name] = start
            view = wp.array(
                ptr=address + start * size,
                dtype=_type(space, name, width),
                shape=self.counts[name],
                device=device,
                copy=False,
            )
            setattr(self.struct, name, view)
            start += self.counts[name] * width

    def index(self, name: str, particle: np.ndarray | int, component: int) -> np.ndarray | int:
        """Where a component of a field of a particle stands in the buffer."""
        return self.start[name] + particle * self.widths[name] + component

    def read(self, name: str) -> np.ndarray:
        """A copy of a field, (n, width), nondimensional, in double precision."""
        start, width, n = self.start[name], self.widths[name], self.counts[name]
        return self.buffer.numpy()[start : start + n * width].reshape(n, width).astype(np.float64)

    def write(self, name: str, values: np.ndarray) -> None:
        """Set a field from (n, width) nondimensional values."""
        start, width, n = self.start[name], self.widths[name], self.counts[name]
        everything = self.buffer.numpy().copy()
        everything[start : start + n * width] = np.asarray(values, self.space.numpy).reshape(-1)
        self.buffer.assign(everything)

    @property
    def nbytes(self) -> int:
        """Device memory, its sources' included [bytes]."""
        return self.buffer.capacity + (self.source.nbytes if self.source is not None else 0)
