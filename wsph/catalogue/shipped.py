"""The example scenes that ship with wsph, and what belongs to each."""

# pyright: strict

import re
from pathlib import Path

from wsph.errors import WsphError
from wsph.scene.messages import none_of

_HERE = Path(__file__).resolve()

EXAMPLES = next(each / "examples" for each in _HERE.parents if (each / "examples").is_dir())
"""The folder of the shipped scenes: inside of the package in an installation, beside it in a checkout."""


def names() -> list[str]:
    """The names of the examples."""
    return sorted(path.stem for path in EXAMPLES.glob("*.toml"))


def about(name: str) -> str:
    """The first sentence of what an example says of itself."""
    said: list[str] = []
    for line in (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8").splitlines():
        if not (words := line.removeprefix("#").strip()):
            break
        said.append(words)
    return re.split(r"\.\s", " ".join(said), maxsplit=1)[0].removesuffix(".")


def example(name: str) -> dict[str, bytes]:
    """The files of an example by their names: the scene, and the bodies and tables that it reads. Raises WsphError for a
    name that is none of them."""
    if name not in names():
        raise WsphError(none_of(name, names()))
    scene = EXAMPLES / f"{name}.toml"
    named = re.findall(r'"([^"\n]+\.\w+)"', scene.read_text(encoding="utf-8"))
    read = [EXAMPLES / word for word in dict.fromkeys(named) if (EXAMPLES / word).is_file()]
    return {path.name: path.read_bytes() for path in (scene, *read)}
