"""`wsph advise`: which scheme suits a scene, with the error and the cost of each."""

# pyright: strict

import argparse
from pathlib import Path

from wsph.cli.command import Command
from wsph.cli.options import declare_set, overrides


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path)
    declare_set(parser)


def _act(options: argparse.Namespace) -> int:
    from wsph.accuracy.schemes import advice
    from wsph.scene.load import load

    print("\n".join(advice.told(load(options.scene, overrides(options.set)))))
    return 0


ADVISE = Command("advise", "say which scheme suits a scene, with the error and cost of each", _declare, _act)
