"""Scene files."""

# pyright: strict

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from wsph.errors import Fault, SceneError
from wsph.scene.files import find_files
from wsph.scene.lines import line_of, lines
from wsph.scene.scene import Scene, apply_override


def prepared(scene: Scene | str | Path, overrides: Mapping[str, object]) -> Scene:
    """A scene, read where it is a file's, with `overrides` as of `Scene.with_`."""
    read = load(scene) if isinstance(scene, (str, Path)) else scene
    return read.with_(**overrides) if overrides else read


def load(path: str | Path, overrides: Mapping[str, object] | None = None) -> Scene:
    """Read and validate a scene file; files that its bodies and tools name are looked for beside it first. Raises SceneError
    with every fault, its line and key."""
    source = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(source, [Fault(0, "", "no such file")]) from None
    except (OSError, ValueError) as error:
        raise SceneError(source, [Fault(0, "", f"cannot be read: {error}")]) from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, found = str(error), re.search(r" \(at line (\d+), column (\d+)\)", str(error))
        line = int(found[1]) if found else 0
        raise SceneError(source, [Fault(line, "", f"is not TOML: {message.split(' (at ')[0]}")]) from None
    except RecursionError:
        raise SceneError(source, [Fault(0, "", "is nested too deeply to be read")]) from None
    where = lines(text)
    try:
        for key, value in (overrides or {}).items():
            apply_override(data, key, value)
        for tables in ("bodies", "tools"):
            find_files(data.get(tables), Path(path).parent)
        scene = Scene(**data)
    except SceneError as error:
        found = [Fault(line_of(where, f.key), f.key, f.message) for f in error.faults]
        raise SceneError(source, found) from None
    scene.read_from(source, where)
    return scene
