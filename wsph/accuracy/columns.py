"""The columns of a scene's probes that an accuracy is of, and what rows say of each."""

# pyright: strict

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wsph.accuracy.envelope import BAR, BAR_OF_STAIRS, FLOOR, Estimate, estimate
from wsph.accuracy.measures import SMALL, Record, distances, size
from wsph.accuracy.planning.formal import Formal
from wsph.errors import Fault, SceneError
from wsph.scene.scene import Scene


@dataclass(frozen=True)
class Aim:
    """What is asked of a column: the `tolerance` of a `quantity`, relative to a `scale` [SI] where there is one."""

    tolerance: float
    quantity: str
    scale: float | None


@dataclass(frozen=True)
class Seen:
    """What the rows say of a column: its aim, the estimate of the finest row, and how far each row is `apart` from it (k,),
    finest first."""

    aim: Aim
    estimate: Estimate
    apart: np.ndarray

    @property
    def share(self) -> float:
        """The estimate as a part of the tolerance."""
        return self.estimate.error / self.aim.tolerance

    @property
    def lost(self) -> "Seen":
        """The same without convergence."""
        return replace(self, estimate=self.estimate.lost)


def aims(scene: Scene, tolerance: float) -> dict[str, Aim]:
    """What is asked of the columns of every probe that is judged, by its name. Raises SceneError where there is none."""
    if not scene.probes:
        raise scene.located(SceneError("scene", [Fault(0, "probes", "nothing to be accurate about: add a probe")]))
    quantity = scene.accuracy.quantity if scene.accuracy is not None else "history"
    found = {
        probe.name: Aim(probe.tolerance or tolerance, probe.quantity or quantity, probe.scale)
        for probe in scene.probes
        if probe.tolerance is not False
    }
    if not found:
        text = "of all probes is false: nothing to be accurate about; leave one out"
        raise scene.located(SceneError("scene", [Fault(0, "probes.0.tolerance", text)]))
    return found


def judged(records: Mapping[str, Record], asked: Mapping[str, Aim]) -> tuple[dict[str, Aim], list[str]]:
    """Of columns "PROBE.COLUMN" of the finest row those that are judged, and those that are not because they are zero by
    symmetry: of a size below SMALL of the largest of the same probe and field."""
    sizes = {name: size(record) for name, record in records.items()}
    largest: dict[tuple[str, str], float] = {}
    for name, each in sizes.items():
        largest[_group(name)] = max(largest.get(_group(name), 0.0), each)
    mine = {name: asked[_group(name)[0]] for name in records if _group(name)[0] in asked}
    zero = [
        name
        for name, aim in mine.items()
        if aim.scale is None and sizes[name] < max(SMALL * largest[_group(name)], 1e-300)
    ]
    return {name: aim for name, aim in mine.items() if name not in zero}, zero


def _group(name: str) -> tuple[str, str]:
    """The probe of a column, and its field without its component and the number of its point."""
    probe, _, column = name.rpartition(".")
    return probe, re.sub(r"(_[xyz]{1,2})?(\[\d+\])?$", "", column)


def look(
    spacings: Sequence[float],
    records: Sequence[Mapping[str, Record]],
    asked: Mapping[str, Aim],
    formal: Formal,
    precision: str,
    torn: bool = False,
) -> dict[str, Seen]:
    """What rows say of the first, the finest, by column: of `spacings` (k,) [m], finest first, with their `records`, made
    in a `precision`; `torn`: whether the area of their cracks has no limit."""
    columns, _ = judged(records[0], asked)
    return {
        name: look_at(spacings, [row[name] for row in records], aim, formal, precision, torn)
        for name, aim in columns.items()
    }


def look_at(
    spacings: Sequence[float], records: Sequence[Record], aim: Aim, formal: Formal, precision: str, torn: bool = False
) -> Seen:
    """What rows say of one column of the first, the finest: its `records` at `spacings` (k,) [m], finest first."""
    table = distances(records, aim.quantity, aim.scale)
    factor = BAR_OF_STAIRS if formal.stairs else BAR
    limits = {"tolerance": aim.tolerance, "floor": FLOOR[precision], "bar": factor}
    norms, fitted = aim.quantity == "history", formal.fitted and formal.order == 2.0
    found = estimate(spacings, table, formal.order, norms=norms, fitted=fitted, torn=torn, **limits)
    return Seen(aim, found, table[0])


def widened(seen: Mapping[str, Seen], more: Mapping[str, float]) -> dict[str, Seen]:
    """The same with bars that are wider by so much."""
    found: dict[str, Seen] = {}
    for name, each in seen.items():
        bar = each.estimate.bar + more.get(name, 0.0)
        found[name] = replace(each, estimate=replace(each.estimate, bar=bar))
    return found


def worst(seen: Mapping[str, Seen]) -> str:
    """The column that is farthest from its tolerance."""
    return max(seen, key=lambda name: seen[name].share if np.isfinite(seen[name].share) else np.inf)
