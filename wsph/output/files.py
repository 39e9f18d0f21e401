"""Files that are written whole or not at all, and folders that a run may use."""

# pyright: strict

import json
import math
import os
import re
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from wsph.errors import OutputError

LOCK = ".lock"
"""The file of a folder that whoever writes there holds a lock on (`wsph.output.claim`)."""

ROW = ".row"
"""A folder inside of a search's, where the run is that may become its answer."""

ACCURACY = "accuracy.json"
"""What a search says of its answer, beside the output of that."""


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it. Raises OutputError; never leaves debris."""
    temporary = _partial(path)
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def _partial(path: Path) -> Path:
    return path.with_name(f".{path.stem}.partial{path.suffix}")


def write_text(path: Path, content: str) -> None:
    """Write a text file whole or not at all. Raises OutputError."""
    write_atomically(path, lambda temporary: _put(temporary, content))


def finite_or_none(number: float) -> float | None:
    """A number for JSON, which has no infinities: null stands there for one that is not finite."""
    return float(number) if math.isfinite(number) else None


def write_durably(path: Path, content: bytes) -> None:
    """Write a file whole or not at all, in a folder that is made for it; it is on the disk then. Raises OutputError."""

    def put(temporary: Path) -> None:
        path.parent.mkdir(exist_ok=True)
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())

    write_atomically(path, put)


def xml_text(root: ElementTree.Element) -> str:
    """An XML file's text, indented."""
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _put(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8", newline="\n")


def _has_checkpoints(folder: Path) -> bool:
    return any((folder / "checkpoints").glob("*.npz"))


def _is_a_run(folder: Path) -> bool:
    """A folder that a run made: its summary, or what it began with if it was cut off before."""
    try:
        return "particle_steps_per_second" in json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        frames, probes = folder / "frames", folder / "probes"
        if not (frames.is_dir() and probes.is_dir()):
            return False
        begun = (folder / "history.csv").is_file() or (folder / LOCK).is_file()
        # Cut off before its first table it has frames at most.
        own = all(re.fullmatch(rf"{FRAME}\.\w+", path.name) for path in frames.iterdir())
        return begun or (own and not any(probes.iterdir()))


FRAME = r"\.?frame_(\d{6})(_\d{5}-of-\d{5})?(\.partial)?"
"""The name of a frame's file, or of one of its parts', without its suffix."""


@dataclass(frozen=True)
class Kind:
    """What a folder holds: its `name`, whether a folder holds it (`owns`), so that it may be written over, and whether
    what is there can be gone on from (`goes_on`)."""

    name: str
    owns: Callable[[Path], bool]
    goes_on: Callable[[Path], bool]


RUN = Kind("run", _is_a_run, _has_checkpoints)


def check_writable(folder: Path, overwrite: bool, resume: bool = False, kind: Kind = RUN) -> None:
    """Whether what is of a `kind` may be written into `folder`, before anything is computed; leaves nothing behind. Raises
    OutputError."""
    if "\0" in str(folder):
        raise OutputError("the output folder's name has a NUL character")
    try:
        if folder.is_symlink():
            raise OutputError(f"{folder}: is a symbolic link; name the folder itself")
        check_content(folder, overwrite, resume, kind)
        ancestor = folder
        while not ancestor.exists():
            ancestor = ancestor.parent
        os.rmdir(tempfile.mkdtemp(prefix=".wsph-", dir=ancestor))
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def check_content(folder: Path, overwrite: bool, resume: bool = False, kind: Kind = RUN) -> None:
    """Whether what a folder holds may be written over, or gone on with. Arguments as in `check_writable`."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, not a folder")
    if all(each.name in (LOCK, ROW) for each in folder.iterdir()):
        return
    if not overwrite and not resume:
        on = "go on from what it holds with --resume, " if kind.goes_on(folder) else ""
        raise OutputError(f"{folder}: holds files already; {on}choose another folder with -o, or give --overwrite")
    if not kind.owns(folder):
        asked = "overwrite does not touch it" if overwrite else "resume finds nothing there"
        raise OutputError(f"{folder}: holds no {kind.name} of wsph, so --{asked}")


def own_files(folder: Path, listings: Sequence[str], suffixes: Sequence[str]) -> list[Path]:
    """The files that an earlier run wrote in a folder, and no others: its frames have one of the `suffixes`, and `listings`
    are the files that list frames."""
    frames = [path for _, path in own_frames(folder, suffixes)]
    own = [folder / name for name in ("summary.json", "history.csv", "relax.csv", ACCURACY, *filter(None, listings))]
    own += [_partial(path) for path in own]
    own += list((folder / "checkpoints").glob("*checkpoint_*.npz"))
    return [*frames, *(folder / "probes").glob("*.csv"), *own]


def own_frames(folder: Path, suffixes: Sequence[str]) -> list[tuple[int, Path]]:
    """The files of frames of those `suffixes` in a folder, and of their parts, with the numbers of the frames."""
    frame = re.compile(rf"{FRAME}\.({'|'.join(map(re.escape, suffixes))})")
    found = ((frame.fullmatch(path.name), path) for path in (folder / "frames").glob("*"))
    return [(int(match[1]), path) for match, path in found if match is not None]
