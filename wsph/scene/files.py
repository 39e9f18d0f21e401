"""Files that bodies and tools name, found from the folder of their scene, and what they hold."""

# pyright: strict

import hashlib
from pathlib import Path

from wsph.quantities import is_list, is_table

KEY = "file"
"""The key of a file in any table of a body or tool."""


def find_files(bodies: object, folder: Path) -> None:
    """Make the relative paths of files under `bodies`, which stand in `folder`, absolute, in place. Those that are not
    there are left as they are: they may be where the program runs."""
    if is_table(bodies):
        for key, value in bodies.items():
            if key == KEY and isinstance(value, str):
                path = folder / value
                if value and path.is_file():
                    bodies[key] = str(path.absolute())
            else:
                find_files(value, folder)
    elif is_list(bodies):
        for body in bodies:
            find_files(body, folder)


def file_digests(bodies: object, key: str = "bodies") -> dict[str, str]:
    """A digest of every file that tables under `bodies` name, by its key in the scene; "" of one that cannot be read."""
    found: dict[str, str] = {}
    if is_list(bodies):
        for k, body in enumerate(bodies):
            found |= file_digests(body, f"{key}.{k}")
    elif is_table(bodies):
        for name, value in bodies.items():
            if name == KEY and isinstance(value, str):
                found[f"{key}.{name}"] = _digest(Path(value))
            else:
                found |= file_digests(value, f"{key}.{name}")
    return found


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""
