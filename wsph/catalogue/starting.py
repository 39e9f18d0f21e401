"""Starting points: a scene, a study, and packages of a material or an integrator, written from templates; and examples.

What is written runs as it is. The test of a package fails until the one change is made that its message asks for.
"""

# pyright: strict

import re
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from string import Template

from wsph.catalogue import shipped
from wsph.errors import WsphError

SINGLE = ("scene", "study", "example")
"""What is written as files; the others are packages, in a folder of their own."""

_MATERIAL = 'model = "elastic"\ndensity = "7850 kg/m3"\nyoungs_modulus = "210 GPa"\npoisson_ratio = 0.3'
_BAR = {
    "material": {
        "integrator": "leapfrog",
        "step": 'cfl = "auto"',
        "material": 'model = "$name"\ndensity = "1200 kg/m3"\nyoungs_modulus = "2 GPa"\npoisson_ratio = 0.4\nrelaxation_time = "1 ms"',
    },
    "total": {
        "integrator": "leapfrog",
        "step": 'cfl = "auto"',
        "material": 'model = "$name"\ndensity = "1100 kg/m3"\nyoungs_modulus = "5 MPa"\npoisson_ratio = 0.45\nstiffening = 0.2',
    },
    "integrator": {"integrator": "$name", "step": "cfl = 0.1", "material": _MATERIAL},
}


def start(kind: str, name: str, folder: Path, *, total: bool = False) -> list[Path]:
    """Write the starting point of a kind under a name, or the example of a name, into a folder; returns what was written.
    `total`: of a material, the law is one of the deformation, for large strain. Raises WsphError for a name that is none,
    and where something of that name is there."""
    wanted = r"[A-Za-z0-9_][A-Za-z0-9_.-]*" if kind in SINGLE else r"[a-z][a-z0-9]*(-[a-z0-9]+)*"
    if not re.fullmatch(wanted, name):
        letters = "letters, digits, _ . and -" if kind in SINGLE else "small letters and digits, joined by -"
        raise WsphError(f"{name!r} is no name of a {kind}: it has {letters}")
    if total and kind != "material":
        raise WsphError(f"--total is of a material, whose law it is about; of {kind} there is no such choice")
    if kind == "example":
        files = shipped.example(name)
    else:
        made = _files(kind, name, "total" if total else kind)
        files = {path: text.encode() for path, text in made.items()}
    root = folder if kind in SINGLE else folder / f"wsph-{name}"
    there = [root / path for path in files if (root / path).exists()]
    if there:
        raise WsphError(f"{there[0]} is there already: choose another name, or take it away")
    try:
        for path, data in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_bytes(data)
    except OSError as error:
        raise WsphError(f"{error.filename or root}: cannot be written: {error.strerror or error}") from error
    return [root / path for path in files]


def _files(kind: str, name: str, template: str) -> dict[str, str]:
    """Relative paths of what is written, and the texts, which are those of a `template`."""
    top = resources.files("wsph.catalogue") / "templates"
    own = top / template
    package = f"wsph_{name.replace('-', '_')}"
    words = {
        "name": name,
        "scene": f"{name}-scene",
        "kind": kind,
        "package": package,
        "distribution": f"wsph-{name}",
        "cls": "".join(part.capitalize() for part in name.split("-")),
    }
    if kind == "scene":
        return {f"{name}.toml": _text(own / "scene.toml", words)}
    if kind == "study":
        scene = _text(top / "scene" / "scene.toml", words | {"name": words["scene"]})
        return {f"{name}.toml": _text(own / "study.toml", words), f"{words['scene']}.toml": scene}
    bar = words | {key: Template(text).substitute(words) for key, text in _BAR[template].items()}
    return {
        "pyproject.toml": _text(top / "pyproject.toml.txt", words),
        "README.md": _text(own / "README.md", words),
        "bar.toml": _text(top / "bar.toml", bar),
        f"{package}/__init__.py": f'"""The {kind} {name} for wsph."""\n',
        f"{package}/{kind}.py": _text(own / f"{kind}.py.txt", words),
        f"test_{kind}.py": _text(own / f"test_{kind}.py.txt", words),
    }


def _text(file: Traversable, words: dict[str, str]) -> str:
    return Template(file.read_text(encoding="utf-8")).substitute(words)
