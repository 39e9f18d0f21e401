"""The tables of the pages are those that `python docs/make.py` makes of what was measured."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs"))
import make

ROOT = make.ROOT

TABLES = ("suite", "tried", "speed", "methods", "accuracy", "glance", "answer", "alone", "choose", "single")
"""Those that are made of files; the others are measured, or draw pictures."""


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_that_of_its_file(name: str) -> None:
    rows = "\n".join(getattr(make, name)())
    for path in (make.PAGES[name], *([make.ALSO[name]] if name in make.ALSO else [])):
        text = (ROOT / path).read_text(encoding="utf-8")
        shown = text.split(f"<!-- {name} -->\n", 1)[1].split(f"\n<!-- /{name} -->", 1)[0]
        assert shown == rows, f"{path}: run python docs/make.py --only {name}"
