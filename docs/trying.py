"""What was tried of the package itself: how long its tests take, and with which versions of other packages they pass."""

import json
from pathlib import Path

DOCS = Path(__file__).resolve().parent


def suite() -> list[str]:
    """The sentence of how long the tests take, from docs/suite.json."""
    found = json.loads((DOCS / "suite.json").read_text())
    minutes, seconds = divmod(found["seconds"], 60)
    return [
        f"{found['passed']} tests take {minutes} min {seconds} s, a worker on each of {found['workers']} cores, with kernels in"
        " the cache (`python tests/benchmarks/suite.py`)."
    ]


def tried() -> list[str]:
    """Rows of what the wheel was installed beside, a column a trial, from docs/tried.json."""
    found = json.loads((DOCS / "tried.json").read_text())
    heads = [f"Python {row['python']}, {'lowest' if row['lowest'] else 'newest'}" for row in found]
    counts = [", ".join(f"{number} {what}" for what, number in row["counts"].items()) for row in found]
    rows = [
        "| | " + " | ".join(heads) + " |",
        "| --- |" + " --- |" * len(found),
        "| tests | " + " | ".join(counts) + " |",
    ]
    for name in found[0]["versions"]:
        rows.append(f"| {name} | " + " | ".join(row["versions"][name] for row in found) + " |")
    days = sorted({row["date"] for row in found})
    return [*rows, "", f"({', '.join(days)}; `python tests/packaging/tried.py`.)"]
