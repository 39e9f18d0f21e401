"""The code blocks of the pages: what stands in them, and what is to be done with each.

A page is a sequence of fenced blocks. Before one may stand a comment that a reader of the page does not see:

    <!-- file: NAME -->      the block is a file of that name; <!-- append: NAME --> goes on with it
    <!-- in: BASE -->        a part of a scene: read within tests/pages/bases/BASE.toml, at its line "# here" or its end
    <!-- hidden: COMMAND --> what is done before the next block
    <!-- fails: CODE -->     the commands end with this exit code
    <!-- check -->           `wsph run` of the block is `wsph check`: the run would be long
    <!-- after -->           a Python block that goes on from that before it
    <!-- parse -->           a TOML file that is no scene
    <!-- show: REASON -->    not run, and why
"""

# pyright: strict

import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = ("sh", "python", "toml")
"""What is run. A block of another language, or of none, is text."""

TEXTS = ("", "text", "bibtex", "{toctree}", "{include}")

WAYS = ("after", "file", "append", "in", "hidden", "fails", "check", "parse", "show")

_FENCE = re.compile(r"^```(\S*)(.*)$")
_COMMENT = re.compile(r"^<!-- (\w+)(?:: (.*))? -->$")


@dataclass(frozen=True)
class Block:
    """A block: its language, its text, the line of the page that it begins on, and what comments before it say."""

    language: str
    text: str
    line: int
    ways: dict[str, str] = field(default_factory=dict[str, str])
    hidden: tuple[str, ...] = ()


def pages() -> list[Path]:
    """The README and all pages of the docs that are written by hand."""
    found = [path for path in (ROOT / "docs").rglob("*.md") if path.parent.name != "made"]
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(found)]


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in order."""
    found: list[Block] = []
    ways: dict[str, str] = {}
    hidden: list[str] = []
    language: str | None = None
    text: list[str] = []
    start = 0
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        fence = _FENCE.match(line)
        if language is not None:
            if line == "```":
                found.append(Block(language, "\n".join(text) + "\n", start, ways, tuple(hidden)))
                language, text, ways, hidden = None, [], {}, []
            else:
                text.append(line)
        elif fence:
            language, start = fence[1], number
        elif comment := _COMMENT.match(line):
            if comment[1] == "hidden":
                hidden.append(comment[2])
            elif comment[1] in WAYS:
                ways[comment[1]] = comment[2] or ""
        elif line.strip():
            ways = {}
    return found


def merged(base: str, part: str) -> str:
    """A part of a scene within its base."""
    before, here, after = base.partition("# here\n")
    return f"{before}{part}\n{after}" if here else f"{base}\n{part}"
