"""Files that bodies name, found from the folder of their scene."""

# pyright: strict

from pathlib import Path

from wsph.quantities import is_list, is_table

KEY = "file"
"""The key of a file in any table of a body."""


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
