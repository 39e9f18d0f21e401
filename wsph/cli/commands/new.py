"""`wsph new`: a scene, an example, a study, or a package of a material or an integrator, to begin with."""

# pyright: strict

import argparse
from pathlib import Path

from wsph.cli.command import Command

NEXT = {
    "scene": "wsph run {0}",
    "example": "wsph run {0}",
    "study": "wsph study {0}",
    "material": "cd {1} && pip install -e . pytest && pytest",
    "integrator": "cd {1} && pip install -e . pytest && pytest",
}


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", choices=list(NEXT), help="what to begin")
    parser.add_argument("name", metavar="NAME", help="its name; of an example, one of `wsph list examples`")
    parser.add_argument(
        "--total", action="store_true", help="of a material: a law of the deformation, for large strain"
    )


def _act(options: argparse.Namespace) -> int:
    from wsph.catalogue.starting import start

    written = start(options.kind, options.name, Path(), total=options.total)
    for path in written:
        print(path)
    print(f"next: {NEXT[options.kind].format(written[0], written[0].parent)}")
    return 0


NEW = Command(
    "new",
    "write a scene, a shipped example, a study, or a package of a material or an integrator to begin with",
    _declare,
    _act,
)
