"""Abaqus input files (.inp): nodes, elements, their sets, and surfaces of elements, of one part.

Keywords begin with *, comments with **. NODE, ELEMENT, NSET, ELSET (both also with GENERATE) and SURFACE are read; a set may
name other sets. All else is left alone, but a second PART and an INSTANCE that is moved, whose nodes would lie elsewhere.
"""

# pyright: strict
# pyright: reportMissingTypeStubs=false

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import meshio
import numpy as np

KINDS = {
    "C3D8": ("hexahedron", 8),
    "C3D4": ("tetra", 4),
    **dict.fromkeys(("CPS4", "CPE4", "CAX4", "S4", "M3D4", "R3D4", "SFM3D4"), ("quad", 4)),
    **dict.fromkeys(("CPS3", "CPE3", "CAX3", "S3", "STRI3", "M3D3", "R3D3", "SFM3D3"), ("triangle", 3)),
    **dict.fromkeys(("T2D2", "T3D2", "B21", "B31", "R2D2"), ("line", 2)),
}
"""Kinds of cells and their number of corners, by the type of an element without the letters at its end."""

SIDES = {
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "triangle": ((0, 1), (1, 2), (2, 0)),
}
"""Corners of the sides S1, S2, ... of a cell."""

OF_SIDES = {2: "line", 3: "triangle", 4: "quad"}
"""Kinds of sides by their number of corners."""


@dataclass
class _Part:
    """What has been read: nodes by their numbers, elements by theirs (kind, corners), sets of both, and surfaces as rows
    of a set or an element and a side."""

    nodes: dict[int, list[float]] = field(default_factory=dict[int, list[float]])
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict[int, tuple[str, list[int]]])
    of_nodes: dict[str, list[int]] = field(default_factory=dict[str, list[int]])
    of_elements: dict[str, list[int]] = field(default_factory=dict[str, list[int]])
    surfaces: dict[str, list[list[str]]] = field(default_factory=dict[str, list[list[str]]])


def read_abaqus(path: Path) -> meshio.Mesh:
    """The mesh of an input file. Raises ValueError for what cannot be read, by the number of the line."""
    part, parts = _Part(), 0
    for line, keyword, options, rows in _blocks(path):
        try:
            if keyword == "PART":
                parts += 1
                if parts > 1:
                    raise ValueError("a second *PART: write each into a file of its own")
            elif keyword == "INSTANCE" and rows:
                raise ValueError("an *INSTANCE that is moved: write the nodes where they are")
            elif keyword == "INCLUDE":
                raise ValueError("*INCLUDE is not followed: put the lines into the file")
            else:
                _read(part, keyword, options, rows)
        except (ValueError, IndexError) as error:
            raise ValueError(f"line {line}, *{keyword}: {error}") from None
    if not part.nodes or not part.elements:
        raise ValueError("it has no *NODE or no *ELEMENT")
    return _mesh(part)


def _blocks(path: Path) -> Iterator[tuple[int, str, dict[str, str], list[list[str]]]]:
    """Keywords with the numbers of their lines, options and rows of data."""
    line, keyword, options, rows = 0, "", dict[str, str](), list[list[str]]()
    for number, text in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        if text.startswith("**") or not text.strip():
            continue
        if not text.startswith("*"):
            rows.append([word.strip() for word in text.strip().rstrip(",").split(",")])
            continue
        if keyword:
            yield line, keyword, options, rows
        first, *others = text[1:].split(",")
        pairs = (word.partition("=") for word in others)
        options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
        line, keyword, rows = number, first.strip().upper(), []
    if keyword:
        yield line, keyword, options, rows


def _read(part: _Part, keyword: str, options: dict[str, str], rows: list[list[str]]) -> None:
    if keyword == "NODE":
        for number, *place in rows:
            part.nodes[int(number)] = [float(x) for x in place]
        if "NSET" in options:
            part.of_nodes.setdefault(options["NSET"], []).extend(int(row[0]) for row in rows)
    elif keyword == "ELEMENT":
        _read_elements(part, options, rows)
    elif keyword == "NSET":
        _read_set(part.of_nodes, _name(options, "NSET"), "GENERATE" in options, rows)
    elif keyword == "ELSET":
        _read_set(part.of_elements, _name(options, "ELSET"), "GENERATE" in options, rows)
    elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
        part.surfaces.setdefault(_name(options, "NAME"), []).extend(rows)


def _name(options: dict[str, str], key: str) -> str:
    if not options.get(key):
        raise ValueError(f"{key}= is missing")
    return options[key]


def _read_elements(part: _Part, options: dict[str, str], rows: list[list[str]]) -> None:
    given = options.get("TYPE", "").upper()
    base = re.sub(r"(?<=\d)[A-Z]+$", "", given)
    if base not in KINDS:
        raise ValueError(f"elements of TYPE={given} are none of {', '.join(KINDS)}: mesh it again with those")
    kind, count = KINDS[base]
    numbers, width = [int(word) for row in rows for word in row], count + 1
    if len(numbers) % width:
        raise ValueError(f"{len(numbers)} numbers are no rows of {width}, as TYPE={given} has")
    found = [numbers[k : k + width] for k in range(0, len(numbers), width)]
    part.elements.update({row[0]: (kind, row[1:]) for row in found})
    if "ELSET" in options:
        part.of_elements.setdefault(options["ELSET"], []).extend(row[0] for row in found)


def _read_set(sets: dict[str, list[int]], name: str, generate: bool, rows: list[list[str]]) -> None:
    own = sets.setdefault(name, [])
    if generate:
        for first, last, *step in rows:
            own.extend(range(int(first), int(last) + 1, int(step[0]) if step else 1))
        return
    for word in (word for row in rows for word in row):
        if word.lstrip("-").isdigit():
            own.append(int(word))
        elif word in sets:
            own.extend(sets[word])
        else:
            raise ValueError(f"there is no set {word!r}")


def _mesh(part: _Part) -> meshio.Mesh:
    """Blocks of one kind each, in the order of the file."""
    place = {number: k for k, number in enumerate(part.nodes)}
    width = max(len(row) for row in part.nodes.values())
    points = np.array([row + [0.0] * (width - len(row)) for row in part.nodes.values()])
    cells: dict[str, list[list[int]]] = {}
    where: dict[int, tuple[str, int]] = {}
    for number, (kind, corners) in part.elements.items():
        lost = [node for node in corners if node not in place]
        if lost:
            raise ValueError(f"element {number} has the node {lost[0]}, which there is not")
        rows = cells.setdefault(kind, [])
        where[number] = (kind, len(rows))
        rows.append([place[node] for node in corners])
    groups = {
        name: [where[number] for number in numbers if number in where] for name, numbers in part.of_elements.items()
    }
    for name, rows in part.surfaces.items():
        for side in _sides(part, name, rows):
            kind = OF_SIDES[len(side)]
            groups.setdefault(name, []).append((kind, len(cells.setdefault(kind, []))))
            cells[kind].append([place[node] for node in side])
    sets: dict[str, list[Any]] = {name: [np.array([row for kind, row in members if kind == block], int) for block in cells]
            for name, members in groups.items()}  # fmt: skip
    of_nodes: dict[str, Any] = {name: np.array([place[number] for number in numbers if number in place], int)
                for name, numbers in part.of_nodes.items()}  # fmt: skip
    blocks: list[Any] = [(kind, np.array(rows)) for kind, rows in cells.items()]
    return meshio.Mesh(points, blocks, cell_sets=sets, point_sets=of_nodes)


def _sides(part: _Part, name: str, rows: list[list[str]]) -> Iterator[list[int]]:
    """Nodes of the sides of a surface."""
    for row in rows:
        which, side = row[0], row[1].upper() if len(row) > 1 else ""
        numbers = [int(which)] if which.isdigit() else part.of_elements.get(which)
        if numbers is None:
            raise ValueError(f"surface {name!r}: there is no set of elements {which!r}")
        for number in numbers:
            kind, corners = part.elements[number]
            if kind not in SIDES or not (
                side[:1] == "S" and side[1:].isdigit() and 0 < int(side[1:]) <= len(SIDES[kind])
            ):
                raise ValueError(f"surface {name!r}: a {kind} has no side {side!r}")
            yield [corners[k] for k in SIDES[kind][int(side[1:]) - 1]]
