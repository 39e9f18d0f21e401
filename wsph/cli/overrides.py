"""`--set KEY=VALUE`: a scene's keys, changed on the command line."""

# pyright: strict

import argparse
import tomllib

from wsph.errors import WsphError


def declare_set(parser: argparse.ArgumentParser) -> None:
    """Add `--set` to a command that reads a scene."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a key, e.g. --set bodies.0.spacing=0.005",
    )


def overrides(pairs: list[str]) -> dict[str, object]:
    """The keys of a scene that `--set` changes, by their dotted names."""
    result: dict[str, object] = {}
    for pair in pairs:
        key, separator, text = pair.partition("=")
        if not separator or not key:
            raise WsphError(f"--set {pair}: write it as KEY=VALUE")
        try:
            read = tomllib.loads(f"v = {text}")
        except tomllib.TOMLDecodeError:
            result[key] = text
            continue
        except RecursionError:
            raise WsphError(f"--set {key}: its value is nested too deeply to be read") from None
        if len(read) > 1:
            raise WsphError(f"--set {key}: gives more than one value; write --set once for each")
        result[key] = read["v"]
    return result
