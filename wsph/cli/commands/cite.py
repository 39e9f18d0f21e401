"""`wsph cite`: the references of the methods that a run was made with, as BibTeX."""

# pyright: strict

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from wsph.cli.command import Command
from wsph.errors import WsphError

if TYPE_CHECKING:
    from wsph.quantities import Table


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run", type=Path, metavar="DIR", help="the folder of a run, or a scene")


def _act(options: argparse.Namespace) -> int:
    from wsph.catalogue.citations import bibliography

    print(bibliography(_scene(options.run)))
    return 0


def _scene(path: Path) -> "Table":
    """The scene of a folder, or of a file."""
    from wsph.quantities import is_table

    if not path.is_dir():
        from wsph.scene.load import load

        return load(path).data()
    try:
        said: object = json.loads((path / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise WsphError(f"{path}: has no summary.json of a run that can be read: {error}") from None
    scene = said.get("scene") if is_table(said) else None
    if not is_table(scene):
        raise WsphError(f"{path}/summary.json: holds no scene: it is not the summary of a run")
    return scene


CITE = Command("cite", "print the references of the methods of a run, as BibTeX", _declare, _act)
