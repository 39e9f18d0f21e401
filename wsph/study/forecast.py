"""What the rows of a study will take, before any runs: `wsph study --dry-run`."""

# pyright: strict

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from wsph.errors import Refused
from wsph.simulation.compose import compose
from wsph.study.plan import Planned


@dataclass(frozen=True)
class Forecast:
    """The predicted cost of a run with the time step that it starts with. `work`: pair visits, which is pairs times
    right-hand sides; `device_bytes` of its arrays. Relaxations are not in it: nobody knows their steps."""

    particles: int
    steps: int
    right_hand_sides: int
    work: int
    device_bytes: int

    def __str__(self) -> str:
        return (
            f"{self.particles} particles, {self.steps} steps, {self.right_hand_sides} right-hand sides,"
            f" {self.work:.3g} pair visits, {1e-6 * self.device_bytes:.3g} MB"
        )


def forecast(row: Planned) -> Forecast | str:
    """What a row will take, or why it is refused. Sets its scene up and runs nothing; raises what `compose` raises but for
    Refused."""
    try:
        composition = compose(row.scene)
    except Refused as error:
        return f"refused: {str(error).splitlines()[0]}"
    evaluations = composition.steps * composition.evaluations
    work, taken = composition.pairs * evaluations, composition.nbytes
    return Forecast(composition.particles, composition.steps, evaluations, work, taken)


def in_words(plan: Sequence[Planned]) -> Iterator[str]:
    """What the rows of a study will take, line by line, and all of them together."""
    known: list[Forecast] = []
    for row in plan:
        found = forecast(row)
        known += [found] if isinstance(found, Forecast) else []
        yield f"{row.name}: {found}"
    largest = max((each.device_bytes for each in known), default=0)
    yield (
        f"{len(plan)} rows: {sum(each.right_hand_sides for each in known)} right-hand sides,"
        f" {sum(each.work for each in known):.3g} pair visits, {1e-6 * largest:.3g} MB the largest; nothing was run"
    )
