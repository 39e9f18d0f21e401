"""The tables of a scene that say what is prescribed: boundary conditions and functions of time."""

# pyright: strict

from typing import TYPE_CHECKING, Annotated, Literal, Protocol, cast

from pydantic import AfterValidator, BaseModel, Field, create_model, model_validator
from pydantic.fields import FieldInfo

from wsph.boundary.loads.acting import Load
from wsph.boundary.loads.table import LOADS
from wsph.boundary.programs.functions import Function
from wsph.declarations import Also, Choice, Measured, example
from wsph.expressions import Expression
from wsph.quantities import Model, Strings, Value, file_name

FACES = ("-x", "+x", "-y", "+y", "-z", "+z")


def _face(value: str) -> str:
    if value not in FACES:
        raise ValueError(f"{value!r} is no face; write -x, +x, -y, ...")
    return value


class _Selection(Model):
    """Where something is prescribed, and what is prescribed there of the body's own fields."""

    name: Annotated[str, AfterValidator(file_name)] | None = None
    """of its reaction and work in history.csv; without it BODY-1 and so on"""
    body: str
    """the body that it is of"""
    where: str | None = None
    """a comparison of x, y, z that selects particles"""
    face: Annotated[str, AfterValidator(_face), Choice(FACES)] | None = None
    """the outermost faces that look along an axis"""
    patch: Annotated[str, Field(min_length=1)] | None = None
    """a part of the surface by its name: `wsph check` lists them"""
    velocity: dict[str, Annotated[Value, Measured("m/s")]] = {}
    """by component, of the selected particles"""
    displacement: dict[str, Annotated[Value, Measured("m")]] = {}
    """the same, zero at t = 0"""
    acceleration: dict[str, Annotated[Value, Measured("m/s2")]] = {}
    """the same"""
    fixed: Strings = ()
    """components of the velocity that are held at zero"""
    symmetry: Literal["x", "y", "z"] | None = None
    """the axis across which nothing moves"""
    stress: dict[str, Annotated[Value, Measured("Pa")]] = {}
    """nominal, by component, along the axes of the shape"""
    traction: dict[str, Annotated[Value, Measured("Pa")]] = {}
    """force per reference area, by component"""
    force: dict[str, Annotated[Value, Measured("N, in 2D N/m, in 1D N/m2")]] = {}
    """a whole force, by component, in even parts of the area"""
    normal: Annotated[Value, Measured("m/s")] | None = None
    """velocity along the faces' own normals: 0 slides"""
    periodic: Annotated[str, AfterValidator(_face), Choice(FACES)] | None = None
    """the face opposite, which is one with `face`"""
    steps: Strings = ()
    """the steps of the run in which it holds: all"""


def _key_of(load: type[Load]) -> object:
    """The type of a load's key: its table, or what stands for one."""
    return Annotated[load | None, Also(*load.shorthand)]


if TYPE_CHECKING:
    _WithLoads = _Selection
else:
    _WithLoads = create_model(
        "_WithLoads", __base__=_Selection, **{key: (_key_of(load), None) for key, load in LOADS.items()}
    )


class Boundary(_WithLoads):
    """Prescribed values on a face, a patch with a name, or on the particles that `where` selects."""

    model_config = example({"body": "bar", "face": "-x", "fixed": ["x", "y"]})

    @model_validator(mode="after")
    def _complete(self) -> "Boundary":
        if [self.where, self.face, self.patch].count(None) != 2:
            raise ValueError("exactly one of where, face and patch is needed")
        own = ("velocity", "displacement", "acceleration", "fixed", "symmetry", "stress", "traction", "force")
        given = (*(getattr(self, key) for key in own), self.normal is not None, self.periodic is not None)
        if not (any(given) or self.acting):
            kinds = [*own, "normal", "periodic", *LOADS]
            raise ValueError(f"nothing is prescribed: give {', '.join(kinds[:-1])} or {kinds[-1]}")
        if self.force and self.traction:
            raise ValueError("force is a total one, and traction one per area: give one of them, or another entry")
        if self.periodic is not None and (any(given[:-1]) or self.acting or self.face is None):
            raise ValueError("periodic goes with face alone: write another entry for what else acts there")
        return self

    @property
    def acting(self) -> dict[str, Load]:
        """Loads that follow the state, by their keys."""
        given = {key: getattr(self, key, None) for key in LOADS}
        return {key: load for key, load in given.items() if load is not None}


class Prescribing(Protocol):
    """A scene, as its boundary conditions see it."""

    @property
    def dim(self) -> int: ...

    @property
    def boundary(self) -> tuple[Boundary, ...]: ...

    @property
    def gravity(self) -> dict[Literal["x", "y", "z"], Value]: ...

    def value(self, value: Value, unit: str) -> Expression | Function:
        """The program of a value: a table of `functions`, or an expression."""
        ...

    def windows(self, names: tuple[str, ...]) -> tuple[tuple[float, float], ...]:
        """The times in which steps of the run are, by their names."""
        ...


def add_load(load: type[Load], *scenes: type[BaseModel]) -> None:
    """Give boundaries the key of a load that has joined `LOADS` after they were defined; `scenes` are the models that hold
    boundaries."""
    LOADS[load.key] = load
    Boundary.__pydantic_fields__[load.key] = FieldInfo.from_annotated_attribute(cast(type, _key_of(load)), None)
    for model in (Boundary, *scenes):
        model.model_rebuild(force=True)


def remove_load(load: type[Load], *scenes: type[BaseModel]) -> None:
    """Undo `add_load`."""
    del LOADS[load.key], Boundary.__pydantic_fields__[load.key]
    for model in (Boundary, *scenes):
        model.model_rebuild(force=True)
