"""`wsph check`: validate a scene and print what it is composed of."""

# pyright: strict

import argparse
from pathlib import Path

from wsph.cli.command import Command
from wsph.cli.options import declare_set, overrides


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path)
    declare_set(parser)
    parser.add_argument(
        "--ranks", type=int, metavar="N", help="tell what N processes would take that share it, as by mpiexec"
    )


def _act(options: argparse.Namespace) -> int:
    from wsph.checking import described
    from wsph.scene.load import load

    scene = load(options.scene, overrides(options.set))
    for key, value in described(scene, str(options.scene), options.ranks):
        print(f"{key:<14} {value}")
    return 0


CHECK = Command("check", "validate a scene and print what it is composed of", _declare, _act)
