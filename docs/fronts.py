"""The fronts of docs/cost.md: rows of the studies in examples/fronts, their pictures, and what they say in figures.

    python docs/fronts.py                  all studies, pictures and figures (within half an hour on two cores)
    python docs/fronts.py crack ring       some of them, the others as they were
    python docs/fronts.py --text           the figures alone, from the rows in docs/fronts.json
    python docs/fronts.py --rows FOLDER    rows of studies that were made before, FOLDER/NAME/study.json each

Every figure in docs/cost.md follows from docs/fronts.json.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from markers import between

from wsph.output.view.front import front, undominated
from wsph.units import quantity

ROOT = Path(__file__).resolve().parents[1]
DOCS, STUDIES, ROWS = ROOT / "docs", ROOT / "examples" / "fronts", ROOT / "docs" / "fronts.json"

NAMES = ("shock_bar", "viscoplastic_bar", "vibrating_bar", "beam", "plate_with_void", "crack", "ring", "pulse_3d",
         "two_rods", "taylor_bar")  # fmt: skip
KEPT = ("variant", "status", "particles", "steps", "right_hand_sides", "pair_visits", "bytes", "cpu_seconds", "joules",
        "error", "estimate", "bar", "order", "convergence", "disagrees")  # fmt: skip
ASKED = (0.05, 0.01)
"""Errors whose cost is told."""

Row = dict


def made(name: str) -> dict:
    """The title and the rows of a study that is run."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "wsph.cli", "study", str(STUDIES / f"{name}.toml"), "-o", f"{folder}/out"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return read(Path(folder) / "out" / "study.json")


def read(path: Path) -> dict:
    """The title and the rows of a study, without what figures are not made of."""
    content = json.loads(path.read_text())
    rows = [
        {"spacing": _spacing(row), **{key: _short(row[key]) for key in KEPT if key in row}} for row in content["rows"]
    ]
    return {"title": content["title"], "rows": rows}


def _spacing(row: Row) -> float:
    """The spacing of a row [m], along the first axis."""
    value = next(value for key, value in row.items() if key.endswith(".spacing"))
    value = json.loads(value)[0] if isinstance(value, str) and value.startswith("[") else value
    return quantity(value, "m")


def _short(value: object) -> object:
    return float(f"{value:.5g}") if isinstance(value, float) else value


def error(row: Row) -> float:
    """Against an exact answer, or estimated; not a number where there is none."""
    return row.get("error") or row.get("estimate") or np.nan


def cost(rows: list[Row], asked: float) -> tuple[float, bool]:
    """Pair visits of a variant for an error, between its rows in logarithms, and whether that is but a bound, as its
    cheapest row is nearer; infinite where none comes as near."""
    ordered = sorted((row["pair_visits"], error(row)) for row in rows if np.isfinite(error(row)))
    if not ordered or min(each for _, each in ordered) > asked:
        return np.inf, False
    work, errors = np.array(ordered).T
    best = undominated(errors)
    work, errors = np.log(work[best]), np.log(errors[best])
    return float(np.exp(np.interp(-np.log(asked), -errors, work))), bool(errors[0] <= np.log(asked))


def variants(rows: list[Row]) -> dict[str, list[Row]]:
    """Rows by their variant."""
    return {
        name: [row for row in rows if row["variant"] == name] for name in dict.fromkeys(row["variant"] for row in rows)
    }


def ranked(rows: list[Row], asked: float) -> list[tuple[float, bool, str]]:
    """The cost of an error, whether that is but a bound, and the name of every variant in double, the cheapest first."""
    return sorted((*cost(own, asked), name) for name, own in variants(rows).items() if not name.endswith(", f32"))


def nearest(rows: list[Row]) -> Row:
    """The row of the least error."""
    return min(rows, key=lambda row: float(np.nan_to_num(error(row), nan=np.inf)))


def to_reach(rows: list[Row], asked: float) -> str:
    """The variants that reach an error at the least cost, in words."""
    found = ranked(rows, asked)
    (least, bound, cheapest), *rest = found
    if not np.isfinite(least):
        near = nearest(rows)
        return (
            f"No row is within {100 * asked:g} %; the nearest, of `{near['variant']}`, is {_percent(error(near))} off."
        )
    words = f"{100 * asked:g} % takes {'at most ' * bound}{_power(least)} pair visits with `{cheapest}`"
    after = [f"{two(each / least)} times as many with `{name}`" for each, _, name in rest[:2] if np.isfinite(each)]
    never = sum(not np.isfinite(each) for each, _, _ in rest)
    words += "".join(f", {each}" for each in after)
    return words + (f"; {never} of {len(found)} schemes do not come as near here." if never else ".")


def table(rows: list[Row]) -> Iterator[str]:
    """The rows of a table of the variants: what errors cost, the order by least squares, and the finest row."""
    heads = ["scheme", *(f"work to {100 * asked:g} %" for asked in ASKED), "order", "finest row"]
    yield f"| {' | '.join(heads)} |"
    yield f"|{' --- |' * len(heads)}"
    for name, own in variants(rows).items():
        good = [row for row in own if np.isfinite(error(row))]
        cells = [name]
        for asked in ASKED:
            work, bound = cost(own, asked)
            cells.append(f"{'≤ ' * bound}{_power(work)}" if np.isfinite(work) else "not reached")
        if len(good) > 2:
            h, e = np.log([row["spacing"] for row in good]), np.log([error(row) for row in good])
            finest = min(good, key=lambda row: row["spacing"])
            bar = f" (bar {_percent(finest['bar'])})" if finest.get("bar") else ""
            cells += [
                f"{np.polyfit(h, e, 1)[0]:.1f}",
                f"{_percent(error(finest))}{bar}, {finest['particles']} particles",
            ]
        else:
            cells += ["", "no convergence" if any("no conv" in (row.get("convergence") or "") for row in own) else ""]
        yield f"| {' | '.join(cells)} |"


def precision(rows: list[Row]) -> str:
    """What single precision changes."""
    by_name = variants(rows)
    changes = [
        abs(error(one) / error(other) - 1.0)
        for name, own in by_name.items()
        if name.endswith(", f32") and (double := by_name.get(name.removesuffix(", f32")))
        for one, other in zip(own, double, strict=True)
        if np.isfinite(error(one)) and np.isfinite(error(other))
    ]
    return f"Single precision changes errors by {_percent(max(changes))} of themselves at most." if changes else ""


def bars(rows: list[Row]) -> str:
    """How often bars hold, and how wide they are."""
    both = [row for row in rows if row.get("error") and row.get("bar")]
    if not both:
        return ""
    hold = sum(row["error"] <= row["bar"] for row in both)
    wide = float(np.median([row["bar"] / row["error"] for row in both]))
    return f"Bars hold in {hold} of {len(both)} rows, {wide:.1f} times the true error in the median."


def troubles(rows: list[Row]) -> str:
    """Variants that do not converge, are refused, or disagree."""
    found: list[str] = []
    for name, own in variants(rows).items():
        unsure = next((row["convergence"] for row in own if (row.get("convergence") or "").startswith("no conv")), None)
        if unsure:
            found.append(f"`{name}`: {unsure}")
        failed = [row["status"] for row in own if row["status"] != "completed"]
        if failed:
            found.append(f"`{name}`: {len(failed)} rows {failed[0]}")
    against = {name: len((own[-1].get("disagrees") or "").split("; ")) for name, own in variants(rows).items() if own[-1].get("disagrees")}  # fmt: skip
    apart = [name for name, many in against.items() if 2 * many >= len(variants(rows))]
    if against:
        whom = ", ".join(f"`{name}`" for name in apart or against)
        found.append(f"Marked as disagreeing with {'most others' if apart else 'each other'}: {whom}")
    return f"{'; '.join(found)}." if found else ""


def paragraph(study: dict) -> Iterator[str]:
    """The figures of a study: a paragraph, then a table."""
    rows = study["rows"]
    sentences = [*(to_reach(rows, asked) for asked in ASKED), precision(rows), bars(rows), troubles(rows)]
    yield from wrapped(filter(None, sentences))
    yield ""
    yield from table(rows)


def _power(number: float) -> str:
    return f"{number:.1e}".replace("e+0", "e").replace("e+", "e")


def two(number: float) -> str:
    """Two digits."""
    return f"{number:.0f}" if number >= 9.95 else f"{number:.1f}"


def _percent(number: float) -> str:
    return f"{100 * number:.2g} %"


def write(found: dict) -> None:
    """docs/cost.md between its markers, and the pictures."""
    page = (DOCS / "cost.md").read_text()
    for name, study in found["studies"].items():
        page = between(page, name, paragraph(study))
        front(study["rows"], study["title"], DOCS / "pictures" / f"front_{name}.png")
    (DOCS / "cost.md").write_text(page)


def wrapped(sentences: Iterable[str], most: int = 120) -> list[str]:
    """Sentences in lines."""
    lines = [""]
    for word in " ".join(sentences).split(" "):
        if len(lines[-1]) + len(word) + 1 > most:
            lines.append(word)
        else:
            lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def main() -> None:
    """Make rows, and write what they say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="studies (default: all)")
    parser.add_argument("--text", action="store_true", help="run nothing")
    parser.add_argument("--rows", type=Path, metavar="FOLDER", help="rows that were made before")
    options = parser.parse_args()
    found = json.loads(ROWS.read_text()) if ROWS.exists() else {"studies": {}}
    for name in () if options.text else options.names or NAMES:
        found["studies"][name] = read(options.rows / name / "study.json") if options.rows else made(name)
        found["machine"] = f"{platform.machine()}, {os.cpu_count()} cores"
        print(name, flush=True)
    found["studies"] = {name: found["studies"][name] for name in NAMES if name in found["studies"]}
    # A row a line, for whoever compares two states of it.
    ROWS.write_text(json.dumps(found).replace('{"spacing"', '\n{"spacing"') + "\n")
    write(found)


if __name__ == "__main__":
    main()
