"""Pages of the reference, one a group, from the declarations that `wsph list NAME` prints.

python docs/reference.py FOLDER
"""

import sys
from collections.abc import Iterator
from pathlib import Path

from wsph.catalogue import groups
from wsph.catalogue.entries import Described, find
from wsph.plugins import registry

TITLES = {
    "materials": "Materials",
    "integrators": "Integrators",
    "formulations": "Formulations",
    "parts": "Parts of a body",
    "shapes": "Shapes",
    "tables": "Tables of a scene",
    "kernels": "Smoothing functions",
    "formats": "Formats of frames",
    "fields": "Fields",
}


def write(folder: Path) -> None:
    """Write all pages, and the list of them."""
    folder.mkdir(exist_ok=True)
    for group, title in TITLES.items():
        text = fields() if group == "fields" else "\n\n".join(map(told, described(group)))
        (folder / f"{group}.md").write_text(f"# {title}\n\n{text}\n", encoding="utf-8")
    pages = "\n".join(TITLES)
    listing = f"# Reference\n\nMade from the declarations: `wsph list NAME` prints the same.\n\n```{{toctree}}\n{pages}\n```\n"
    (folder / "index.md").write_text(listing, encoding="utf-8")


def described(group: str) -> Iterator[Described]:
    """All of a group, each once; of wsph's own distribution."""
    if group in registry.GROUPS:
        named = [entry.name for entry in registry.entries(group) if entry.distribution == "wsph"]
    else:
        named = list(dict.fromkeys(row.name for row in groups.GROUPS[group]()))
    for name in named:
        yield from (each for each in find(name) if each.group == group)


def told(each: Described) -> str:
    """A section: what it is, its keys, an example."""
    parts = [
        f"## {each.name}",
        f"*{each.source}*",
        *(" ".join(p.split()) for p in escaped(each.description).split("\n\n")),
    ]
    parts += ["\n".join(f"- {escaped(words)}" for words in each.words)] if each.words else []
    if each.keys:
        rows = ["| key | unit | default | range | what it is |", "| --- | --- | --- | --- | --- |"]
        rows += [
            f"| `{k.name}` | {k.unit} | {code(k.default)} | {escaped(k.range)} | {escaped(k.kind)} |" for k in each.keys
        ]
        parts.append("\n".join(rows))
    parts += [f"```toml\n{each.example}\n```"] if each.example else []
    return "\n\n".join(parts)


def fields() -> str:
    """A table of all fields."""
    rows = ["| field | what it is |", "| --- | --- |"]
    rows += [f"| `{row.name}` | {escaped(row.description)} |" for row in groups.fields()]
    return "\n".join(rows)


def code(text: str) -> str:
    """A value, as it is written."""
    return f"`{text}`" if text and text != "needed" else text


def escaped(text: str) -> str:
    """Text that Markdown leaves as it is."""
    for sign in ("\\", "*", "_", "|", "<", ">", "[", "]", "$"):
        text = text.replace(sign, f"\\{sign}") if "`" not in text or sign in "|<>[]" else text
    return text


if __name__ == "__main__":
    write(Path(sys.argv[1]))
