"""`wsph advise SCENE`: which scheme suits a scene, by a table that was measured (rules.json, by tests/benchmarks/advice.py).

A scene is of one of seven kinds. For each the table has the error of every alternative on one scene of the kind, at the same
work; what is printed beside it for the scene itself is exact: the work of each alternative on its own lattice. The expected
error is that of the measured scene with as many cells, and no more than that: a search (`--accuracy`) finds the scene's own.
"""

# pyright: strict

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

from wsph.accuracy.planning.cost import plan
from wsph.accuracy.planning.lattices import Lattices
from wsph.accuracy.schemes.kinds import kind_of
from wsph.errors import PluginError, Refused, SceneError
from wsph.plugins.formulations import FORMULATIONS
from wsph.scene.scene import Scene


class Alternative(TypedDict):
    """A scheme as it was measured: its `error` at the table's work; with n cells it is `error_of_a_cell` n^-`order`."""

    integrator: str
    formulation: str
    precision: str
    error: float
    error_of_a_cell: float
    order: float


class Kind(TypedDict):
    """A kind of scene: in `words`, and the alternatives, the best first."""

    words: str
    work: float
    alternatives: list[Alternative]


@dataclass(frozen=True)
class Advice:
    """An alternative for a scene: the changes that make it, its expected `error`, and its `work`, or why it is refused."""

    alternative: Alternative
    error: float
    work: float
    courant: float
    support: str
    refusal: str

    @property
    def changes(self) -> dict[str, object]:
        """Overrides of the scene."""
        return changes_of(self.alternative)


def rules() -> dict[str, Kind]:
    """The table, by kinds."""
    return json.loads((Path(__file__).parent / "rules.json").read_text(encoding="utf-8"))


def changes_of(alternative: Alternative) -> dict[str, object]:
    """The overrides by which a scene has an alternative."""
    return {
        "run.integrator": {"name": alternative["integrator"]},
        "run.formulation": alternative["formulation"],
        "run.precision": alternative["precision"],
        "run.support": None,
        "run.cfl": "auto",
    }


def advise(scene: Scene) -> list[Advice]:
    """The alternatives for a scene, the best of its kind first. Raises SceneError for materials that cannot be built."""
    return [_of(scene, alternative) for alternative in rules()[kind_of(scene)]["alternatives"]]


def best(scene: Scene, free: tuple[str, ...] = ("integrator", "formulation")) -> dict[str, object]:
    """The changes to the best alternative that takes a scene and leaves what is not `free` as it is; empty without one."""
    own = scene.run.integrator.name, scene.run.formulation
    for each in rules()[kind_of(scene)]["alternatives"]:
        keeps = (
            ("integrator" in free or each["integrator"] == own[0])
            and ("formulation" in free or own[1] in (None, each["formulation"]))
            and each["precision"] == scene.run.precision
        )
        if keeps and not _of(scene, each).refusal:
            return changes_of(each)
    return {}


def _of(scene: Scene, alternative: Alternative) -> Advice:
    traits = next(each.traits for each in FORMULATIONS if each.name == alternative["formulation"])
    support = "edges" if traits.edges else "corners" if traits.corners else f"{traits.support:g}"
    try:
        changed = scene.with_(**changes_of(alternative))
        cells = Lattices(changed).own
        made = plan(changed)
    except (SceneError, Refused, PluginError) as error:
        return Advice(alternative, float("nan"), float("nan"), float("nan"), support, str(error).splitlines()[0])
    error = alternative["error_of_a_cell"] * cells ** -alternative["order"]
    return Advice(alternative, error, made.work, made.courant, support, "")


def told(scene: Scene) -> list[str]:
    """The advice in lines."""
    kind = rules()[kind_of(scene)]
    lines = [f"{kind['words']}; the best first, by their errors at the same work on a scene of this kind"]
    head = f"{'integrator':<12}{'formulation':<20}{'support':>9}{'precision':>11}{'Courant':>9}{'error':>10}{'pair visits':>14}"
    lines.append(f"{head}  at equal work")
    for a in kind["alternatives"]:
        each = _of(scene, a)
        start = f"{a['integrator']:<12}{a['formulation']:<20}{each.support:>9}{a['precision']:>11}"
        if each.refusal:
            lines.append(f"{start}  refused: {each.refusal}")
            continue
        figures = f"{each.courant:>9.3g}{100.0 * each.error:>8.2g} %{each.work:>14.3g}"
        lines.append(f"{start}{figures}  {100.0 * a['error']:.2g} %")
    return lines
