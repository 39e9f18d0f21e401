"""The tables of what processes that share a scene are efficient to, from docs/processes.json, docs/shares.json and
docs/contact_ranks.json."""

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


def shares() -> list[str]:
    """Rows of how even the shares of bodies are, as `tests/benchmarks/shares.py` has measured them."""
    found = json.loads((ROOT / "docs" / "shares.json").read_text())
    rows = [
        "| more of the largest share than of the mean: pairs, CPU time | "
        + " | ".join(f"{count}, by particles | {count}, by work" for count in found)
        + " |",
        "| --- |" + " --- |" * (2 * len(found)),
    ]
    for name in next(iter(found.values())):
        cells = [each[name][f"by {cut}"] for each in found.values() for cut in ("particles", "work")]
        rows.append(f"| {name} | " + " | ".join(f"{_more(a)}, {_more(b)} %" for a, b in cells) + " |")
    many = [row["particles"] / 1000 for each in found.values() for row in each.values()]
    rows += [
        "",
        f"(3D, f64, elastic, {min(many):.0f} to {max(many):.0f} thousand particles, stress points but for boxes along edges, one whose"
        " pairs follow the motion and two of two sets, `tsph` and `ul-tsph`; a bar with holes at one end, one half as thick in its second half, one of a mesh that"
        " gets finer. The least of turns of `mpiexec -n N python tests/benchmarks/shares.py`.)",
    ]
    return rows


MESSAGES = ("told", "brought")
"""What of contact is messages."""


def touching() -> list[str]:
    """Rows of the time of contact on one process and on two, as `tests/benchmarks/contact_ranks.py` has measured it."""
    found = json.loads((ROOT / "docs" / "contact_ranks.json").read_text())
    rows = [
        "| CPU time of contact in a step | particles, pairs | one process | each of two, beside messages | messages | a search on one, on two |",
        "| --- |" + " --- |" * 5,
    ]
    for name, (alone,) in found["1"].items():
        each = found["2"][name]
        sent = [sum(one["launches"].get(part, 0.0) for part in MESSAGES) for one in each]
        own = max(one["contact"] - part for one, part in zip(each, sent, strict=True))
        rows.append(
            f"| {name} | {alone['particles'] / 1000:.0f} k, {alone['visited'] / 1000:.2g} k | {_ms(alone['contact'])} | {_ms(own)},"
            f" {100.0 * own / alone['contact']:.0f} % | {_ms(max(sent))} | {_ms(alone['search'])}, {_ms(max(one['search'] for one in each))} |"
        )
    rows += ["", "(Stress points in 3D, f64, one thread each, two cores: `mpiexec -n N python tests/benchmarks/contact_ranks.py --cells 24`.)"]  # fmt: skip
    return rows


def _ms(us: float) -> str:
    return f"{us / 1000.0:.2g} ms"


def _more(over: float) -> str:
    """How much more than the mean the largest is [%]."""
    return f"{100.0 * (over - 1.0):.0f}"
