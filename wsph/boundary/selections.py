"""What the conditions of a body select, and what acts there, so that a wrong selection is seen before a run."""

# pyright: strict

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wsph.boundary.conditions import selected_conditions
from wsph.boundary.loads.rows import FORCE, FaceLoad
from wsph.boundary.natural import loaded_faces, prescribed_loads
from wsph.boundary.programs.functions import Function
from wsph.boundary.tables import Boundary, Prescribing
from wsph.geometry.geometry import Geometry

LOOKS = 101
"""Times from the start to the end at which a load that is an expression of t is looked at."""

ROUNDING = 1e-12
"""Part of the sum of all forces below which a component of the resultant is rounding."""

AREAS = {1: "", 2: " m", 3: " m2"}
"""Units of areas, by the dimension."""


@dataclass(frozen=True)
class Selection:
    """What one condition selects: its number, the `condition`, how many `particles`, and the cell `faces` by name with
    their areas [m^(dim-1)]. `resultant` (dim,) [N in 3D, N/m in 2D, N/m2 in 1D] of its loads on the body
    at rest, at the `time` [s] at which it is largest; None where it has none."""

    number: int
    condition: Boundary
    dim: int
    particles: int
    faces: dict[str, float]
    resultant: np.ndarray | None
    time: float

    def __str__(self) -> str:
        """In words."""
        condition, unit, force = self.condition, AREAS[self.dim], FORCE[self.dim]
        named = [(key, text) for key in ("face", "patch", "where") if (text := getattr(condition, key))]
        where = " ".join(named[0])
        areas = ", ".join(f"{name} {area:.6g}{unit}" for name, area in self.faces.items())
        text = f"{condition.body}, {where}: {self.particles} particles, faces {areas or 'none'}"
        text += "".join(f"; {said}" for said in _supports(condition))
        text += f"; in {', '.join(condition.steps)}" if condition.steps else ""
        if self.resultant is None:
            return text
        parts = ", ".join(f"{each:.6g}" for each in self.resultant)
        return f"{text}; resultant ({parts}) {force}" + (f" at t = {self.time:.4g} s" if self.time else "")


def _supports(condition: Boundary) -> Iterator[str]:
    """What a condition says of the motion and of supports, in words."""
    for key in ("displacement", "acceleration"):
        if given := getattr(condition, key):
            yield f"{key} {', '.join(given)}"
    if condition.periodic:
        yield f"one with face {condition.periodic}"
    yield from (key for key, load in condition.acting.items() if not load.values)


def chosen(
    scene: Prescribing, body: str, geometry: Geometry, position: np.ndarray
) -> Iterator[tuple[int, Boundary, np.ndarray, np.ndarray]]:
    """What `selected_conditions` gives of a body on the `sides` of its geometry, whose nodes or cells are its particles at
    `position` (n, dim) [m]."""
    on = _bearers(geometry, position)
    return selected_conditions(scene, body, geometry.sides, geometry.spacing, position, on, geometry.split)


def _bearers(geometry: Geometry, position: np.ndarray) -> np.ndarray:
    """The particles that stand for each face, (m, k): its nodes, or its cell."""
    faces = geometry.sides
    return faces.nodes if len(position) == len(geometry.nodes) else faces.cell[:, None]


def selections(
    scene: Prescribing, body: str, geometry: Geometry, position: np.ndarray, end: float
) -> Iterator[Selection]:
    """What every condition of a body selects of its particles at `position` (n, dim) [m]: the nodes or the cells of its
    geometry. `end` of the run [s]. Raises SceneError where one selects nothing."""
    faces, on = geometry.sides, _bearers(geometry, position)
    for k, condition, particles, rows in chosen(scene, body, geometry, position):
        loads = [load for _, load in prescribed_loads(scene, condition, geometry, on, rows)]
        acting = [
            load.at_rest(loaded_faces(scene, condition, load, geometry, on, rows)) for load in condition.acting.values()
        ]
        loads += [load for load in acting if load is not None]
        looks = [(*_resultant(loads, position, time), time) for time in _times(loads, end)]
        # Where a load has none, as on the side of a hole, it is looked at where it is largest itself.
        resultant, _, time = max(looks, key=lambda look: (float(np.linalg.norm(look[0])), look[1]))
        yield Selection(
            k,
            condition,
            scene.dim,
            len(particles),
            faces.parts(rows),
            resultant if loads else None,
            time if loads else 0.0,
        )


def _times(loads: list[FaceLoad], end: float) -> list[float]:
    """Times at which loads can be largest: the entries of their tables, or a number of times of the run."""
    found = {0.0}
    for value in (load.value for load in loads):
        if isinstance(value, Function):
            found.update(value.t or ())
        elif value.uses("t"):
            found.update(np.linspace(0.0, end, LOOKS).tolist())
    return sorted(time for time in found if time <= end)


def _resultant(loads: list[FaceLoad], position: np.ndarray, time: float) -> tuple[np.ndarray, float]:
    """The sum of the forces of loads at a time, (dim,), of those that cancel zero, not what rounding leaves; and of their
    sizes."""
    total, size = np.zeros(position.shape[1]), 0.0
    for load in loads:
        if isinstance(load.value, Function):
            forces = load.value.at(time) * load.push
        else:
            forces = load.value(position[load.particle], time)[:, None] * load.push
        total += forces.sum(axis=0)
        size += float(np.abs(forces).sum())
    return np.where(np.abs(total) > ROUNDING * size, total, 0.0), size
