"""The table of what processes that share a scene are efficient to, from docs/processes.json."""

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def processes() -> list[str]:
    """Rows of two processes beside one, as `tests/benchmarks/processes.py` has measured them."""
    found = json.loads((ROOT / "docs" / "processes.json").read_text())
    rows = [
        "| particles of one process | ns a particle-step | the same scene on two: CPU time, times as fast | twice the scene on two: CPU time, wall time | two threads: times as fast |",
        "| --- | --- | --- | --- | --- |",
    ]
    for size in found["sizes"]:
        rows.append(
            f"| {int(size['particles'])} | {size['ns']:.1f} | {100 * size['strong_cpu']:.0f} %, {size['strong_wall']:.2f} |"
            f" {100 * size['weak_cpu']:.0f} %, {100 * size['weak_wall']:.0f} % | {size['threads_wall']:.2f} |"
        )
    rows += ["", f"(Stress points in 3D, f64, two cores; medians of {found['turns']} turns of `python tests/benchmarks/processes.py`.)"]  # fmt: skip
    return rows
