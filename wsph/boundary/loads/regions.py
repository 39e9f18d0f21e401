"""Forces per volume on the particles of a body: those of regions, and gravity that changes from place to place or in time.

Places are those of the reference: a region, and what an expression says of it, move with the body.
"""

# pyright: strict

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np

from wsph.backend.domain import WHOLE, Domain, any_of
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.prescribed import Prescribed, constant
from wsph.boundary.tables import Prescribing
from wsph.declarations import Measured, example
from wsph.errors import Fault, SceneError
from wsph.expressions import Expression, constant_program
from wsph.geometry.selection import ranges, select
from wsph.output.fields import AXES
from wsph.quantities import Model, Value

UNIT, GRAVITY = "N/m3", "m/s2"
Axis = Literal["x", "y", "z"]


class RegionForce(Model):
    """A force per volume of the reference [N/m3], along the coordinate axes, on the particles that `where` selects, or on
    all."""

    model_config = example({"where": "x > 0.5", "y": "-1e5 N/m3"})
    where: str | None = None
    x: Annotated[Value, Measured(UNIT)] | None = None
    y: Annotated[Value, Measured(UNIT)] | None = None
    z: Annotated[Value, Measured(UNIT)] | None = None

    @property
    def components(self) -> dict[str, Value]:
        """Its values by axis."""
        given = {axis: getattr(self, axis) for axis in AXES}
        return {axis: value for axis, value in given.items() if value is not None}


def gravity_of(scene: Prescribing) -> tuple[Mapping[Axis, float], dict[Axis, Prescribed]]:
    """Gravity by axis: what is always and everywhere the same [m/s2], and what changes."""
    values: dict[Axis, Prescribed] = {axis: scene.value(value, GRAVITY) for axis, value in scene.gravity.items()}
    same: dict[Axis, float] = {}
    for axis, value in values.items():
        if (number := constant(value)) is not None:
            same[axis] = number
    return same, {axis: value for axis, value in values.items() if axis not in same}


def volume_loads(
    scene: Prescribing,
    body: int,
    forces: Sequence[RegionForce],
    position: np.ndarray,
    spacing: float,
    density: float,
    domain: Domain = WHOLE,
) -> list[FaceLoad]:
    """Forces per volume on the particles at `position` (n, dim) [m] of the body of a number, as rows whose pushes are per
    unit of volume; with what changes of gravity, of a `density` [kg/m3]. Raises SceneError where one selects nothing in all
    of the `domain`."""
    found: list[FaceLoad] = []
    everywhere = np.arange(len(position))
    for axis, value in gravity_of(scene)[1].items():
        found.append(_load(value, everywhere, axis, density, position))
    for k, force in enumerate(forces):
        chosen = everywhere
        if force.where is not None:
            chosen = np.flatnonzero(select(force.where, position, spacing))
        if not any_of(domain, len(chosen) > 0):
            text = f"{force.where!r} selects no particle: they have {ranges(force.where or '', position)}"
            raise SceneError("scene", [Fault(0, f"bodies.{body}.body_force.{k}.where", text)])
        for axis, value in force.components.items():
            found.append(_load(scene.value(value, UNIT), chosen, axis, 1.0, position))
    return found


def _load(value: Prescribed, particle: np.ndarray, axis: str, factor: float, position: np.ndarray) -> FaceLoad:
    """A value on particles along an axis. What does not change in time is a number of each of them."""
    dim = position.shape[1]
    push = np.tile(factor * np.eye(dim)[AXES.index(axis)], (len(particle), 1))
    if isinstance(value, Expression) and not value.uses("t"):
        value, push = constant_program(1.0), push * value(position[particle])[:, None]
    return FaceLoad(value, particle, push, np.zeros(len(particle), int))


def times_volume(loads: list[FaceLoad], volume: np.ndarray) -> Iterator[FaceLoad]:
    """Forces per volume as forces, of particles of `volume` (n,) [m^dim]."""
    for load in loads:
        yield replace(load, push=load.push * volume[load.particle, None])
