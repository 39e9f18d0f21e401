"""The state of a body: one flat buffer with typed views, velocity first."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.space import Space

Layout = tuple[tuple[str, int], ...]
"""Name and width of every field of a state, in the order of the buffer."""


class Derived:
    """Fields that follow from the others, in arrays that all states of a system have in common: those of the state that they
    were last found for."""

    def __init__(self, space: Space, layout: Layout, n: int, device: str):
        self.buffer = wp.zeros(sum(n * width for _, width in layout), dtype=space.scalar, device=device)
        self.arrays: dict[str, wp.array] = {}
        self.start: dict[str, int] = {}
        first = 0
        for name, width in layout:
            self.start[name] = first
            self.arrays[name] = _view(space, self.buffer, name, width, first, n)
            first += n * width


def _view(space: Space, buffer: wp.array, name: str, width: int, start: int, n: int) -> wp.array:
    address = (buffer.ptr or 0) + start * np.dtype(space.numpy).itemsize
    return wp.array(ptr=address, dtype=_type(space, name, width), shape=n, device=buffer.device, copy=False)


@cache
def fields_struct(space: Space, layout: Layout) -> type:
    """Struct of the typed views of the fields that there are, as kernels take it."""
    annotations = {name: wp.array(dtype=_type(space, name, width)) for name, width in layout}
    return wp.struct(type("Fields", (), {"__annotations__": annotations, "__module__": __name__}))


def _type(space: Space, name: str, width: int) -> type:
    return space.mat if name == "deformation" else space.vector(width)


class State:
    """Fields of `n` points, or of as many as `counts` says for a field, nondimensional. What is not asked for is not there;
    what is `derived` is not in the buffer.

    velocity       # (n,), vec
    drag           # what viscosity has added to the velocity since the step began, (n,), vec, where there is any
    stress         # Cauchy, packed, (n,), vector(width)
    internals      # (n,), vector(number of internals), where the material has any
    deformation    # H = F - I, (n,), dim x dim, where the formulation evolves it
    spin           # skew part of the velocity gradient, above the diagonal, where a formulation hands it on
    displacement   # (n,), vec, where a frame or a probe asks for it
    damage         # (n,), vector(1), 0 intact to 1 broken, where a body can break
    damaged_stress # what acts of an evolved stress where a body can break: what is read as "stress"
    """

    def __init__(
        self,
        space: Space,
        n: int,
        layout: Layout,
        device: str,
        counts: dict[str, int] | None = None,
        derived: Derived | None = None,
    ):
        self.space, self.n, self.device, self.layout = space, n, device, layout
        self.widths = dict(self.layout)
        self.counts = dict.fromkeys(self.widths, n) | (counts or {})
        self.source: State | None = None  # the law's rates at L = 0, where a system keeps them
        self.derived = derived
        shared = derived.arrays if derived is not None else {}
        own = [(name, width) for name, width in layout if name not in shared]
        self.buffer = wp.zeros(sum(self.counts[k] * w for k, w in own), dtype=space.scalar, device=device)
        self.type = fields_struct(space, self.layout)
        self.struct = self.type()
        self.start: dict[str, int] = {}
        self.split = sum(self.counts[k] * w for k, w in own if k in ("velocity", "drag"))
        """Where the rest begins: what integrators call the velocity is what comes before."""
        for name, array in shared.items():
            setattr(self.struct, name, array)
        start = 0
        for name, width in own:
            self.start[name] = start
            setattr(self.struct, name, _view(space, self.buffer, name, width, start, self.counts[name]))
            start += self.counts[name] * width

    def _place(self, name: str) -> tuple[wp.array, int]:
        """The buffer that a field stands in, and where it starts there."""
        if name == "stress" and "damaged_stress" in self.widths:
            name = "damaged_stress"
        if self.derived is not None and name in self.derived.start:
            return self.derived.buffer, self.derived.start[name]
        return self.buffer, self.start[name]

    def index(self, name: str, particle: np.ndarray | int, component: int) -> np.ndarray | int:
        """Where a component of a field of a particle stands in the buffer; a derived one in that of the derived fields,
        taken to follow it."""
        buffer, start = self._place(name)
        offset = 0 if buffer is self.buffer else len(self.buffer)
        return offset + start + particle * self.widths[name] + component

    def flat(self, name: str) -> wp.array:
        """A field's numbers in the buffer, one after the other."""
        address = (self.buffer.ptr or 0) + self.start[name] * np.dtype(self.space.numpy).itemsize
        size = self.counts[name] * self.widths[name]
        return wp.array(ptr=address, dtype=self.space.scalar, shape=size, device=self.device, copy=False)

    def read(self, name: str) -> np.ndarray:
        """A copy of a field, (n, width), nondimensional, in double precision."""
        (buffer, start), width, n = self._place(name), self.widths[name], self.counts[name]
        return buffer.numpy()[start : start + n * width].reshape(n, width).astype(np.float64)

    def write(self, name: str, values: np.ndarray) -> None:
        """Set a field from (n, width) nondimensional values."""
        (buffer, start), width, n = self._place(name), self.widths[name], self.counts[name]
        everything = buffer.numpy().copy()
        everything[start : start + n * width] = np.asarray(values, self.space.numpy).reshape(-1)
        buffer.assign(everything)

    @property
    def nbytes(self) -> int:
        """Device memory, its sources' included [bytes]."""
        return self.buffer.capacity + (self.source.nbytes if self.source is not None else 0)
