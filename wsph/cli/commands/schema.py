"""`wsph schema`: the JSON schema of scenes or studies, with which editors complete and check them."""

# pyright: strict

import argparse
import json

from wsph.cli.command import Command


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("of", nargs="?", choices=["scene", "study"], default="scene", help="default: scene")


def _act(options: argparse.Namespace) -> int:
    from wsph.catalogue.schema import DIALECT, scene_schema, schema_of
    from wsph.study.tables import Study

    found = scene_schema() if options.of == "scene" else {"$schema": DIALECT, **schema_of(Study), "title": "wsph study"}
    print(json.dumps(found, indent=1, ensure_ascii=False))
    return 0


SCHEMA = Command("schema", "print the JSON schema of scenes, with which editors complete them", _declare, _act)
