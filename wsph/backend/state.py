"""The state of a body: fields in one flat buffer with typed views, what integrators call the velocity first."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import cast, overload

import numpy as np
import warp as wp

from wsph.backend.arrays import put
from wsph.backend.space import Array, Space


@dataclass(frozen=True)
class Field:
    """A field of a state: `width` numbers a place, its SI `unit`.

    `at_points`: it stands where the stress does, which may be other places than those of the velocity. `leads`: it stands
    with the velocity, in what integrators advance by that name. `derived`: it is computed from the other fields, into one
    array that all states share, and is valid for the last state that it was computed for. `hidden`: it is not read by its
    name. `square`: its numbers are a dim x dim matrix. `bounded`: where it is read between its
    places, or beyond them, it stays within the range of those around.
    """

    name: str
    width: int
    unit: str = ""
    at_points: bool = False
    leads: bool = False
    derived: bool = False
    square: bool = False
    hidden: bool = False
    bounded: bool = False

    def type(self, space: Space) -> type:
        """Its type in kernels."""
        return space.mat if self.square else space.vector(self.width)


@dataclass(frozen=True)
class Layout:
    """The fields of a state, in the order of the buffer. As a mapping: widths by name."""

    fields: tuple[Field, ...]

    @classmethod
    def of(cls, fields: Iterable[Field]) -> "Layout":
        """The layout of those fields that have a width; the others are left out."""
        return cls(tuple(field for field in fields if field.width))

    @cached_property
    def by_name(self) -> dict[str, Field]:
        """The fields by name."""
        return {field.name: field for field in self.fields}

    def __contains__(self, name: object) -> bool:
        return name in self.by_name

    def keys(self) -> Iterable[str]:
        """Names of the fields."""
        return self.by_name.keys()

    def __getitem__(self, name: str) -> int:
        return self.by_name[name].width


@cache
def fields_struct(space: Space, layout: Layout) -> type:
    """Struct of the typed views of the fields that there are, as kernels take it."""
    annotations = {field.name: wp.array(dtype=field.type(space)) for field in layout.fields}
    return cast(type, wp.struct(type("Fields", (), {"__annotations__": annotations, "__module__": __name__})))


def _views(
    space: Space, fields: list[Field], counts: dict[str, int], device: str, least: int = 0
) -> tuple[Array, dict[str, int], dict[str, Array]]:
    """A buffer for fields, of `least` numbers or more, where each starts in it, and a typed view of each."""
    size = max(sum(counts[f.name] * f.width for f in fields), least)
    buffer = wp.zeros(size, dtype=space.scalar, device=device)
    start: dict[str, int] = {}
    views: dict[str, Array] = {}
    first = 0
    for field in fields:
        address = (buffer.ptr or 0) + first * np.dtype(space.numpy).itemsize
        start[field.name] = first
        views[field.name] = wp.array(
            ptr=address, dtype=field.type(space), shape=counts[field.name], device=device, copy=False
        )
        first += counts[field.name] * field.width
    return buffer, start, views


class Derived:
    """The derived fields of a layout, shared by all states of a body: valid for the state `of` that they were last computed
    for."""

    def __init__(self, space: Space, layout: Layout, points: int, device: str, least: int = 0):
        """`least`: numbers that their buffer has at least, for what is kept there while they are not."""
        fields = [field for field in layout.fields if field.derived]
        counts = dict.fromkeys((field.name for field in fields), points)
        self.buffer, self.start, self.arrays = _views(space, fields, counts, device, least)
        self.of: State | None = None
        self.tell: Callable[[State], None] | None = None
        """Computes them for a state, where evaluations do without them: they are then `of` none until they are asked for."""


class State:
    """Fields of `n` places, and of `points` where the stress stands, nondimensional. `layout` says which; fields by name are
    attributes of `struct`, typed arrays as kernels take them.

    velocity       # (n,), vec
    drag           # what viscosity has added to the velocity since the step began, (n,), vec, where a body has viscosity
    stress         # Cauchy, packed, (points,), vector(width)
    internals      # (points,), vector(number of internals), where the material has internals
    deformation    # H = F - I, (points,), dim x dim, where the formulation evolves it
    spin           # skew part of the velocity gradient, above the diagonal, where a formulation hands it on
    displacement   # (n,), vec, where a frame, a probe or the formulation asks for it
    deviation      # of the neighbours from their linear field, back at the start, (n,), vec, where it is remembered
    damage         # (points,), vector(1), 0 intact to 1 broken, where a body can break
    damaged_stress # what acts of an evolved stress where a body can break: what is read as "stress"
    """

    def __init__(
        self,
        space: Space,
        n: int,
        layout: Layout,
        device: str,
        points: int | None = None,
        derived: Derived | None = None,
        counts: Mapping[str, int] | None = None,
    ):
        """`counts`: places of each field whose number of places is its own."""
        self.space, self.n, self.device, self.layout, self.derived = space, n, device, layout, derived
        self.widths = dict(layout)
        self.counts = {f.name: n if points is None or not f.at_points else points for f in layout.fields} | dict(
            counts or {}
        )
        shared = derived.arrays if derived is not None else {}
        own = [field for field in layout.fields if field.name not in shared]
        self.buffer, self.start, views = _views(space, own, self.counts, device)
        self.split = sum(self.counts[f.name] * f.width for f in own if f.leads)
        """Index in the buffer where the rest begins; before it stand the fields that integrators call the velocity."""
        self.type = fields_struct(space, layout)
        self.struct = self.type()
        for name, array in (shared | views).items():
            setattr(self.struct, name, array)

    def _place(self, name: str) -> tuple[Array, int]:
        """The buffer that a field stands in, and where it starts there."""
        if name == "stress" and "damaged_stress" in self.layout:
            name = "damaged_stress"
        if self.derived is not None and name in self.derived.start:
            return self.derived.buffer, self.derived.start[name]
        return self.buffer, self.start[name]

    @overload
    def index(self, name: str, particle: int, component: int) -> int: ...

    @overload
    def index(self, name: str, particle: np.ndarray, component: int) -> np.ndarray: ...

    def index(self, name: str, particle: np.ndarray | int, component: int) -> np.ndarray | int:
        """Where a component of a field of a particle stands in the buffer; a derived one in that of the derived fields,
        taken to follow it."""
        buffer, start = self._place(name)
        offset = 0 if buffer is self.buffer else len(self.buffer)
        return offset + start + particle * self.widths[name] + component

    def span(self, name: str) -> slice:
        """Where a field that is not derived stands in the buffer."""
        start = self.start[name]
        return slice(start, start + self.counts[name] * self.widths[name])

    def flat(self, name: str) -> Array:
        """A field's numbers in the buffer, one after the other."""
        address = (self.buffer.ptr or 0) + self.start[name] * np.dtype(self.space.numpy).itemsize
        size = self.counts[name] * self.widths[name]
        return wp.array(ptr=address, dtype=self.space.scalar, shape=size, device=self.device, copy=False)

    def told(self) -> None:
        """Have the derived fields computed for this state, where the last evaluation did without them (launches)."""
        derived = self.derived
        if derived is not None and derived.tell is not None and derived.of is None:
            derived.tell(self)

    def bounded(self, name: str) -> bool:
        """Whether a field is read within the range of the values around."""
        return self.layout.by_name[name].bounded

    def read(self, name: str) -> np.ndarray:
        """A copy of a field, (n, width), nondimensional, in double precision."""
        if self.derived is not None and name in self.derived.start:
            self.told()
        (buffer, start), width, n = self._place(name), self.widths[name], self.counts[name]
        return buffer.numpy()[start : start + n * width].reshape(n, width).astype(np.float64)

    def write(self, name: str, values: np.ndarray) -> None:
        """Set a field from (n, width) nondimensional values."""
        (buffer, start), size = self._place(name), self.counts[name] * self.widths[name]
        put(buffer[start : start + size], np.asarray(values, self.space.numpy).reshape(-1))
