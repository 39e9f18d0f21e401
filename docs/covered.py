"""The tables of coverage of the README, docs/benchmarks/measured.md and docs/accuracy.md: how often error bars hold, from
coverage.json.

`python docs/make.py --only coverage met` fills them.
"""

import json
import statistics
from pathlib import Path

from markers import between

DOCS = Path(__file__).parent
LOST = {
    "softening": "softening without a length",
    "virtual": "virtual links at several rates",
    "thrown": "blocks that are thrown about",
}


def coverage() -> list[str]:
    """Rows of how often error bars hold and tolerances are met, from docs/coverage.json; fills docs/accuracy.md too."""
    found = json.loads((DOCS / "coverage.json").read_text())
    heads = "| searches | answered | of these met | bars that hold | bar over true error | total work over the cheapest row |"
    rows = [f"| {heads}", "| --- |" + " --- |" * 6]
    summary = found["summary"]
    named = {f"tolerance {name}": each for name, each in summary["tolerances"].items()}
    named |= {f"{name}, all tolerances": each for name, each in summary["kinds"].items()}
    named |= {"all": summary["all"], "scenes written after the constants": found["summary_fresh"]["all"]}
    for name, each in named.items():
        met, hold = _part(each["met"], each["answers"]), _part(each["bars_hold"], each["bars"])
        middle = [f"{each[key]:.1f}" if each[key] else "-" for key in ("width", "cost")]
        rows.append(f"| {name} | {each['searches']} | {each['answers']} | {met} | {hold} | {' | '.join(middle)} |")
    fresh, chosen = (sum(scene["group"] == group for scene in found["scenes"]) for group in ("fresh", "round"))
    every = summary["all"]
    rows += [
        "",
        f"{len(found['scenes'])} scenes, {fresh} of them written after the constants were frozen; the highest order of fitted bodies was",
        f"chosen on {chosen} more. Of windows of four rows of their ladders bars hold in"
        f" {_part(every['windows_hold'], every['windows_given'])}; {every['flagged']} of {every['windows']}",
        "windows are said not to converge. The last two columns are medians; cost is counted where the cheapest row is finer",
        "than the third of the ladder.",
        *_lost(found["lost"]),
        *_budgets(found["budgets"]),
        *_seconds(found.get("seconds", {})),
        "(`python tests/benchmarks/coverage.py --write`.)",
    ]
    table = ["| scene | kind | rows | errors | searches | answered | met | bars hold |", "| --- |" + " --- |" * 7]
    for scene in found["scenes"]:
        searches, errors = scene["searches"], [row[2] for row in scene["rows"]]
        answers = [one for one in searches if one["status"] == "met"]
        met = sum(one["true"] <= one["tolerance"] for one in answers)
        mark = {"fresh": " (fresh)", "round": " (order)"}.get(scene["group"], "")
        hold = f"{scene['windows_hold']} of {scene['windows_given']}"
        cells = [scene["name"] + mark, scene["kind"], len(errors), f"{max(errors):.2g} to {min(errors):.2g}", len(searches), len(answers), met, hold]  # fmt: skip
        table.append("| " + " | ".join(map(str, cells)) + " |")
    page = DOCS / "accuracy.md"
    page.write_text(between(page.read_text(encoding="utf-8"), "coverage", table), encoding="utf-8")
    return rows


def met() -> list[str]:
    """The README's rows of it: by tolerance, and all."""
    found = json.loads((DOCS / "coverage.json").read_text())
    summary = found["summary"]
    rows = [
        f"| searches of {len(found['scenes'])} scenes with known answers | answered | of these within the tolerance | bars that hold |",
        "| --- | --- | --- | --- |",
    ]
    for name, each in [
        *((f"for {name}", each) for name, each in summary["tolerances"].items()),
        ("all", summary["all"]),
    ]:
        kept, hold = _part(each["met"], each["answers"]), _part(each["bars_hold"], each["bars"])
        rows.append(f"| {name} | {_part(each['answers'], each['searches'])} | {kept} | {hold} |")
    fresh = found["summary_fresh"]["all"]
    return [
        *rows,
        "",
        f"({sum(scene['group'] == 'fresh' for scene in found['scenes'])} scenes were written after its constants:"
        f" {_part(fresh['met'], fresh['answers'])} answers, {_part(fresh['bars_hold'], fresh['bars'])} bars.)",
    ]


def _lost(found: list[dict]) -> list[str]:
    """How searches of scenes that do not converge ended, in a sentence."""
    words = []
    for family in dict.fromkeys(each["name"].partition(" ")[0] for each in found):
        ends = [each["status"] for each in found if each["name"].startswith(family)]
        words.append(f"{LOST[family]} in {_part(ends.count('no convergence'), len(ends))}")
    claimed = sum(each["status"] == "met" for each in found)
    return [
        "Searches on scenes that do not converge end as *no convergence*:",
        f"{'; '.join(words)};",
        f"the others as out of reach, and {claimed} as met.",
    ]


def _seconds(found: dict) -> list[str]:
    """What budgets of seconds gave, in a sentence, where they were measured."""
    every = [one for each in found.values() for one in each["budgets"]]
    if not every:
        return []
    ratios = [one["over_best"] for one in every]
    over = sum(one["used"] > 1.05 for one in every)
    within = sum(ratio <= 1.3 for ratio in ratios)
    return [
        f"Of {len(every)} budgets of 2 to 10 s, with compiled kernels on a quiet machine, {over} were exceeded by more than 5 %; the",
        f"error is {statistics.median(ratios):.2f} times that of the best row that fits in the median, within 1.3 times in {within},",
        f"{max(ratios):.1f} at most (`python tests/benchmarks/coverage_budgets.py --seconds --write`).",
    ]


def _budgets(found: dict) -> list[str]:
    """What budgets of work gave, in a sentence."""
    every = [one for each in found.values() for one in each]
    ratios = [one["over_best"] for one in every]
    over = sum(one["used"] > 1.0 for one in every)
    within = sum(ratio <= 1.3 for ratio in ratios)
    return [
        f"Of {len(every)} budgets of work on {len(found)} of these scenes {over} were exceeded; the error is"
        f" {statistics.median(ratios):.2f} times that of",
        f"the best row that the budget pays for in the median, within 1.3 times in {within}, {max(ratios):.1f} at most",
        "(`python tests/benchmarks/coverage_budgets.py --write`; best rows are such by luck, too).",
    ]


def _part(of: int, whole: int) -> str:
    return f"{of} of {whole}" if whole else "-"
