"""How even the shares are that processes have of bodies of several shapes, cut by work and, to compare, by particles.

    mpiexec --oversubscribe -n N python tests/benchmarks/shares.py [SHAPE ...] [--turns 20] [--json docs/shares.json]
        [--law mises] [--precision f32] [--listed 3]

Prints a line of JSON for each shape: the pairs that the process with most of them visits in a right-hand side, over the mean
of all, and so the CPU time of the slowest in its launches, without messages: the least of turns of some steps, which need
no quiet cores. `--json` puts them into a file beside those of others. `--listed`: one visit of a list counts as so many of a
grid, whatever the law and the precision.
"""

import argparse
import json
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
from ranks import Waiting, scene

from wsph.backend.domain import Domain
from wsph.backend.reduce import BLOCK
from wsph.ranks import world
from wsph.ranks.cuts import Places
from wsph.simulation.compose import compose
from wsph.simulation.composing import setting
from wsph.simulation.composing.composition import Composition
from wsph.validation import meshes

Table = dict[str, Any]
STEPS = 5


def box(*high: float, low: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Table:
    return {"type": "box", "min": list(low), "max": list(high)}


def hole(x: float, a: float) -> Table:
    """A round one across a bar."""
    ends = {"from": [x, 0.5 * a, -1.0], "to": [x, 0.5 * a, a + 1.0]}
    return {"type": "cylinder", "name": f"h{x:g}", "radius": 0.25 * a, **ends}


def tetrahedra(a: float, folder: Path, domain: Domain) -> Table:
    """A bar of a mesh that is coarse at one end and fine at the other."""
    count, file = int(a), folder / "mesh.vtu"
    if domain.rank == 0:
        nodes, corners = meshes.moved_grid((4.0 * a, a, a), (4 * count, count, count), 0.0)
        nodes[:, 0] *= 1.5 - 0.125 * nodes[:, 0] / a
        meshes.write(file, nodes, tetra=meshes.tetrahedra(corners))
    domain.told(lambda: None)
    return {"shape": None, "spacing": None, "mesh": {"file": str(file)}}


SHAPES: dict[str, Callable[[float], list[Table]]] = {
    "cylinder": lambda a: [{"type": "cylinder", "from": [0.0] * 3, "to": [4.0 * a, 0.0, 0.0], "radius": 0.5 * a}],
    "sphere": lambda a: [{"type": "sphere", "center": [0.0] * 3, "radius": 0.75 * a}],
    "stepped": lambda a: [box(2.0 * a, a, a), box(6.0 * a, 0.5 * a, 0.5 * a, low=(2.0 * a, 0.25 * a, 0.25 * a))],
    "drilled": lambda a: [box(4.0 * a, a, a), hole(0.5 * a, a), hole(1.25 * a, a)],
    "tetrahedra": lambda a: [],
    "box": lambda a: [box(4.0 * a, a, a)],
    "along edges": lambda a: [box(4.0 * a, a, a)],
    "moving": lambda a: [box(4.0 * a, a, a)],
    "two sets": lambda a: [box(4.0 * a, a, a)],
    "two sets moving": lambda a: [box(4.0 * a, a, a)],
}
"""Bodies along x, by the length of their shorter sides in cells, a multiple of 4. The drilled one has holes at one end."""

FORMS = {
    "along edges": "total-lagrangian",
    "moving": "updated-lagrangian",
    "two sets": "tsph",
    "two sets moving": "ul-tsph",
}

LAWS: dict[str, Table] = {
    "elastic": {},
    "mises": {"model": "mises", "yield_stress": 1e-3},
    "neo-hookean": {"model": "neo-hookean"},
    "jaumann": {"model": "jaumann"},
    "perzyna": {
        "model": "perzyna",
        "yield_stress": 1e-3,
        "hardening_modulus": 0.1,
        "fluidity": 0.004,
        "exponent": 1.0,
    },
}


def composed(name: str, options: argparse.Namespace, folder: Path, domain: Domain) -> Composition:
    side = options.side
    shapes = SHAPES[name](float(side))
    body = {"shape": shapes[0]} if len(shapes) == 1 else {
        "shape": {"type": "difference" if name == "drilled" else "union", "shapes": shapes}
    }  # fmt: skip
    body = body if shapes else tetrahedra(float(side), folder, domain)
    law = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3} | LAWS[options.law]
    told = scene(side, side, 1, FORMS.get(name, "stress-points"), **body | {"material": law})
    made = compose(told.with_(precision=options.precision), domain)
    made.compile()
    made.program.run(2)
    return made


def by_particles(places: Places, loads: np.ndarray) -> np.ndarray:
    """Cuts between as many particles each."""
    found = np.rint(np.arange(len(loads) + 1) * places.nodes[-1] / len(loads) / BLOCK).astype(int)
    found[-1] = len(places.nodes) - 1
    return found


def visits(run: Any) -> float:
    """The pairs that a process visits, in those of rows of a grid; of particles that are their own points how many it works
    on."""
    system = run.system
    if not system.traits.one_set:
        part = system._part
        return sum(float(part.stepped[name].stop - part.stepped[name].start) for name in ("real", "virtual"))
    if system.formulation == "updated-lagrangian":
        near = system.rates.near
        return ((near.own.stop - near.own.start) + 2.0 * (near.stress.stop - near.stress.start)) / 3.0
    if system.formulation == "total-lagrangian":
        return float(system.count)
    many, boxes = np.diff(system.geometry.rows.offsets), system.geometry.boxes
    if boxes is None:
        return 2.0 * float(many.sum())
    listed = setting.listed_weight(run.constitutive.material, system.space.precision)
    others = 2.0 * listed * float(many[boxes.others(len(many))].sum())
    return others + boxes.corners.shape[1] * float(len(boxes.corners) + len(boxes.index))


def uneven(domain: Domain, mine: float) -> float:
    """The largest of the numbers of all processes over their mean."""
    every = domain.joined(np.array([mine]))
    return float(every.max() / every.mean())


def shares(name: str, options: argparse.Namespace, folder: Path, domain: Domain, waiting: Waiting) -> Table:
    """What is uneven, of both cuts."""
    even, made = Places.even, {}
    for cut, way in (("particles", by_particles), ("work", even)):
        Places.even = way  # type: ignore[method-assign,assignment]
        made[cut] = composed(name, options, folder, domain)
    times: dict[str, list[float]] = {cut: [] for cut in made}
    for _ in range(options.turns):
        for cut, each in made.items():
            began, waited = time.thread_time(), waiting.seconds
            each.program.run(STEPS)
            times[cut].append(time.thread_time() - began - (waiting.seconds - waited))
    found: Table = {"particles": made["work"].particles}
    for cut, each in made.items():
        found[f"by {cut}"] = [uneven(domain, visits(each.bodies[0])), uneven(domain, min(times[cut]))]
    return found


def written(found: dict[str, Table]) -> str:
    """A line for each shape."""
    rows = [
        f' "{count}": {{\n' + ",\n".join(f'  "{name}": {json.dumps(row)}' for name, row in sorted(of.items())) + "\n }"
        for count, of in sorted(found.items())
    ]
    return "{\n" + ",\n".join(rows) + "\n}\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shapes", nargs="*", choices=[*SHAPES, []])
    parser.add_argument("--side", type=int, default=24)
    parser.add_argument("--turns", type=int, default=20)
    parser.add_argument("--law", choices=LAWS, default="elastic")
    parser.add_argument("--precision", default="f64")
    parser.add_argument("--listed", type=float)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.quiet = True
    if options.listed is not None:
        setting.listed_weight = lambda *_: options.listed
    domain, waiting, found = world.domain(), Waiting(), {}
    with tempfile.TemporaryDirectory() as own:
        folder = domain.told(lambda: Path(own))
        for name in options.shapes or SHAPES:
            row = shares(name, options, folder, domain, waiting)
            found[name] = {k: [round(x, 3) for x in v] if isinstance(v, list) else v for k, v in row.items()}
            if domain.rank == 0:
                print(json.dumps({name: found[name]}), flush=True)
        if domain.rank == 0 and options.json:
            known = json.loads(options.json.read_text()) if options.json.exists() else {}
            size = str(domain.size)
            options.json.write_text(written(known | {size: known.get(size, {}) | found}))
        domain.told(lambda: None)


if __name__ == "__main__":
    main()
