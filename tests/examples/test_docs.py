"""The code of the page on Python runs, the reference has all that a scene can name, the site is built without a warning."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from wsph.catalogue import groups
from wsph.plugins import registry

DOCS = Path(__file__).resolve().parents[2] / "docs"
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", ["reference/python.md"])
def test_the_code_of_a_document_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall((DOCS / name).read_text(encoding="utf-8"))
    assert blocks
    known: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, name, "exec"), known)  # noqa: S102


def test_the_reference_has_all_that_a_scene_can_name(tmp_path: Path) -> None:
    subprocess.run([sys.executable, str(DOCS / "declared.py"), str(tmp_path)], check=True)
    pages = {path.stem: path.read_text(encoding="utf-8") for path in tmp_path.glob("*.md")}
    for group, make in groups.GROUPS.items():
        mark = "`{}`" if group in ("fields", "examples") else "## {}\n"
        assert all(mark.format(row.name) in pages[group] for row in make()), group
    for group in registry.GROUPS:
        own = [entry.name for entry in registry.entries(group) if entry.distribution == "wsph"]
        assert all(f"## {name}\n" in pages[group] for name in own)


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    for package in ("sphinx", "myst_parser", "sphinx_gallery", "furo", "latex2mathml"):
        pytest.importorskip(package)
    subprocess.run([sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", str(DOCS), str(tmp_path)], check=True)
