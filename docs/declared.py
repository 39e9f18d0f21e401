"""Reference pages from declarations, as a Sphinx extension: what `wsph list NAME` and `wsph COMMAND --help` say.

They are written to docs/reference/made before Sphinx reads anything; nothing in them is typed by hand.

    python docs/declared.py [FOLDER]        writes them without Sphinx
"""

# pyright: strict

import argparse
import inspect
import json
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import wsph
from wsph.catalogue import groups
from wsph.catalogue.entries import Described, find
from wsph.catalogue.keys import Key
from wsph.catalogue.schema import scene_schema
from wsph.plugins import registry

if TYPE_CHECKING:
    from sphinx.application import Sphinx

MADE = Path(__file__).parent / "reference" / "made"

INTRODUCTIONS = {
    "integrators": "For `run.integrator`: a name, or a table with the method's own options.",
    "materials": "For `bodies.material`: `model`, and the law's own keys.",
    "tables": "Tables of a scene with their keys. A key with a unit takes a number in SI, or a string with a unit of its own.",
    "parts": "Optional parts of a body: tables within `[[bodies]]`.",
    "shapes": "For `shape` of a body, and within unions and differences.",
    "formulations": "For `run.formulation`.",
    "formats": "For `output.formats`.",
    "fields": "For `output.fields` and `fields` of a probe.",
    "kernels": "Smoothing functions, for `run.kernel`.",
    "examples": "Scenes that ship: `wsph new example NAME` writes one, with the files that it reads. The gallery has their pictures.",
}
"""The pages, and what a page says first."""

OURS = ("wsph",)
"""Distributions whose plugins have a place in these pages: others have pages of their own."""


def page(group: str) -> str:
    """A group's page: an overview, and a section for each entry that has more to say."""
    rows = list(dict.fromkeys(_rows(group)))
    lines = [f"# {group.capitalize()}", "", INTRODUCTIONS[group], "", "| name | what it is |", "| --- | --- |"]
    lines += [f"| `{name}` | {escaped(said)} |" for name, said in rows]
    if group in ("fields", "examples"):
        return "\n".join([*lines, ""])
    done: set[tuple[str, str]] = set()
    for name, _ in rows:
        for each in find(name):
            if each.group == group and (each.name, each.source) not in done:
                done.add((each.name, each.source))
                lines += ["", *section(each)]
    return "\n".join([*lines, ""])


def section(each: Described) -> Iterator[str]:
    """All that there is to say of what has a name."""
    yield f"## {each.name}"
    yield ""
    for paragraph in each.description.split("\n\n"):
        yield from ([escaped(" ".join(paragraph.split())), ""] if paragraph.strip() else [])
    for words in each.words:
        yield f"- {escaped(words)}"
    if each.keys:
        yield from ["", "| key | unit | default | range | what it is |", "| --- | --- | --- | --- | --- |"]
        yield from map(_row, each.keys)
    if each.example:
        yield from ["", "```toml", each.example, "```"]
    yield from ["", f"From {escaped(each.source)}."]


def _rows(group: str) -> Iterator[tuple[str, str]]:
    if group in groups.GROUPS:
        yield from ((row.name, row.description) for row in groups.GROUPS[group]())
        return
    for name in (entry.name for entry in registry.entries(group) if entry.distribution in OURS):
        yield name, next(groups.first_sentence(each.description) for each in find(name) if each.group == group)


def _row(key: Key) -> str:
    cells = (f"`{key.name}`", escaped(key.unit), _code(key.default), escaped(key.range), escaped(key.words))
    return "| " + " | ".join(cells) + " |"


def _code(text: str) -> str:
    return "needed" if text == "needed" else f"`{text}`" if text else ""


def escaped(text: str) -> str:
    """A text whose signs mean themselves in Markdown; what stands between backticks stays code."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(p if p.startswith("`") else re.sub(r"([\\*_<>$\[\]|#~{}])", r"\\\1", p) for p in parts)


def commands() -> str:
    """The page of the commands: what each says of itself."""
    from wsph.cli.entry import COMMANDS

    os.environ["COLUMNS"] = "86"
    lines = ["# Commands", "", "What `wsph COMMAND --help` says."]
    for command in COMMANDS:
        parser = argparse.ArgumentParser(prog=f"wsph {command.name}", description=command.help)
        command.declare(parser)
        lines += ["", f"## wsph {command.name}", "", "```text", parser.format_help().rstrip(), "```"]
    return "\n".join([*lines, ""])


def python() -> str:
    """The page of the public names."""
    lines = [
        "# Public names",
        "",
        "The public names of `wsph`, as their docstrings have them. Everything else is reached by its",
    ]
    lines += ["room and promised to nobody; [plugins.md](../plugins.md) has what plugins may import."]
    for name in wsph.__all__:
        thing = getattr(wsph, name)
        if isinstance(thing, str):
            continue
        lines += ["", f"## wsph.{name}", ""]
        lines += _documented(name, thing)
        if inspect.isclass(thing):
            for part, member in _members(thing):
                lines += ["", f"### {name}.{part}", "", *_documented(part, member)]
    return "\n".join([*lines, ""])


def _members(cls: type) -> Iterator[tuple[str, object]]:
    """What a class itself offers: its own public methods and properties, with a docstring."""
    for name, member in vars(cls).items():
        function = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        documented = inspect.getdoc(function)
        if not name.startswith("_") and documented and (inspect.isfunction(function) or isinstance(member, property)):
            yield name, member


def _documented(name: str, thing: object) -> list[str]:
    said = inspect.getdoc(thing) or ""
    shown: list[str] = []
    if inspect.isfunction(thing):
        shown = ["```text", f"{name}{inspect.signature(thing)}".replace("wsph.", ""), "```", ""]
    paragraphs = [escaped(" ".join(p.split())) for p in said.split("\n\n") if p.strip()]
    return [*shown, *"\n\n".join(paragraphs).split("\n")]


def write(folder: Path = MADE) -> None:
    """All pages, in a folder; a page that would be the same is left, so that Sphinx does not read it again."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {name: page(name) for name in INTRODUCTIONS} | {"commands": commands(), "python": python()}
    texts = {f"{name}.md": text for name, text in pages.items()}
    texts["schema/wsph.schema.json"] = json.dumps(scene_schema(), indent=1) + "\n"
    for name, text in texts.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def _before(app: "Sphinx", config: object) -> None:
    write()


def setup(app: "Sphinx") -> dict[str, object]:
    """Write the pages before Sphinx looks for any."""
    app.connect("config-inited", _before)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    write(Path(sys.argv[1]) if sys.argv[1:] else MADE)
