"""What `wsph check` tells of a scene: its composition, without a run."""

# pyright: strict

from collections.abc import Sequence
from typing import Any

from wsph.accuracy.planning.shrinking import shrinks
from wsph.backend.graph import Program
from wsph.boundary.selections import selections
from wsph.errors import WsphError
from wsph.geometry.meshes.inspection import in_words
from wsph.plugins import integrators, registry
from wsph.protocols import Integrator
from wsph.reporting import Reported
from wsph.scene.scene import Scene
from wsph.scene.touch.tools import Tool
from wsph.simulation.compose import compose, memory_need, stairs
from wsph.simulation.composing.composition import BodyRun, Composition
from wsph.simulation.composing.forecast import forecast
from wsph.simulation.starting.initial import initial_in_words

Row = tuple[str, str]
"""What is told of, and the words."""


def described(scene: Scene, source: str, ranks: int | None = None) -> list[Row]:
    """The rows of a scene that comes from `source`; with `ranks` those of so many processes that share it. Raises what
    `wsph.compose` raises."""
    composition, stepped = compose(scene if ranks is None else scene.with_(threads=1)), stairs(scene)
    rows: list[Row] = [
        ("scene", scene.title or source),
        ("space", f"{scene.dim}D, {scene.run.precision}, {composition.device}"),
    ]
    for run in composition.bodies:
        rows += _of_body(scene, run, stepped.get(run.body.name, ""))
    name = scene.run.integrator.name
    functions: list[Any] = [kernel.func for kernel in composition.launches()]
    kernels: list[str] = [function.__name__ for function in functions]
    rows += [
        (
            "integrator",
            f"{name} ({registry.origin('integrators', name)}), order {_order(composition.bodies[0].integrator)}",
        ),
        ("memory", _needed(scene)),
        ("time step", _stepped(composition)),
        *_relaxed(scene),
        *_stages(scene),
        ("kernels", f"{len(set(kernels))} in {len(kernels)} launches per step: {', '.join(kernels)}"),
        ("launches", _replayed(composition.program)),
        ("probes", ", ".join(p.name for p in scene.probes) or "none"),
        ("numbers", _numbers(composition.reported) or "none"),
    ]
    rows += [
        ("contact", f"{c.name}: {' and '.join(c.names) if c.between else f'{c.self_} with itself'}, {c.law}")
        for c in scene.contact
    ]
    rows += [
        (f"tool {tool.name}", f"{tool.shape.type}, {_moved(tool)}, against {', '.join(tool.against)}")
        for tool in scene.tools
    ]
    return rows if ranks is None else [*rows, *forecast(scene, composition, ranks)]


def _numbers(reported: Sequence[Reported]) -> str:
    """What has columns of its own in history.csv, by kind."""
    kinds = dict.fromkeys(each.kind for each in reported)
    return "; ".join(f"{kind} {', '.join(each.name for each in reported if each.kind == kind)}" for kind in kinds)


def _moved(tool: Tool) -> str:
    """How a tool moves, in a word."""
    moved = [key for key, given in (("velocity", tool.velocity), ("turn", tool.turn)) if given]
    return "free" if tool.free else f"prescribed {' and '.join(moved)}" if moved else "fixed"


def _relaxed(scene: Scene) -> list[Row]:
    """What comes before the first step."""
    asked = scene.relax
    if asked is None:
        return []
    said = (
        f"kinetic damping with the clock at 0 s, until kinetic energy is below {asked.until:g} of the strain energy, in at most"
        f" {asked.max_steps} steps; rows in relax.csv"
    )
    return [("relaxation", said)]


def _stages(scene: Scene) -> list[Row]:
    """The steps of the run, and which boundaries hold in each."""
    rows: list[Row] = []
    for stage, begins in zip(scene.steps, scene.begins, strict=False):
        holding = [str(k) for k, each in enumerate(scene.boundary) if not each.steps or stage.name in each.steps]
        words = f"{begins:g} to {begins + stage.duration:g} s, with boundary {', '.join(holding) or 'none'}"
        rows.append((f"step {stage.name}", words + (", from rest" if stage.relax is not None else "")))
    return rows


def _lists(run: BodyRun) -> str:
    """How many of the rows of a body do without lists of pairs and, where none does, why."""
    why = f": {run.system.listed}" if run.system.listed else ""
    return f"{100.0 * run.system.regular:.0f} % follow from the lattice, without lists of pairs{why}"


def _stepped(composition: Composition) -> str:
    why = shrinks(composition)
    least, more = ("at least ", f": steps get shorter, {why}") if why else ("", "")
    return f"{composition.dt:.6g} s, {least}{composition.steps} steps to {composition.scene.end:g} s{more}"


def _of_body(scene: Scene, run: BodyRun, steps: str) -> list[Row]:
    """The rows of one body; `steps`: why its surface is in steps of a cell."""
    material = f"{run.body.material.model} ({registry.origin('materials', run.body.material.model)})"
    longest = min(run.longest_steps.values())
    device, host = (size / run.system.count for size in (run.system.nbytes, run.system.host_bytes))
    limit = (
        f"limit {run.limit:.3f} ({run.limit_reason})"
        if run.limit is not None
        else f"limit not known: {run.limit_reason}"
    )
    rows = [
        (f"body {run.body.name}", f"{material}, {run.constitutive.state.name}, {run.system.formulation}"),
        (
            "  particles",
            f"{run.system.count}, {run.system.pairs} pairs, {device:.0f} bytes per particle on the device, {host:.0f} on the host",
        ),
        ("  rows", _lists(run)),
        ("  stability", f"Courant number {run.courant:.6g}, {limit}"),
        (
            "  material",
            f"time step at most {longest:.4g} s" if longest < 1e300 else "no limit of its own",
        ),
    ]
    rows += [(f"  {about}", said) for about, said in in_words(run.system.geometry)]
    rows += [("  surface", steps)] if steps else []
    for force in run.body.body_force:
        where = force.where or "all particles"
        rows.append(("  body force", f"{', '.join(force.components)} on {where}"))
    rows += [("  initial", said) for said in initial_in_words(run.body, run.system)]
    chosen = selections(scene, run.body.name, run.system.geometry, run.system.position, scene.end)
    rows += [(f"boundary {each.number}", str(each)) for each in chosen]
    return rows


def _needed(scene: Scene) -> str:
    """The memory that its bodies will take."""
    meshes = [body.name for body in scene.bodies if body.mesh is not None]
    if len(meshes) == len(scene.bodies):
        return "not estimated: all bodies are from mesh files"
    try:
        return f"estimated {memory_need(scene)}" + (f", without {', '.join(meshes)} from mesh files" if meshes else "")
    except WsphError as error:
        return f"not estimated: a block of it is refused: {error}"


def _order(integrator: Integrator) -> str:
    order = integrators.order(integrator)
    return "not declared" if order is None else f"{order:g}"


def _replayed(program: Program) -> str:
    return "replayed from a captured graph" + (
        f", long launches shared by {program.threads} cores" if program.threads > 1 else ""
    )
