"""What the types of a scene's keys declare beside what they check: units, names and shorthands, as parts of JSON schemas.

`wsph schema` and `wsph list NAME` are read off these.
"""

# pyright: strict

from dataclasses import dataclass

from pydantic import ConfigDict, GetJsonSchemaHandler
from pydantic.config import JsonDict
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

QUANTITY = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*[A-Za-z1µ°]"
"""What a string with a number and a unit begins like."""

VALUE: JsonSchemaValue = {"type": ["number", "string"]}
"""The JSON schema of a number, or of a string that stands for one."""


def number_schema(
    unit: str,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
) -> JsonSchemaValue:
    """The JSON schema of a number in a unit: itself within its range, or, where it has one, a string with a unit."""
    bounds = {"exclusiveMinimum": above, "minimum": least, "exclusiveMaximum": below, "maximum": most}
    number: dict[str, object] = {"type": "number", **{key: v for key, v in bounds.items() if v is not None}}
    return {"anyOf": [number, {"type": "string", "pattern": QUANTITY}], "unit": unit} if unit else number


@dataclass(frozen=True)
class Measured:
    """The unit of a `Value`, for those who read the declaration: what it means is found where the value is used."""

    unit: str

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return handler(schema) | {"unit": self.unit}


@dataclass(frozen=True)
class Choice:
    """The names that a string may be, where a table holds them, for those who read the declaration."""

    names: tuple[str, ...]

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": "string", "enum": list(self.names)}


class Also:
    """What a key may be in a file beside its type: shorthands, as JSON schemas."""

    def __init__(self, *schema: JsonSchemaValue):
        self._schema = schema

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        own = handler(schema)
        return {"anyOf": [own, *self._schema]} if self._schema else own


def names_table(values: JsonSchemaValue) -> JsonSchemaValue:
    """The JSON schema of a table of such values by any names."""
    return {"type": "object", "additionalProperties": values}


def list_of(items: JsonSchemaValue) -> JsonSchemaValue:
    """The JSON schema of a list of such items."""
    return {"type": "array", "items": items}


def example(table: JsonDict) -> ConfigDict:
    """The configuration of a model that declares an example of its table."""
    return ConfigDict(json_schema_extra={"examples": [table]})
