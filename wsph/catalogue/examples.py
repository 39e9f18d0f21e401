"""An example of a table, as a scene has it: the one that its model declares, or what it needs with plain values."""

# pyright: strict

from wsph.catalogue.keys import bounds_of, resolved, unit_of, written
from wsph.quantities import Table, is_list, is_table

PLAIN: dict[str, object] = {
    "kg/m3": 7850.0,
    "Pa": "1 MPa",
    "m": "10 mm",
    "m/s": 1.0,
    "s": "1 ms",
    "1/s": 1.0,
    "K": 300.0,
    "J/m2": 100.0,
}
"""Values of keys by their units, where they are within the range."""

BY_NAME: dict[str, object] = {
    "youngs_modulus": "210 GPa",
    "bulk_modulus": "175 GPa",
    "shear_modulus": "81 GPa",
    "yield_stress": "350 MPa",
    "name": "bar",
    "body": "bar",
}
"""Values of keys whose names say what they are."""

NUMBERS = (1.0, 0.3, 0.0, 2.0, 10.0)


def example_of(schema: Table, root: Table) -> Table:
    """An example of a table by its schema; definitions are those of `root`."""
    properties, needed = schema.get("properties"), schema.get("required", [])
    if not is_table(properties) or not is_list(needed):
        return {}
    if is_list(given := schema.get("examples")) and given and is_table(shown := given[0]):
        return {name: shown[name] for name in properties if name in shown}
    needs = {name: part for name, part in properties.items() if name in needed and is_table(part)}
    own = {
        name: BY_NAME[name] for name, part in needs.items() if name in BY_NAME and not {"const", "examples"} & set(part)
    }
    return {name: own.get(name) or _value(part, root) for name, part in needs.items()}


def toml(header: str, table: Table) -> str:
    """A table as a scene has it, under its header."""
    return "\n".join([header, *(f"{key} = {written(value)}" for key, value in table.items())])


def _value(part: Table, root: Table) -> object:
    if is_list(given := part.get("examples")) and given:
        return given[0]
    if "const" in part:
        return part["const"]
    if "default" in part:
        return part["default"]
    if is_list(names := part.get("enum")):
        return names[0]
    part = resolved(part, root)
    for way in ("anyOf", "oneOf"):
        if is_list(choices := part.get(way)) and is_table(choices[0]):
            return _number(part) if choices[0].get("type") == "number" else _value(choices[0], root)
    kind = part.get("type")
    if kind == "number" or is_list(kind):
        return _number(part)
    if kind == "integer":
        return max(int(_least(part)), 1)
    if kind == "array":
        items = part.get("items")
        return [_value(items, root)] if is_table(items) else []
    if kind == "object":
        return example_of(part, root)
    return kind == "boolean" or "name"


def _number(part: Table) -> object:
    """A number within its range: of its unit the plain one, where that is allowed."""
    plain = PLAIN.get(unit_of(part))
    if plain is not None:
        return plain
    bounds = bounds_of(part)
    return next((number for number in NUMBERS if _within(number, bounds)), 0.1)


def _within(number: float, bounds: list[tuple[str, float]]) -> bool:
    tests = {">": number.__gt__, ">=": number.__ge__, "<": number.__lt__, "<=": number.__le__}
    return all(tests[sign](bound) for sign, bound in bounds)


def _least(part: Table) -> float:
    least = part.get("minimum", 1)
    return float(least) if isinstance(least, (int, float)) else 1.0
