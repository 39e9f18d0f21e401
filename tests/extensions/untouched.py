"""What shows that something was added from outside: the packages do not know it."""

import re
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("wsph", "wsph_integrators", "wsph_materials")


def knowing(word: str) -> list[str]:
    """The files of the packages that a word stands in, in any case."""
    folders = [Path(spec.origin).parent for name in PACKAGES if (spec := find_spec(name)) and spec.origin]
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    return [str(file) for file in files if re.search(rf"\b{word}\b", file.read_text(encoding="utf-8"), re.IGNORECASE)]
