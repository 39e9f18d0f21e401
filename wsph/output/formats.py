"""The formats that frames are written in.

To add one, write its file beside this one and put an instance in the list.
"""

# pyright: strict

import importlib.util
from collections.abc import Sequence
from pathlib import Path

from wsph.errors import OutputError
from wsph.output import files
from wsph.output.frames import Format
from wsph.output.npz import Npz
from wsph.output.vtkhdf import Vtkhdf
from wsph.output.vtu import Vtu
from wsph.output.xdmf import Xdmf

FORMATS: list[Format] = [Vtu(), Vtkhdf(), Xdmf(), Npz()]


def names() -> list[str]:
    """The names of all formats, as scenes write them."""
    return [each.name for each in FORMATS]


def named(wanted: Sequence[str]) -> list[Format]:
    """The formats of those names."""
    return [each for name in wanted for each in FORMATS if each.name == name]


def own_files(folder: Path) -> list[Path]:
    """The files that an earlier run wrote in a folder, and no others."""
    return files.own_files(folder, [each.listing for each in FORMATS], suffixes(FORMATS))


def suffixes(wanted: Sequence[Format]) -> list[str]:
    """Those of the files of frames of formats, and of those that join them."""
    return list(dict.fromkeys(suffix for each in wanted for suffix in (each.suffix, each.joins) if suffix))


def check_installed(wanted: Sequence[str]) -> None:
    """Raise OutputError for a format whose package is not installed."""
    for each in named(wanted):
        if each.needs and importlib.util.find_spec(each.needs) is None:
            raise OutputError(f'the format {each.name} needs {each.needs}: pip install "wsph[{each.name}]"')
