"""The structure of the packages in figures, beside what is asked of each.

    python tests/structure/figures.py [--json] [--report]

Exit code 1 where a figure misses what is asked; with --report always 0. The rules of tests/structure/test_rules.py are kept
or broken line by line; these figures say how large, how many and how tangled.
"""

import argparse
import json
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field

import measure
from import_graph import circles, imports, module_graph, room_graph
from measure import Size, above, middle, ninetieth
from mentions import CONTRACT, PARTS, ROOM, mentions
from syntax import ROOT, modules

FEWEST, MOST = 3, 14
"""Entries of a folder. The top folder has its rooms and a bound of its own for files."""
TOP = "wsph/"


@dataclass(frozen=True)
class Row:
    """A figure: what it is of, what is asked, the most allowed (None: it is told, not asked), what is reached, and where."""

    figure: str
    asked: float | None
    reached: float
    where: list[str] = field(default_factory=list)

    @property
    def meets(self) -> bool:
        """Whether it is as asked."""
        return self.asked is None or self.reached <= self.asked

    @property
    def verdict(self) -> str:
        """In a word."""
        return "-" if self.asked is None else "meets" if self.meets else "MISSES"


def rows() -> Iterator[Row]:
    """All figures, in the order in which they are printed."""
    yield from _folders()
    yield from _imports()
    yield from _sizes()
    yield from _types()
    yield from _parts()


def _folders() -> Iterator[Row]:
    top = measure.top_modules(modules("wsph"))
    yield Row("files directly in wsph/", 10, len(top), top)
    folders = [folder for folder in measure.folders(modules()) if folder.what != TOP]
    wrong = [folder for folder in folders if not FEWEST <= folder.size <= MOST]
    yield Row(f"folders without {FEWEST} to {MOST} entries", 0, len(wrong), _lines(wrong))


def _imports() -> Iterator[Row]:
    every = modules()
    lazy = [f"{m.path}:{found.line} {found.target}" for m in every for found in imports(m) if found.lazy]
    for words, graph in (("modules", module_graph), ("rooms", room_graph)):
        now, later = circles(graph(every)), circles(graph(every, lazy=True))
        yield Row(f"import circles of {words}", 0, len(now), [" -> ".join(way) for way in now])
        more = [way for way in later if way not in now]
        yield Row(f"import circles of {words} by lazy imports", 0, len(more), [" -> ".join(way) for way in more])
    yield Row("imports inside of functions", None, len(lazy), lazy)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    yield Row("import layers", 16, measure.layers(project))


def _sizes() -> Iterator[Row]:
    every = modules()
    files, functions = measure.file_lengths(every), measure.function_lengths(every)
    lines, arguments = measure.kernel_lengths(every), measure.kernel_arguments(every)
    yield Row("files", None, len(files))
    yield Row("lines of a file, median", 110, middle(files))
    yield Row("lines of a file, 90th percentile", 280, ninetieth(files))
    yield _longest("lines of a file, most", 450, files)
    yield _longest("lines of a function, most", 80, functions)
    yield Row("kernels", None, len(lines))
    yield _longest("lines of a kernel, most", 60, lines)
    yield _longest("arguments of a kernel, most", 12, arguments)
    unformatted = measure.unformatted(every)
    yield Row("lines kept from the formatter", 20, sum(item.size for item in unformatted), _lines(unformatted))


def _types() -> Iterator[Row]:
    untyped = measure.untyped(modules("wsph"))
    yield Row("Any in annotations of public names", 0, sum(item.size for item in untyped), _lines(untyped))
    loose = [module.path for module in measure.checkable(modules()) if not measure.is_strict(module)]
    yield Row("files without kernels that are not strict", 0, len(loose), loose)
    yield Row("strict files", None, sum(map(measure.is_strict, modules())))


def _parts() -> Iterator[Row]:
    for part in PARTS:
        counted, users = mentions(modules(), part)
        where = counted + [f"(not counted: {text})" for text in users]
        yield Row(f"files beside {ROOM} and {CONTRACT} that name: {part.name}", 2, len(counted), where)


def _longest(figure: str, most: int, sizes: list[Size]) -> Row:
    return Row(figure, most, max((item.size for item in sizes), default=0), _lines(above(sizes, most)))


def _lines(items: Sequence[object]) -> list[str]:
    return [str(item) for item in items]


def table(found: Sequence[Row]) -> str:
    """One line a figure, then where each of those is that misses."""
    width = max(len(row.figure) for row in found)
    text = [f"{'figure':<{width}}  {'asked':>6}  {'reached':>7}"]
    for row in found:
        asked = "-" if row.asked is None else f"{row.asked:g}"
        text.append(f"{row.figure:<{width}}  {asked:>6}  {row.reached:>7g}  {row.verdict}")
    for row in found:
        if not row.meets:
            text += ["", f"{row.figure}: {row.reached:g}, asked {row.asked:g}", *(f"  {line}" for line in row.where)]
    return "\n".join(text)


def main() -> int:
    """Print the figures; 1 where one misses."""
    parser = argparse.ArgumentParser(description="The structure of the packages in figures.")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--report", action="store_true", help="exit with 0 whatever is found")
    chosen = parser.parse_args()
    found = list(rows())
    data = [asdict(row) | {"verdict": row.verdict} for row in found]
    print(json.dumps(data, indent=1) if chosen.json else table(found))
    return 0 if chosen.report or all(row.meets for row in found) else 1


if __name__ == "__main__":
    raise SystemExit(main())
