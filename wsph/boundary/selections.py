"""What the conditions of a body select, and what acts there, so that a wrong selection is seen before a run."""

# pyright: strict

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wsph.boundary.conditions import Prescribed, selected_conditions
from wsph.boundary.tables import Boundary, Function, Prescribing
from wsph.geometry.lattice import Lattice
from wsph.output.fields import AXES

LOOKS = 101
"""Times from the start to the end at which a load that is an expression of t is looked at."""

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
        where = f"face {condition.face}" if condition.face else f"where {condition.where}"
        areas = ", ".join(f"{name} {area:.6g}{unit}" for name, area in self.faces.items())
        text = f"{condition.body}, {where}: {self.particles} particles, faces {areas or 'none'}"
        if self.resultant is None:
            return text
        parts = ", ".join(f"{each:.6g}" for each in self.resultant)
        return f"{text}; resultant ({parts}) {force}" + (f" at t = {self.time:.4g} s" if self.time else "")


@dataclass(frozen=True)
class _Push:
    """A load on faces, `rows` (m,) bool: a `value` [Pa] times their areas along `way` (m, dim)."""

    rows: np.ndarray
    way: np.ndarray
    value: Prescribed


def selections(
    scene: Prescribing, body: str, lattice: Lattice, position: np.ndarray, end: float
) -> Iterator[Selection]:
    """What every condition of a body selects of its particles at `position` (n, dim) [m]: the nodes or the cells of its
    lattice. `end` of the run [s]. Raises SceneError where one selects nothing."""
    faces = lattice.faces
    on = faces.nodes if len(position) == len(lattice.nodes) else faces.cell[:, None]
    for k, condition, particles, rows in selected_conditions(scene, body, lattice, position, on):
        pushes = list(_pushes(scene, condition, lattice, rows))
        looks = [(_resultant(pushes, position, on, lattice, time), time) for time in _times(pushes, end)]
        resultant, time = max(looks, key=lambda look: float(np.linalg.norm(look[0])))
        yield Selection(
            k,
            condition,
            scene.dim,
            len(particles),
            faces.parts(rows),
            resultant if pushes else None,
            time if pushes else 0.0,
        )


def _pushes(scene: Prescribing, condition: Boundary, lattice: Lattice, rows: np.ndarray) -> Iterator[_Push]:
    """The prescribed loads of a condition: tractions along coordinate axes, stresses along the axes of the shape."""
    faces, dim = lattice.faces, scene.dim
    for axis, value in condition.traction.items():
        yield _Push(rows, np.tile(np.eye(dim)[AXES.index(axis)], (len(rows), 1)), scene.value(value, "Pa"))
    for label, value in condition.stress.items():
        i, j = (AXES.index(axis) for axis in label)
        along = np.where(faces.axis == i, j, i)
        acting = rows & np.isin(faces.axis, (i, j))
        yield _Push(acting, faces.sign[:, None] * lattice.frame.axes.T[along], scene.value(value, "Pa"))


def _times(pushes: list[_Push], end: float) -> list[float]:
    """Times at which loads can be largest: the entries of their tables, or a number of times of the run."""
    found = {0.0}
    for value in (push.value for push in pushes):
        if isinstance(value, Function):
            found.update(value.t or ())
        elif value.uses("t"):
            found.update(np.linspace(0.0, end, LOOKS).tolist())
    return sorted(time for time in found if time <= end)


def _resultant(pushes: list[_Push], position: np.ndarray, on: np.ndarray, lattice: Lattice, time: float) -> np.ndarray:
    """The sum of forces on the faces at a time, (dim,)."""
    total, share = np.zeros(position.shape[1]), lattice.faces.shares(on)
    for push in pushes:
        if isinstance(push.value, Function):
            value = np.full(share[push.rows].shape, push.value.at(time))
        else:
            there = on[push.rows]
            value = push.value(position[there.ravel()], time).reshape(there.shape)
        total += (value * share[push.rows]).sum(1) @ push.way[push.rows]
    return total
