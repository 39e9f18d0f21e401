"""The JSON schema of scenes, so that editors complete and check them: from the models that read them, with the keys of every
installed plugin."""

# pyright: strict

from collections.abc import Iterator

from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaValue

from wsph.catalogue.docstrings import attribute_docstrings
from wsph.errors import PluginError
from wsph.plugins import registry
from wsph.plugins.declared import integrator_schema, material_schema
from wsph.quantities import Model, Table, is_list, is_table

DIALECT = "https://json-schema.org/draft/2020-12/schema"

PLUGINS = {"MaterialSpec": ("materials", "model"), "IntegratorSpec": ("integrators", "name")}
"""Definitions of the tables whose keys are a plugin's: the group, and the key that names it."""


def scene_schema() -> Table:
    """The JSON schema of a scene, with the keys of every plugin that can be imported."""
    found = bare_scene_schema()
    definitions = found["$defs"]
    assert is_table(definitions)
    for name, (group, key) in PLUGINS.items():
        tables = list(plugin_schemas(group).values())
        # Of a plugin that cannot be imported nothing is known but that a table names it.
        other = {"type": "object", "properties": {key: {"type": "string"}}, "required": [key]}
        definitions[name] = {"anyOf": [*tables, other]} if not tables else {"oneOf": tables}
    found["title"], found["description"] = "wsph scene", "A scene of wsph: all that there is to say of a run."
    return {"$schema": DIALECT, **found}


def bare_scene_schema() -> Table:
    """The JSON schema of a scene without the keys of plugins; none is imported."""
    from wsph.scene.scene import Scene

    found = schema_of(Scene)
    for model in _tables(Model):
        _describe(found, model)
    return found


def _tables(of: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """The tables that are known of a kind."""
    for each in of.__subclasses__():
        yield each
        yield from _tables(each)


def _describe(schema: Table, model: type[BaseModel]) -> None:
    """Give the keys of a table what stands below them in its classes, and those before it."""
    definitions = schema.get("$defs")
    table = definitions.get(model.__name__) if is_table(definitions) else None
    properties = table.get("properties") if is_table(table) else None
    if not is_table(properties):
        return
    # Classes that are made of tables have no source.
    own = (each for each in model.__mro__ if each.__module__.startswith("wsph.") and "_With" not in each.__name__)
    for cls in own:
        for attribute, said in attribute_docstrings(cls).items():
            field = model.model_fields.get(attribute)
            name = attribute if field is None else field.alias or attribute
            if is_table(key := properties.get(name)) and said not in (name, attribute):
                properties[name] = {"description": said, **key}


def schema_of(model: type[BaseModel]) -> Table:
    """The JSON schema of a model, tidied."""
    found = _tidy(model.model_json_schema(by_alias=True))
    assert is_table(found)
    return found


def plugin_schemas(group: str) -> dict[str, JsonSchemaValue]:
    """The tables of all plugins of a group that can be imported, by name."""
    found: dict[str, JsonSchemaValue] = {}
    for entry in registry.entries(group):
        try:
            found[entry.name] = plugin_schema(group, entry.name)
        except PluginError:
            continue
    return found


def plugin_schema(group: str, name: str) -> JsonSchemaValue:
    """The table of a plugin. Raises PluginError where it cannot be imported."""
    plugin = registry.load(group, name)
    return material_schema(plugin, name) if group == "materials" else integrator_schema(plugin, name)


def _tidy(part: object) -> object:
    """Without pydantic's titles and its null for a key that is left out, which TOML cannot write; lists with their lengths
    as lists have them."""
    if is_list(part):
        return [_tidy(each) for each in part]
    if not is_table(part):
        return part
    kept = {key: value for key, value in part.items() if not (key == "title" and isinstance(value, str))}
    if kept.get("type") == "array":
        names = {"minLength": "minItems", "maxLength": "maxItems"}
        kept = {names.get(key, key): value for key, value in kept.items()}
    if "default" in kept and kept["default"] is None:
        del kept["default"]
    if is_list(choices := kept.get("anyOf")):
        left = [each for each in choices if each != {"type": "null"}]
        rest = {key: value for key, value in kept.items() if key != "anyOf"}
        only = left[0] if len(left) == 1 else None
        kept = {**only, **rest} if is_table(only) else {**rest, "anyOf": left}
    return {key: _tidy(value) for key, value in kept.items()}
