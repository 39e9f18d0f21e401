"""Every code block of the README and the docs runs, or is checked where a run would be long."""

# pyright: strict

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from blocks import LANGUAGES, ROOT, TEXTS, Block, blocks, merged, pages

BASES = Path(__file__).parent / "bases"

IDENTITY = {str(page.relative_to(ROOT)): page for page in pages()}
WITH_CODE = [name for name, page in IDENTITY.items() if any(each.language in LANGUAGES for each in blocks(page))]

SHIMS = {
    "wsph": 'exec "$WSPH_PYTHON" -m wsph "$@"',
    "python": 'exec "$WSPH_PYTHON" "$@"',
    "pytest": 'exec "$WSPH_PYTHON" -m pytest -q -p no:cacheprovider --rootdir . "$@"',
    "pip": 'exec "$WSPH_PYTHON" "$WSPH_SHIMS/installed.py" "$@"',
}
"""What the commands of the pages are here: of this checkout, without an installation."""

INSTALLED = '''\
"""`pip install -e .` of a package that only has entry points: its metadata, where Python looks for it."""
import os, tomllib
from pathlib import Path

project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
info = Path(os.environ["WSPH_SITE"]) / f"{project['name'].replace('-', '_')}-0.1.0.dist-info"
info.mkdir(exist_ok=True)
(info / "METADATA").write_text(f"Metadata-Version: 2.1\\nName: {project['name']}\\nVersion: 0.1.0\\n")
groups = project["entry-points"].items()
(info / "entry_points.txt").write_text("".join(f"[{g}]\\n" + "".join(f"{k} = {v}\\n" for k, v in e.items()) for g, e in groups))
for package in Path().glob("wsph_*"):
    (Path(os.environ["WSPH_SITE"]) / package.name).symlink_to(package.resolve())
'''


class Folder:
    """Where the blocks of a page run, one after the other."""

    def __init__(self, folder: Path):
        self.top, site, shims = folder, folder / ".site", folder / ".shims"
        (folder / "examples").symlink_to(ROOT / "examples")
        site.mkdir()
        shims.mkdir()
        for name, text in SHIMS.items():
            (shims / name).write_text(f"#!/bin/sh\n{text}\n")
            (shims / name).chmod(0o755)
        self.script = ""
        (shims / "installed.py").write_text(INSTALLED)
        path = [str(site), *(each for each in sys.path if each)]
        self.environment = {
            **os.environ,
            "PATH": f"{shims}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": os.pathsep.join(path),
            "PYTHONWARNINGS": "ignore",
            "WSPH_PYTHON": sys.executable,
            "WSPH_SHIMS": str(shims),
            "WSPH_SITE": str(site),
            "MPLBACKEND": "agg",
        }

    @property
    def folder(self) -> Path:
        """Where the commands before have gone."""
        gone = self.top / ".site" / "folder"
        return Path(gone.read_text().strip()) if gone.is_file() else self.top

    def act(self, block: Block) -> str:
        """Do what a block says; what went wrong, in words, or nothing."""
        for command in block.hidden:
            if said := self.shell(command, 0):
                return said
        ways = block.ways
        if "show" in ways or block.language not in LANGUAGES:
            return ""
        if block.language == "sh":
            text = re.sub(r"wsph run (\S+)[^&\n]*", r"wsph check \1 ", block.text) if "check" in ways else block.text
            return self.shell(text, int(ways.get("fails", "0")))
        if block.language == "python":
            self.script = f"{self.script}\n{block.text}" if "after" in ways else block.text
            return self.run([sys.executable, "-c", self.script], 0)
        return self.toml(block)

    def shell(self, text: str, code: int) -> str:
        """Commands, in bash, that go on from the folder of those before."""
        kept = "trap 'pwd > \"$WSPH_SITE/folder\"' EXIT\n"
        return self.run(["bash", "-eo", "pipefail", "-c", kept + text], code)

    def toml(self, block: Block) -> str:
        """A scene, a part of one, or another file."""
        tomllib.loads(block.text)
        for way, mode in (("file", "w"), ("append", "a")):
            if way in block.ways:
                with open(self.folder / block.ways[way], mode) as file:
                    file.write(("\n" if mode == "a" else "") + block.text)
                return ""
        if "parse" in block.ways:
            return ""
        text = (
            merged((BASES / f"{block.ways['in']}.toml").read_text(), block.text) if "in" in block.ways else block.text
        )
        (self.folder / "examples.toml").write_text(text)
        return self.run([sys.executable, "-m", "wsph", "check", "examples.toml"], 0)

    def run(self, command: list[str], code: int) -> str:
        """A process."""
        done = subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True, text=True, check=False
        )
        return (
            ""
            if done.returncode == code
            else f"exit code {done.returncode}\n{done.stdout[-1500:]}\n{done.stderr[-1500:]}"
        )


@pytest.mark.parametrize("name", list(IDENTITY))
def test_every_block_has_a_language_that_is_run_or_is_text(name: str) -> None:
    for block in blocks(IDENTITY[name]):
        assert block.language in (*LANGUAGES, *TEXTS), f"{name}:{block.line}: {block.language}"
        assert block.ways.get("show", "why"), f"{name}:{block.line}: shown without a reason"


@pytest.mark.parametrize("name", list(IDENTITY))
def test_every_link_leads_somewhere(name: str) -> None:
    page = IDENTITY[name]
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        made = "/made/" in target or target.startswith("made/") or "gallery/" in target
        if not target.startswith("http") and not made:
            assert (page.parent / target).exists(), f"{name}: {target}"


def test_the_readme_is_a_page() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150


@pytest.mark.slow
@pytest.mark.parametrize("name", WITH_CODE)
def test_every_block_runs(name: str, tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    for block in blocks(IDENTITY[name]):
        said = folder.act(block)
        assert not said, f"{name}:{block.line}: {said}"
