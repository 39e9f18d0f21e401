"""What the rows of a study will take, before any runs or by those that have: `wsph study --dry-run`.

A scene tells its pairs and the time step that it begins with. Where steps get shorter as it goes it takes more: how many
times more is taken from the row of the same ladder that is next to it in spacing, and until one has run it is a lower bound.
"""

# pyright: strict

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from wsph.accuracy.planning.shrinking import shrinks
from wsph.errors import Refused
from wsph.simulation.compose import compose
from wsph.study.plan import Planned
from wsph.study.rows import Made


@dataclass(frozen=True)
class Forecast:
    """The predicted cost of a run. `work`: pair visits, which is pairs times right-hand sides; `device_bytes` of its arrays;
    `shrinks`: why it is a lower bound, `by`: the row that says how many steps it is; both in words, or empty. Relaxations
    are not in it: nobody knows their steps."""

    particles: int
    steps: int
    right_hand_sides: int
    work: int
    device_bytes: int
    shrinks: str = ""
    by: str = ""

    def __str__(self) -> str:
        how = "about " if self.by else "at least " if self.shrinks else ""
        why = f" (by {self.by})" if self.by else f" (steps get shorter: {self.shrinks})" if self.shrinks else ""
        return (
            f"{self.particles} particles, {how}{self.steps} steps, {self.right_hand_sides} right-hand sides,"
            f" {self.work:.3g} pair visits, {1e-6 * self.device_bytes:.3g} MB{why}"
        )

    def times(self, factor: float, by: str) -> "Forecast":
        """The same with `factor` times the steps, as a row showed."""
        steps, evaluations = round(factor * self.steps), round(factor * self.right_hand_sides)
        return replace(self, steps=steps, right_hand_sides=evaluations, work=round(factor * self.work), by=by)


def forecast(row: Planned) -> Forecast | str:
    """What a row will take with the time step that it starts with, or why it is refused. Sets its scene up and runs nothing;
    raises what `compose` raises but for Refused."""
    try:
        composition = compose(row.scene)
    except Refused as error:
        return f"refused: {str(error).splitlines()[0]}"
    evaluations = composition.steps * composition.evaluations
    work, taken = composition.pairs * evaluations, composition.nbytes
    return Forecast(composition.particles, composition.steps, evaluations, work, taken, shrinks(composition))


def forecasts(plan: Sequence[Planned], made: Mapping[int, Made]) -> Iterator[tuple[Planned, Forecast | str]]:
    """What each row will take, by the rows that are `made`, by their numbers; of a row that is made what it took."""
    known: dict[int, Forecast | str] = {}

    def start(place: int) -> Forecast | str:
        if place not in known:
            known[place] = forecast(plan[place])
        return known[place]

    for place, row in enumerate(plan):
        found, nearest = start(place), _nearest(plan, made, place)
        if isinstance(found, Forecast) and nearest is not None:
            before, took = start(nearest), made[nearest].row["right_hand_sides"]
            if isinstance(before, Forecast) and isinstance(took, int):
                here = "its own run" if nearest == place else f"{plan[nearest].name!r}"
                found = found.times(took / before.right_hand_sides, here)
        yield row, found


def in_words(plan: Sequence[Planned], made: Mapping[int, Made]) -> Iterator[str]:
    """What the rows of a study will take, line by line, and all of them together."""
    known: list[Forecast] = []
    for row, found in forecasts(plan, made):
        known += [found] if isinstance(found, Forecast) else []
        yield f"{row.name}: {found}"
    largest = max((each.device_bytes for each in known), default=0)
    least = "at least " if any(each.shrinks and not each.by for each in known) else ""
    yield (
        f"{len(plan)} rows: {least}{sum(each.right_hand_sides for each in known)} right-hand sides,"
        f" {sum(each.work for each in known):.3g} pair visits, {1e-6 * largest:.3g} MB the largest; nothing was run"
    )


def _nearest(plan: Sequence[Planned], made: Mapping[int, Made], place: int) -> int | None:
    """The completed row of the same ladder whose spacing is nearest; the row itself where it is one."""
    own = plan[place]
    if place in made:
        return place if made[place].row["status"] == "completed" else None
    there = [
        (abs(math.log(spacing / own.spacing)), k)
        for k, each in enumerate(plan)
        if k in made and made[k].row["status"] == "completed" and each.ladder == own.ladder
        if (spacing := each.spacing) is not None and own.spacing is not None
    ]
    return min(there)[1] if there else None
