"""Scenes: the input of a run, as validated data. The TOML file and the Python API are the same models.

Every fault of a scene is reported at once, each with its line, key, value and what would be right, before anything is
compiled or written. What a plugin says about its own keys is checked here too: the material and the integrator that the
scene names are the only plugins imported.
"""

# pyright: strict

import copy
import dataclasses
import html
import json
from collections.abc import Mapping
from typing import Any, cast

from pydantic import BaseModel, PrivateAttr, ValidationError

from wsph.errors import Fault, SceneError
from wsph.plugins.options import keys_of
from wsph.quantities import Table, in_words, is_list, is_table
from wsph.scene.checks import between_tables, of_plugins
from wsph.scene.lines import line_of
from wsph.scene.messages import of_validation, scene_path
from wsph.scene.tables import SceneTables
from wsph.scene.touch.tool_checks import of_tools

DEEPEST = 50
"""Dots in the path of an override."""


in_words.append(of_validation)


class Scene(SceneTables):
    """A whole scene. `wsph.Scene(...)` and a TOML file take the same keys; both raise SceneError."""

    _source: str = PrivateAttr("scene")
    _lines: dict[str, int] = PrivateAttr(default_factory=dict)

    def __init__(self, /, **data: object):
        faults: list[Fault] = []
        data = {key: _plain(value) for key, value in data.items()}
        given: dict[str, Any] = data
        try:
            super().__init__(**given)
        except ValidationError as error:
            # A default that follows from other keys is missing where one of those is at fault.
            found = [e for e in error.errors(include_url=False) if e["type"] != "default_factory_not_called"]
            faults = [of_validation(e, Scene) for e in found]
            faults += _beyond(data, error)
        else:
            faults = [*between_tables(self), *of_tools(self)]
        faults += of_plugins(data)
        if faults:
            raise SceneError("scene", faults)

    def __hash__(self) -> int:
        return hash(self.model_dump_json())

    def __eq__(self, other: object) -> bool:
        # The file that a scene was read from is no part of the scene.
        return isinstance(other, Scene) and self.model_dump() == other.model_dump()

    def __repr__(self) -> str:
        names = ", ".join(body.name for body in self.bodies)
        acting = f", {len(self.boundary)} boundaries, {len(self.contact)} contacts, {len(self.probes)} probes"
        return (
            f"<scene {self.title or self._source!r}: {self.dim}D, {self.run.integrator.name}, bodies {names}{acting}>"
        )

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        """The tables of the scene, for notebooks."""
        return "<pre>" + html.escape(json.dumps(self.data(), indent=1, ensure_ascii=False)) + "</pre>"

    def located(self, error: SceneError) -> SceneError:
        """A fault found later, with this scene's file and the lines of its keys."""
        return SceneError(self._source, [Fault(line_of(self._lines, f.key), f.key, f.message) for f in error.faults])

    def read_from(self, source: str, lines: Mapping[str, int]) -> None:
        """Say where it was read: the file, and the lines of its keys."""
        self._source, self._lines = source, dict(lines)

    def data(self) -> Table:
        """The scene as plain data, as a TOML file would give it."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True, exclude_unset=True)

    def with_(self, **overrides: object) -> "Scene":
        """The scene with some keys changed.

        A key is a dotted path (`**{"bodies.0.spacing": 0.005}`) or the name of a key of [run] (`cfl=2.0`). Giving one of
        cfl and dt takes the other away. Raises SceneError.
        """
        data = self.data()
        for path, value in overrides.items():
            apply_override(data, path, value)
        changed = Scene(**data)
        changed.read_from(self._source, self._lines)
        return changed


def _plain(value: object) -> object:
    """Tables that Python gives as objects as plain data, as a file has them."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", by_alias=True, exclude_none=True, exclude_unset=True)
    if is_table(value):
        return {key: _plain(each) for key, each in value.items()}
    if is_list(value):
        return [_plain(each) for each in value]
    if isinstance(value, tuple):
        return tuple(_plain(each) for each in cast(tuple[object, ...], value))
    return keys_of("materials", value) if dataclasses.is_dataclass(value) else value


def apply_override(data: Table, path: str, value: object) -> None:
    """Set the dotted `path` in a scene's data. Raises SceneError where the path leads nowhere."""
    if path.count(".") > DEEPEST:
        raise SceneError("scene", [Fault(0, path[:100], f"leads more than {DEEPEST} tables deep")])
    keys = path.split(".") if "." in path or path in (*Scene.model_fields, "schema") else ["run", path]
    if keys in (["run", "cfl"], ["run", "dt"]) and is_table(run := data.get("run")):
        run.pop("dt" if keys[1] == "cfl" else "cfl", None)
    place: object = data
    for key in keys[:-1]:
        if is_table(place):
            place = place.setdefault(key, {})
        elif is_list(place) and _is_index(key, place):
            place = place[int(key)]
        else:
            raise SceneError("scene", [Fault(0, path, f"there is no entry {key!r}")])
    if is_table(place):
        place[keys[-1]] = value
    elif is_list(place) and _is_index(keys[-1], place):
        place[int(keys[-1])] = value
    else:
        raise SceneError("scene", [Fault(0, path, f"there is no entry {keys[-1]!r}")])


def _is_index(key: str, place: list[object]) -> bool:
    return key.isascii() and key.isdigit() and int(key) < len(place)


def _beyond(data: Table, error: ValidationError) -> list[Fault]:
    """Faults between tables of a scene that has unknown keys: found without them, so that all are told at once."""
    if any(e["type"] != "extra_forbidden" for e in error.errors()):
        return []
    repaired = copy.deepcopy(data)
    for e in error.errors():
        place: Any = repaired
        *outer, last = scene_path(e["loc"])
        for key in outer:
            # A table may stand for a list of one.
            place = place if isinstance(key, int) and is_table(place) else place[key]
        place.pop(last, None)
    try:
        Scene(**repaired)
    except SceneError as other:
        return other.faults
    return []
