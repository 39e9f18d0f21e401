"""The fronts of docs/cost.md: every study plans what it says, and every figure of the page follows from its rows."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs"))
import fronts

from wsph.study.plan import planned
from wsph.study.tables import load_study

ROOT = fronts.ROOT
ROWS = json.loads((ROOT / "docs" / "fronts.json").read_text(encoding="utf-8"))["studies"]


def test_every_study_has_a_front() -> None:
    assert sorted(fronts.NAMES) == sorted(path.stem for path in (ROOT / "examples" / "fronts").glob("*.toml"))
    assert list(ROWS) == list(fronts.NAMES)


@pytest.mark.parametrize("name", fronts.NAMES)
def test_rows_are_those_of_the_study(name: str) -> None:
    study, scene = load_study(ROOT / "examples" / "fronts" / f"{name}.toml")
    plan = planned(study, scene)
    rows = ROWS[name]["rows"]
    assert [row["variant"] for row in rows] == [row.variant for row in plan]
    assert {row["status"] for row in rows} == {"completed"}
    assert (ROOT / "docs" / "pictures" / f"front_{name}.png").is_file()


@pytest.mark.parametrize("name", fronts.NAMES)
def test_figures_of_the_page_follow_from_the_rows(name: str) -> None:
    page = (ROOT / "docs" / "cost.md").read_text(encoding="utf-8")
    text = page.split(f"<!-- {name} -->\n", 1)[1].split(f"\n<!-- /{name} -->", 1)[0]
    assert text.splitlines() == list(fronts.paragraph(ROWS[name]))


def test_costs_between_rows() -> None:
    def row(work: float, error: float) -> dict[str, object]:
        return {"pair_visits": work, "error": error, "variant": "a"}

    rows = [row(100.0, 0.1), row(1000.0, 0.2), row(10000.0, 0.001)]
    assert fronts.cost(rows, 0.01) == (pytest.approx(1000.0), False)
    assert fronts.cost(rows, 0.5) == (pytest.approx(100.0), True)
    assert fronts.cost(rows, 1e-4) == (float("inf"), False)
    assert fronts.to_reach(rows, 1e-4) == "No row is within 0.01 %; the nearest, of `a`, is 0.1 % off."
