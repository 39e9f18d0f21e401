"""Pressure on faces, which follows them: -p n on the current area.

Of a face whose corners are particles, the force on corner j is -p times the integral of N_j n da over the face as it is
now, multilinear between its corners. The sum over a closed surface is zero, and so is its torque. p is the value at a
particle's reference position. The thickness of plane stress is that of the reference configuration.
"""

from functools import cache
from itertools import product
from typing import Annotated, ClassVar

import numpy as np
import warp as wp
from pydantic import model_validator

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.acting import ActingLoad, Load
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.loads.work import LoadWork
from wsph.boundary.programs.prescribed import constant
from wsph.boundary.programs.stack_machine import Bank, bank_of, evaluate_mean, interval, places
from wsph.declarations import Measured, example
from wsph.geometry.gradients import GAUSS
from wsph.protocols import Entry
from wsph.quantities import Value, is_table
from wsph.ranks.kept import Rows
from wsph.units import Scales


class Pressure(Load):
    """A pressure [Pa] that follows the face; positive pushes. A number, a quantity, an expression or a function."""

    model_config = example({"value": "1 MPa"})
    key: ClassVar[str] = "pressure"
    values: ClassVar[dict[str, str]] = {"value": "Pa"}
    shorthand: ClassVar[tuple[dict[str, object], ...]] = ({"type": ["number", "string"], "unit": "Pa"},)
    by_corners: ClassVar[bool] = True
    otherwise: ClassVar[str] = "a traction, which keeps its direction"
    value: Annotated[Value, Measured("Pa")]

    @model_validator(mode="before")
    @classmethod
    def _shorthand(cls, given: object) -> object:
        return given if is_table(given) else {"value": given}

    def at_rest(self, faces: LoadedFaces) -> FaceLoad:
        count, corners, dim = faces.vector.shape
        face = np.repeat(np.arange(count), corners)
        return FaceLoad(faces.values["value"], faces.corners.ravel(), -faces.vector.reshape(-1, dim), face)

    def attach(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays) -> ActingLoad:
        return Pressures(faces, space, scales, clock, arrays)


@cache
def _value_kernel(space: Space) -> wp.Kernel:
    real = space.scalar

    @kernel(ranged=True)
    def pressures(
        first: int,
        bank: Bank,
        clock: wp.array(dtype=wp.float64),
        position: wp.array(dtype=wp.vec3d),
        from_dt: wp.float64,
        to_dt: wp.float64,
        second: wp.float64,
        unit: wp.float64,
        pressure_out: wp.array(dtype=real),
    ):
        e = first + wp.tid()
        pressure_out[e] = real(evaluate_mean(bank, 0, position[e], clock, second, from_dt, to_dt) / unit)

    return pressures


@cache
def _face_share(space: Space) -> wp.Function:
    """Warp function (corners, node, u, f, c) -> the integral of N_c n da over face f as it is now, of its corners."""
    real, vec, dim = space.scalar, space.vec, space.dim
    count = 2 ** (dim - 1)

    @wp.func
    def along(
        corners: wp.array2d(dtype=wp.int32), node: wp.array(dtype=vec), u: wp.array(dtype=vec), f: int, a: int, b: int
    ) -> vec:
        i = corners[f, a]
        j = corners[f, b]
        return (node[j] + u[j]) - (node[i] + u[i])

    if dim == 1:

        @wp.func
        def of_end(
            corners: wp.array2d(dtype=wp.int32), node: wp.array(dtype=vec), u: wp.array(dtype=vec), f: int, c: int
        ) -> vec:
            return vec(real(1.0))

        return of_end
    if dim == 2:

        @wp.func
        def of_line(
            corners: wp.array2d(dtype=wp.int32), node: wp.array(dtype=vec), u: wp.array(dtype=vec), f: int, c: int
        ) -> vec:
            r = along(corners, node, u, f, 0, 1)
            return real(0.5) * vec(r[1], -r[0])

        return of_line
    # Two Gauss points an axis are exact: the shape functions at them.
    points = np.array(list(product(GAUSS, repeat=2)))
    Shapes = wp.types.matrix(shape=(4, count), dtype=real)
    offsets = np.array(list(product((0, 1), repeat=2)))
    shape = Shapes(*[float(np.where(o == 1, p, 1.0 - p).prod()) for p in points for o in offsets])
    Places = wp.types.matrix(shape=(4, 2), dtype=real)
    place = Places(*points.ravel().tolist())

    @wp.func
    def of_face(
        corners: wp.array2d(dtype=wp.int32), node: wp.array(dtype=vec), u: wp.array(dtype=vec), f: int, c: int
    ) -> vec:
        # Corners 0 to 3 stand at (0, 0), (0, 1), (1, 0), (1, 1).
        at_low = along(corners, node, u, f, 0, 2)
        at_high = along(corners, node, u, f, 1, 3)
        on_low = along(corners, node, u, f, 0, 1)
        on_high = along(corners, node, u, f, 2, 3)
        total = vec()
        for q in range(4):
            s = place[q, 0]
            t = place[q, 1]
            first = (real(1.0) - t) * at_low + t * at_high
            second = (real(1.0) - s) * on_low + s * on_high
            total += (real(0.25) * shape[q, c]) * wp.cross(first, second)
        return total

    return of_face


@cache
def _push_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """f -= p n da, over the particles of the faces."""
    real, vec, Fields, share = space.scalar, space.vec, fields_struct(space, layout), _face_share(space)

    @kernel(ranged=True)
    def push(
        first: int,
        particle: wp.array(dtype=wp.int32),
        offsets: wp.array(dtype=wp.int32),
        face: wp.array(dtype=wp.int32),
        corner: wp.array(dtype=wp.int32),
        corners: wp.array2d(dtype=wp.int32),
        sign: wp.array(dtype=real),
        node: wp.array(dtype=vec),
        pressure: wp.array(dtype=real),
        fields: Fields,
        force_out: wp.array(dtype=vec),
    ):
        e = first + wp.tid()
        i = particle[e]
        area = vec()
        for k in range(offsets[e], offsets[e + 1]):
            f = face[k]
            area += sign[f] * share(corners, node, fields.displacement, f, corner[k])
        force_out[i] = force_out[i] - pressure[e] * area

    return push


class Pressures(ActingLoad):
    """A pressure on the device, of k particles and their f faces, nondimensional.

    _particle  # (k,) int32
    _offsets   # (k + 1,) int32, where the faces of each begin in `_face` and `_corner`, the place it has in them
    _corners   # (f, c) int32, particles of the faces
    _sign      # (f,) scalar, 1 where the normal that follows from the order of the corners points out, else -1
    _pressure  # (k,) scalar, of the last time imposed
    _force     # (n,) vec, its forces at the end of a step
    """

    def __init__(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays):
        self._space, self._clock, self._scales = space, clock, scales
        n = len(faces.particle)
        value = faces.values["value"]
        number = constant(value)
        self._moving = number is None
        start = np.full(n, 0.0 if number is None else number / scales.stress)
        # Of the last time imposed, which a method may use again at the start of the next step.
        self._pressure = arrays.changes("pressure", wp.array(start, dtype=space.scalar, device=arrays.device))
        self._bank = bank_of([value], clock.device)
        self._position = arrays.of("position", places(faces.place[faces.particle]), wp.vec3d)
        flat = faces.corners.ravel()
        order = np.argsort(flat, kind="stable")
        where = np.searchsorted(faces.particle, flat[order])
        counts = np.bincount(where, minlength=n)
        self._particle = arrays.of("particle", faces.particle, wp.int32)
        self._offsets = arrays.of("offsets", np.concatenate([[0], np.cumsum(counts)]), wp.int32)
        self._face = arrays.of("face", order // faces.corners.shape[1], wp.int32)
        self._corner = arrays.of("corner", order % faces.corners.shape[1], wp.int32)
        self._corners = arrays.of("corners", faces.corners, wp.int32)
        self._node = arrays.of("node", (faces.place - faces.middle) / scales.length, space.vec)
        self._sign = arrays.of("sign", _signs(faces), space.scalar)
        self._force = arrays.zeros("force", len(faces.place), space.vec)
        particle, whole = faces.particle, np.zeros(n, int)
        share = None if faces.share.complete else faces.share
        self._work = LoadWork(particle, particle, whole, self._force, space, clock.device, share, faces.domain)
        self._faces = faces
        arrays.part("work").adopt(self._work, self._work.kept())
        self._count = n
        self.ledger = (Entry("external_work", lambda: self._work.total),)
        self.numbers = self._work.terms(0)

    def rows(self) -> dict[str, Rows]:
        works = self._work.rows(self._faces.share)
        return {"pressure": self._faces.rows, **{f"work.{name}": works for name in ("_work", "_before", "_place")}}

    def impose(self, clock: Clock, c: float | tuple[float, float]) -> None:
        if not self._moving:
            return
        inputs = [self._bank, clock.time, self._position, *interval(c)]
        inputs += [wp.float64(self._scales.time), wp.float64(self._scales.stress)]
        clock.launch(_value_kernel(self._space), self._count, inputs, [self._pressure])

    def act(self, state: State, forces: wp.array) -> None:
        kernel = _push_kernel(self._space, state.layout)
        inputs = [self._particle, self._offsets, self._face, self._corner, self._corners, self._sign, self._node]
        self._clock.launch(kernel, self._count, [*inputs, self._pressure, state.struct], [forces])

    def start(self, state: State) -> None:
        self._find_force(state)
        self._work.start(state, self._clock)

    def advance(self, state: State) -> None:
        self._find_force(state)
        self._work.add(state, self._clock)

    def _find_force(self, state: State) -> None:
        self._clock.launch(_clear_kernel(self._space), self._count, [self._particle], [self._force])
        self.act(state, self._force)


@cache
def _clear_kernel(space: Space) -> wp.Kernel:
    vec = space.vec

    @kernel(ranged=True)
    def clear(first: int, particle: wp.array(dtype=wp.int32), force_out: wp.array(dtype=vec)):
        force_out[particle[first + wp.tid()]] = vec()

    return clear


def _signs(faces: LoadedFaces) -> np.ndarray:
    """`Pressures._sign` of the faces."""
    whole, ends = faces.vector.sum(1), faces.place[faces.corners]
    dim = whole.shape[1]
    if dim == 1:
        return np.sign(whole[:, 0])
    if dim == 2:
        along = ends[:, 1] - ends[:, 0]
        return np.sign(along[:, 1] * whole[:, 0] - along[:, 0] * whole[:, 1])
    first, second = ends[:, 2] + ends[:, 3] - ends[:, 0] - ends[:, 1], ends[:, 1] + ends[:, 3] - ends[:, 0] - ends[:, 2]
    return np.sign((np.cross(first, second) * whole).sum(1))
