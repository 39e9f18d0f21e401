"""The gallery, as a Sphinx extension: a script of sphinx-gallery for every scene in examples/ that `pictures.py` draws.

A page has the picture, what the scene says of itself, the scene, and how it is run from the shell and from Python. Nothing
is run for it: `python docs/pictures.py` makes the pictures.
"""

# pyright: strict

import re
import shlex
import sys
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parent))

from pictures import PICTURES, RUNS, commands

if TYPE_CHECKING:
    from sphinx.application import Sphinx

DOCS = Path(__file__).parent
EXAMPLES, SCRIPTS = DOCS.parent / "examples", DOCS / "scripts"

ORDER = {
    "Waves and vibrations": (
        "shock_bar",
        "shock_bar_ul",
        "magnesium_bar",
        "vibrating_bar",
        "oscillating_beam",
        "cantilever",
    ),
    "Parts and large strain": ("bracket", "ring", "plate_with_void", "twisting_column"),
    "Plasticity": ("plastic_hinge", "shear_band", "taylor_bar", "rigid_plastic_beam"),
    "Fracture": ("kalthoff_winkler", "kalthoff_links", "mode_one_strip", "notched_beam", "deep_beam", "crack_dsif"),
    "Contact and tools": ("ball_on_plate", "indentation", "stack", "two_rods"),
}
"""What stands together, and in which order."""

HEADER = """\
Gallery
=======

Scenes of ``examples/`` with their pictures. `wsph run` runs each as it stands; minutes at most, on one core.
"""


class Ordered:
    """The order of pages within a part of the gallery, as sphinx-gallery asks for it."""

    def __init__(self, src_dir: str):
        self.names = [name for names in ORDER.values() for name in names]

    def __call__(self, filename: str) -> int:
        """The place of a script."""
        return self.names.index(Path(filename).stem)


def script(name: str) -> str:
    """The page of a scene."""
    scene = EXAMPLES / RUNS[name].split()[0]
    text = scene.read_text(encoding="utf-8")
    title = str(tomllib.loads(text)["title"])
    _, run, view = next(each for each in commands([name]) if each[2].endswith(f"/{name}.png"))
    shell = [run.replace(" --quiet --overwrite", ""), view.replace("docs/pictures/", "")]
    lines = ['r"""', title, "=" * len(title), "", f".. image:: /pictures/{name}.png", f"   :alt: {title}", ""]
    lines += [_plain(line) for line in _said(text)]
    lines += ['"""', "", "# %%", "# From the shell:", "#"]
    lines += ["# .. code-block:: sh", "#", *(f"#     {line}" for line in shell), "#", "# From Python:", ""]
    # In the block of code, from which the site leaves it out: alone it would be an empty block.
    lines += [f"# sphinx_gallery_thumbnail_path = 'pictures/{name}.png'", "import wsph", ""]
    lines += [f'result = wsph.run("examples/{scene.name}")', f'result.plot("{_shown(name)}")', ""]
    lines += ["# %%", f"# ``examples/{scene.name}``:", "#", f"# .. literalinclude:: /../examples/{scene.name}"]
    return "\n".join([*lines, "#    :language: toml", ""])


def _said(text: str) -> list[str]:
    """The comment that a scene begins with, without the commands in it."""
    head = text.split("\n\n", 1)[0].splitlines()
    return [line[2:] for line in head if not line.startswith("#    ")]


def _plain(line: str) -> str:
    """A line whose signs mean themselves; what stands between backticks is code."""
    parts = re.split(r"(`[^`]*`)", line)
    return "".join(f"`{p}`" if p.startswith("`") else re.sub(r"([*|]|_(?!\w))", r"\\\1", p) for p in parts)


def _shown(name: str) -> str:
    """The field of a picture, or the probe that a curve is of."""
    words = shlex.split(PICTURES[name])
    return words[words.index("--field") + 1] if "--field" in words else "push"


def write() -> None:
    """All scripts; one that would be the same is left."""
    texts = {"GALLERY_HEADER.rst": HEADER}
    for number, (title, names) in enumerate(ORDER.items()):
        folder = f"{number}_{title.split()[0].lower()}"
        texts[f"{folder}/GALLERY_HEADER.rst"] = f"{title}\n{'-' * len(title)}\n"
        texts |= {f"{folder}/{name}.py": script(name) for name in names}
    for path, text in texts.items():
        file = SCRIPTS / path
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def _before(app: "Sphinx", config: object) -> None:
    write()


def setup(app: "Sphinx") -> dict[str, object]:
    """Write the scripts before sphinx-gallery looks for any."""
    app.connect("config-inited", _before, priority=100)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    write()
