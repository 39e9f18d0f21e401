"""Another scheme on the same lattices: what no bar sees is a wrong limit, and two schemes seldom have the same.

The other scheme makes the last but one of the rows, and the two coarser ones beside it, by which it has a bar of its own.
Two answers that differ by more than both bars disagree: of 301 pairs with a wrong bar this told 94, of 1385 right ones none.
"""

# pyright: strict

from collections.abc import Mapping

from wsph.accuracy.columns import Aim, Seen, look
from wsph.accuracy.envelope import FEWEST, disagree
from wsph.accuracy.measures import Record, distances
from wsph.accuracy.planning.formal import formal_order
from wsph.accuracy.rows import Rows
from wsph.errors import PluginError, Refused, SceneError
from wsph.plugins.integrators import sets
from wsph.plugins.registry import load
from wsph.quantities import Table
from wsph.scene.scene import Scene
from wsph.simulation.composing.setting import method_of

ONE_SET, TWO_SETS = "leapfrog", "tsph"
"""The integrators that answers are checked by: of the other number of sets than the scene's own, or of another form."""


def others(scene: Scene) -> list[Table]:
    """The changes by which a scene has another scheme, the first that it takes being the one to ask."""
    own, two_sets = method_of(scene).formulation.name, sets(load("integrators", scene.run.integrator.name)) == 2
    found: list[Table] = []
    for form in ("stress-points", "total-lagrangian"):
        if two_sets or form != own:
            found.append({"run.integrator": {"name": ONE_SET}, "run.formulation": form})
    if not two_sets:
        found.append({"run.integrator": {"name": TWO_SETS}, "run.formulation": "small-strain"})
    return found


def opinion(rows: Rows, wanted: Mapping[str, Aim], seen: Mapping[str, Seen]) -> list[str]:
    """What another scheme says of the finest row, in words. Raises what `Rows.run` raises."""
    made = rows.made[:-1] if len(rows.made) > FEWEST else rows.made
    cells = [row.cells for row in reversed(made)][:FEWEST]
    if len(cells) < FEWEST:
        return ["no other scheme was asked: there are too few rows"]
    refusals: list[str] = []
    for changes in others(rows.scene):
        try:
            scene = rows.scene.with_(**{"run.support": None, **changes})
            other = Rows(scene)
            scenes = [other.lattices.scene_at(n) for n in cells]
            plans = [other.costs.plan(n) for n in cells]
        except (SceneError, Refused, PluginError) as error:
            refusals.append(str(error).splitlines()[0])
            continue
        name = f"{scene.run.integrator.name} in the {method_of(scene).formulation.name} form"
        rows.tell(
            f"{name}, to check: {', '.join(map(str, cells))} cells, {sum(plan.work for plan in plans):.3g} pair visits"
        )
        rows.ahead(scenes)
        asked = [rows.run(each, n, plan.work) for each, n, plan in zip(scenes, cells, plans, strict=True)]
        records, spacings = [row.records for row in asked], [row.spacing for row in asked]
        theirs = look(spacings, records, wanted, formal_order(scene), scene.run.precision)
        return _compared(name, rows, seen, records[0], theirs)
    return [f"no other scheme takes the scene: {'; '.join(refusals)}"]


def _compared(
    name: str, rows: Rows, seen: Mapping[str, Seen], records: Mapping[str, Record], theirs: Mapping[str, Seen]
) -> list[str]:
    """Which columns two schemes agree on within their bars, in words."""
    finest = rows.made[-1].records
    said: list[str] = []
    for column in (each for each in seen if each in theirs):
        aim, bars = seen[column].aim, (seen[column].estimate.bar, theirs[column].estimate.bar)
        apart = float(distances([finest[column], records[column]], aim.quantity, aim.scale)[0, 1])
        if disagree(*bars, apart):
            said.append(
                f"{column} disagrees by {100.0 * apart:.2g} %, bars {100.0 * bars[0]:.2g} % and {100.0 * bars[1]:.2g} %"
            )
    if not said:
        return [f"{name} agrees within the bars"]
    return [f"{name} disagrees, so that one of them has a wrong limit: {'; '.join(said)}"]
