"""Every form with every law in every stress state: the error reached, or the words of the refusal: docs/benchmarks/forms.md.

    python tests/extremes/forms.py [--only TEXT] [--workers N] [--write]

What is run is in `tests/extremes/form_checks.py`. A cell is right within the tolerance of its check, or where the program
refuses it, stops it or warns of it in words about this fault; WRONG, with exit code 1, where it completes beyond without.
"""

import argparse
import re
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import wsph
from tests.extremes.form_checks import BLOCKS, CHECKS, CUT, FORMS, STATES, Row
from tests.materials.closed_forms import LAWS

ROWS = [Row(form, law, dim, state) for form in FORMS for law in LAWS for dim, state in STATES]


@dataclass(frozen=True)
class Cell:
    """What a check gave: an `error`, or None, and what was `said` by a refusal, a stop or warnings."""

    error: float | None
    ended: str = ""
    said: tuple[str, ...] = ()

    def within(self, row: Row, name: str) -> bool:
        """Whether there is an error, which is allowed."""
        return self.error is not None and self.error <= CHECKS[name].allowed(row)

    def words(self, name: str) -> str:
        """Of what was said what is about this check."""
        return "; ".join(each for each in self.said if CHECKS[name].about(each))


def outcome(row: Row, name: str) -> Cell:
    """Run one check of a row."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            error = CHECKS[name].measure(row)
        except wsph.WsphError as found:
            unstable = isinstance(found, wsph.errors.Unstable)
            return Cell(None, "stopped" if unstable else "refused", (told(str(found)),))
    words = [told(str(each.message)) for each in said if issubclass(each.category, RuntimeWarning)]
    return Cell(error, "", tuple(dict.fromkeys(words)))


def told(words: str) -> str:
    """A message without what differs from one cell to the next: numbers of steps and particles, and figures."""
    last = words.splitlines()[-1].strip()
    last = re.sub(r"^found unstable at step .*? s\): |^step \d+: |^scene: ", "", last)
    last = re.sub(r" of particle \d+ at \([^)]*\) m|; Courant number.*$", "", last)
    return re.sub(r"(?<!to )\b\d[\d.e+-]* ?%", "... %", last)


def cells(row: Row) -> dict[str, Cell]:
    """All checks of a row, by name; without those that say nothing in its stress state."""
    found = {name: outcome(row, name) for name in CHECKS}
    return {name: cell for name, cell in found.items() if cell.ended or cell.error is not None}


def wrong(row: Row, found: dict[str, Cell]) -> list[str]:
    """The cells that are wrong without a word."""
    return [
        f"{row}: {name} {cell.ended or cell.error}, {CHECKS[name].allowed(row):.2g} allowed; {' '.join(cell.said)}"
        for name, cell in found.items()
        if not cell.within(row, name) and not cell.words(name)
    ]


HEAD = """\
# Every form with every law

Made by `python tests/extremes/forms.py --write`. Each figure is the largest error of a stress over the largest right stress,
in a body of 3 to 12 cells an edge; in brackets here, what is allowed.

- Patch: held at one face, loaded at the opposite one, free at the others; aligned with the axes, turned, and with jittered
  cells ({patch:g}; 'updated-lagrangian' comes to rest first).
- Turned under stress: stretched by 5 % and turned by a right angle ({turns:g}).
- Pulled beyond yield: sides free, to 1 %, five times the strain at yield, beside the law's closed form or its fine
  integration ({tension:g}).
- Sheared to 3: far from yield ({shear:g}); of 'updated-lagrangian' in the middle, as its corners lose their neighbours.
- Rest: under gravity on a floor between walls, eight cells high, with a ledger that closes and stands still ({rest:g}). Of first
  order in the spacing are 'updated-lagrangian', whose kernel is cut at the free face ({cut:g}), and along edges the laws that
  flow, where two spacings have one pressure ({blocks:g}).

A number in brackets in the tables is a note: the words by which that scene is refused, stopped or warned of. What is beyond its
bound has one, about that fault.
"""


def table(rows: list[tuple[Row, dict[str, Cell]]]) -> Iterator[str]:
    """docs/benchmarks/forms.md."""
    yield HEAD.format(cut=CUT, blocks=BLOCKS, **{name: each.tolerance for name, each in CHECKS.items()})
    notes: dict[str, int] = {}
    for form in dict.fromkeys(row.form for row, _ in rows):
        yield f"## {form}\n"
        yield "| law | state | " + " | ".join(each.words for each in CHECKS.values()) + " |"
        yield "| --- " * (len(CHECKS) + 2) + "|"
        for row, found in rows:
            if row.form == form:
                yield f"| `{row.law}` | {row.where} | " + " | ".join(shown(row, n, found, notes) for n in CHECKS) + " |"
        yield ""
    yield "## Notes\n"
    yield from (f"{number}. {words}" for words, number in notes.items())


def shown(row: Row, name: str, found: dict[str, Cell], notes: dict[str, int]) -> str:
    """A cell as the table has it; its words join the `notes`. Of warnings only those of a figure beyond its bound."""
    cell = found.get(name)
    if cell is None:
        return "-"
    if cell.within(row, name):
        return f"{cell.error:.0e}"
    words = cell.words(name)
    note = f" [{notes.setdefault(words, len(notes) + 1)}]" if words else " WRONG"
    return (cell.ended or f"{cell.error:.1g}") + note


def main() -> None:
    """Print the table, and with --write keep it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="rows whose name has this text")
    parser.add_argument("--workers", type=int, default=1, help="processes that share the rows")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    chosen = [row for row in ROWS if options.only in str(row)]
    with ProcessPoolExecutor(options.workers, mp_context=get_context("spawn")) as pool:
        rows = list(zip(chosen, pool.map(cells, chosen), strict=True))
    text = "\n".join(table(rows)) + "\n"
    print(text)
    if options.write:
        (Path(__file__).resolve().parents[2] / "docs" / "benchmarks" / "forms.md").write_text(text)
    if faults := [line for row, found in rows for line in wrong(row, found)]:
        raise SystemExit("WRONG without a word:\n" + "\n".join(faults))


if __name__ == "__main__":
    main()
