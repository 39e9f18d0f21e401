"""Springs and dashpots between faces and the ground: a traction -k u - c v, k [N/m3] and c [N s/m3].

Every particle of the selected faces is held by the area A that it stands for, f = -A (k u + c v). Both are numbers, of every
direction, or have parts along the normal of the faces at the start and along the faces, or along the axes.
"""

# pyright: strict

from collections.abc import Iterator
from typing import Annotated, ClassVar

import numpy as np
from pydantic import GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.boundary.loads.acting import ActingLoad, Load
from wsph.boundary.loads.ground import Ground
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.declarations import Also, example, number_schema
from wsph.output.fields import AXES
from wsph.quantities import Model, Unit, is_table
from wsph.units import Scales, quantity

BY_FACE = ("normal", "tangential")


class Directed(Model):
    """A coefficient per area: of `every` direction, or its parts by the faces or by the axes; what is not named is zero."""

    unit: ClassVar[str] = ""
    every: Annotated[float, Unit("", ge=0)] | None = None
    normal: Annotated[float, Unit("", ge=0)] | None = None
    tangential: Annotated[float, Unit("", ge=0)] | None = None
    x: Annotated[float, Unit("", ge=0)] | None = None
    y: Annotated[float, Unit("", ge=0)] | None = None
    z: Annotated[float, Unit("", ge=0)] | None = None

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        found = handler.resolve_ref_schema(handler(schema))
        found["properties"] = {key: number_schema(cls.unit, None, 0.0) for key in cls.model_fields}
        return found

    @model_validator(mode="before")
    @classmethod
    def _in_its_unit(cls, given: object) -> object:
        table = given if is_table(given) else {"every": given}
        return {key: quantity(value, cls.unit) if key in cls.model_fields else value for key, value in table.items()}

    @model_validator(mode="after")
    def _of_one_kind(self) -> "Directed":
        given = self.model_dump(exclude_none=True)
        kinds = (("every",), BY_FACE, tuple(AXES))
        if not any(set(given) <= set(kind) for kind in kinds) or not any(value > 0.0 for value in given.values()):
            raise ValueError("is a number above zero, or such numbers by normal and tangential, or by x, y, z")
        return self

    def faults(self, dim: int) -> Iterator[str]:
        """What of it a scene of a dimension does not have."""
        beyond = [axis for axis in AXES[dim:] if getattr(self, axis) is not None]
        if beyond:
            yield f"has {', '.join(beyond)}, which a scene of dim = {dim} does not have"
        if dim == 1 and self.tangential is not None:
            yield "has a tangential part, which a bar does not have: write a number"

    def matrices(self, faces: LoadedFaces) -> np.ndarray:
        """Of the area that each particle of the faces stands for, (k, dim, dim)."""
        dim = faces.normal.shape[1]
        if self.every is not None:
            return self.every * faces.area[:, None, None] * np.eye(dim)
        if self.normal is None and self.tangential is None:
            along = np.diag([getattr(self, axis) or 0.0 for axis in AXES[:dim]])
            return faces.area[:, None, None] * along
        return by_face(faces, self.normal or 0.0, self.tangential or 0.0)


def by_face(faces: LoadedFaces, normal: float, tangential: float) -> np.ndarray:
    """Coefficients along the normals and along the faces, of the area that each particle stands for, (k, dim, dim)."""
    size = np.linalg.norm(faces.vector, axis=2)
    n = faces.vector / np.where(size > 0.0, size, 1.0)[..., None]
    across = n[..., :, None] * n[..., None, :]
    one = np.eye(n.shape[2])
    each = size[..., None, None] * (normal * across + tangential * (one - across))
    total = np.zeros((len(faces.particle), *one.shape))
    np.add.at(total, np.searchsorted(faces.particle, faces.corners), each)
    return total


class Stiffness(Directed):
    """Of springs [N/m3]."""

    model_config = example({"normal": "1e9 N/m3", "tangential": "1e8 N/m3"})
    unit: ClassVar[str] = "N/m3"


class Damping(Directed):
    """Of dashpots [N s/m3]."""

    model_config = example({"every": "1e5 N s/m3"})
    unit: ClassVar[str] = "N s/m3"


class Spring(Load):
    """Springs to the ground, of `stiffness` per area [N/m3], and dashpots, of `damping` per area [N s/m3]."""

    model_config = example({"stiffness": "1e9 N/m3"})
    key: ClassVar[str] = "spring"
    stiffness: Annotated[Stiffness, Also(number_schema("N/m3", 0.0))] | None = None
    damping: Annotated[Damping, Also(number_schema("N s/m3", 0.0))] | None = None

    @model_validator(mode="after")
    def _something(self) -> "Spring":
        if self.stiffness is None and self.damping is None:
            raise ValueError("needs stiffness, damping or both")
        return self

    @property
    def resists(self) -> bool:
        return self.damping is not None

    def faults(self, dim: int) -> Iterator[tuple[str, str]]:
        for key, each in (("stiffness", self.stiffness), ("damping", self.damping)):
            yield from ((key, text) for text in (each.faults(dim) if each is not None else ()))

    def attach(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays) -> ActingLoad:
        found = [
            each.matrices(faces) / scales.of(each.unit) if each is not None else None
            for each in (self.stiffness, self.damping)
        ]
        return Ground(faces, found[0], found[1], space, clock, arrays)
