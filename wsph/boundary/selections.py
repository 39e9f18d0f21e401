"""What the conditions of a body select, and what acts there, so that a wrong selection is seen before a run."""

# pyright: strict

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wsph.boundary.conditions import Prescribed, selected_conditions
from wsph.boundary.tables import Boundary, Function, Prescribing
from wsph.geometry.geometry import Geometry
from wsph.output.fields import AXES

LOOKS = 101
"""Times from the start to the end at which a load that is an expression of t is looked at."""

ROUNDING = 1e-12
"""Part of what acts in all that a resultant has by rounding."""

UNITS = {1: ("", "N/m2"), 2: (" m", "N/m"), 3: (" m2", "N")}
"""Units of areas and of forces, by the dimension."""


@dataclass(frozen=True)
class Selection:
    """What one condition selects: its number, the `condition`, how many `particles`, and the cell `faces` by name with
    their areas [m^(dim-1)]. `resultant` (dim,) [N in 3D, N/m in 2D] of its prescribed loads at the `time` [s] at which
    it is largest; None where it has none."""

    number: int
    condition: Boundary
    dim: int
    particles: int
    faces: dict[str, float]
    resultant: np.ndarray | None
    time: float

    def __str__(self) -> str:
        """In words."""
        condition, (unit, force) = self.condition, UNITS[self.dim]
        where = f"where {condition.where}"
        if condition.where is None:
            where = f"face {condition.face}" if condition.face else f"patch {condition.patch}"
        areas = ", ".join(f"{name} {area:.6g}{unit}" for name, area in self.faces.items())
        text = f"{condition.body}, {where}: {self.particles} particles, faces {areas or 'none'}"
        if self.resultant is None:
            return text
        parts = ", ".join(f"{each:.6g}" for each in self.resultant)
        return f"{text}; resultant ({parts}) {force}" + (f" at t = {self.time:.4g} s" if self.time else "")


@dataclass(frozen=True)
class _Push:
    """A load on f faces, particles `on` (f, k): a `value` [Pa] times `by` (f, k, dim) [m^(dim-1)]."""

    on: np.ndarray
    by: np.ndarray
    value: Prescribed


def selections(
    scene: Prescribing, body: str, geometry: Geometry, position: np.ndarray, end: float
) -> Iterator[Selection]:
    """What every condition of a body selects of its particles at `position` (n, dim) [m]: the nodes or the cells of its
    geometry. `end` of the run [s]. Raises SceneError where one selects nothing."""
    faces = geometry.faces
    on = faces.nodes if len(position) == len(geometry.nodes) else faces.cell[:, None]
    for k, condition, particles, rows in selected_conditions(scene, body, geometry, position, on):
        pushes = list(_pushes(scene, condition, geometry, on, rows))
        looks = [(*_resultant(pushes, position, time), time) for time in _times(pushes, end)]
        # Where a load has none, as on the side of a hole, it is looked at where it is largest itself.
        resultant, _, time = max(looks, key=lambda look: (float(np.linalg.norm(look[0])), look[1]))
        yield Selection(
            k,
            condition,
            scene.dim,
            len(particles),
            faces.parts(rows),
            resultant if pushes else None,
            time if pushes else 0.0,
        )


def _pushes(
    scene: Prescribing, condition: Boundary, geometry: Geometry, on: np.ndarray, rows: np.ndarray
) -> Iterator[_Push]:
    """The prescribed loads of a condition: tractions along coordinate axes, stresses along the axes of the shape, and those
    that follow the faces, as the faces are at the start."""
    faces, dim = geometry.faces, scene.dim
    share = faces.shares(on)[..., None]
    for axis, value in condition.traction.items():
        yield _Push(on[rows], share[rows] * np.eye(dim)[AXES.index(axis)], scene.value(value, "Pa"))
    for label, value in condition.stress.items():
        i, j = (AXES.index(axis) for axis in label)
        along = np.where(faces.axis == i, j, i)
        acting = rows & np.isin(faces.axis, (i, j))
        way = faces.sign[:, None] * geometry.axes.T[along]
        yield _Push(on[acting], (share * way[:, None])[acting], scene.value(value, "Pa"))
    whole = on.shape[1] == faces.vector.shape[1]
    vector = faces.vector[rows] if whole else faces.vector[rows].sum(1, keepdims=True)
    for load in condition.acting.values():
        for name, by in load.at_start(vector).items():
            yield _Push(on[rows], by, scene.value(getattr(load, name), load.values[name]))


def _times(pushes: list[_Push], end: float) -> list[float]:
    """Times at which loads can be largest: the entries of their tables, or a number of times of the run."""
    found = {0.0}
    for value in (push.value for push in pushes):
        if isinstance(value, Function):
            found.update(value.t or ())
        elif value.uses("t"):
            found.update(np.linspace(0.0, end, LOOKS).tolist())
    return sorted(time for time in found if time <= end)


def _resultant(pushes: list[_Push], position: np.ndarray, time: float) -> tuple[np.ndarray, float]:
    """The sum of forces on the faces at a time, (dim,), without what is rounding, and that of their sizes."""
    total, size = np.zeros(position.shape[1]), 0.0
    for push in pushes:
        if isinstance(push.value, Function):
            value = np.full(push.on.shape, push.value.at(time))
        else:
            value = push.value(position[push.on.ravel()], time).reshape(push.on.shape)
        force = value[..., None] * push.by
        total += force.sum((0, 1))
        size += float(np.linalg.norm(force, axis=2).sum())
    return np.where(np.abs(total) > ROUNDING * size, total, 0.0), size
