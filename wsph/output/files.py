"""Files that are written whole or not at all, and folders that a run may use."""

# pyright: strict

import json
import os
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

from wsph.errors import OutputError


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it. Raises OutputError, leaving no debris."""
    temporary = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error


def write_text(path: Path, content: str) -> None:
    """Write a text file whole or not at all. Raises OutputError."""
    write_atomically(path, lambda temporary: _put(temporary, content))


def xml_text(root: ElementTree.Element) -> str:
    """An XML file's text, indented."""
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _put(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8", newline="\n")


def check_writable(folder: Path, overwrite: bool, resume: bool = False) -> None:
    """Whether a run may use `folder`, before anything is computed; leaves nothing behind. Raises OutputError."""
    if "\0" in str(folder):
        raise OutputError("the output folder's name has a NUL character")
    try:
        _check(folder, overwrite or resume)
        ancestor = folder
        while not ancestor.exists():
            ancestor = ancestor.parent
        os.rmdir(tempfile.mkdtemp(prefix=".wsph-", dir=ancestor))
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _check(folder: Path, overwrite: bool) -> None:
    if folder.is_symlink():
        raise OutputError(f"{folder}: is a symbolic link; name the folder itself")
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, not a folder")
    if not any(folder.iterdir()):
        return
    if not overwrite:
        raise OutputError(f"{folder}: holds files already; choose another folder with -o, or give --overwrite")
    if not _is_a_run(folder):
        raise OutputError(f"{folder}: holds no run of wsph, so --overwrite does not touch it")


def _is_a_run(folder: Path) -> bool:
    """A folder that a run made: its summary, or the index of its frames if it was cut off before."""
    try:
        return "particle_steps_per_second" in json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return (folder / "history.csv").is_file() and (folder / "frames").is_dir() and (folder / "probes").is_dir()


def own_files(folder: Path, listings: Sequence[str], suffixes: Sequence[str]) -> list[Path]:
    """The files that an earlier run wrote in a folder, and no others: its frames have one of the `suffixes`, and `listings`
    are the files that list frames."""
    frame = re.compile(rf"\.?frame_\d{{6}}(\.partial)?\.({'|'.join(map(re.escape, suffixes))})")
    frames = [path for path in (folder / "frames").glob("*") if frame.fullmatch(path.name)]
    own = [folder / name for name in ("summary.json", "history.csv", *filter(None, listings))]
    own += list((folder / "checkpoints").glob("*checkpoint_*.npz"))
    return [*frames, *(folder / "probes").glob("*.csv"), *own]
