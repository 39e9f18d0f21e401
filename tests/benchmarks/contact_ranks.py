"""Where the time of contact goes where processes share a scene: CPU time of a step, by what takes it.

    mpiexec -n N python tests/benchmarks/contact_ranks.py [--cells 16] [--steps 60] [SCENE...]

Prints a line of JSON a scene. CPU is a process's own time, in microseconds a step, without messages, of each process: of the
bodies, of contact, and of its parts; `search` and `pairs` are seconds of one search, and candidates of the last.
"""

import argparse
import json
import time
import warnings
from collections import defaultdict
from typing import Any

import warp as wp

import wsph
from wsph.backend.launch import Launch, captured
from wsph.contact.surfaces.coupling import Surfaces
from wsph.ranks import world
from wsph.ranks.mpi import Ranks
from wsph.simulation.compose import compose

MATERIAL = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}


def _box(name: str, low: list[float], high: list[float], **more: Any) -> dict[str, Any]:
    shape = {"type": "box", "min": low, "max": high}
    return {"name": name, "shape": shape, "spacing": 1.0, "material": MATERIAL} | more


def blocks(n: float, **touch: Any) -> dict[str, Any]:
    """A plate on another one of the same size, all of whose faces touch."""
    high = _box("high", [0.3, n / 4, 0.2], [2 * n + 0.3, n / 2, n + 0.2], velocity=[0.002, -0.005, 0.0])
    contact = [{"name": "touch", "between": ["low", "high"]} | touch]
    return {"bodies": [_box("low", [0.0] * 3, [2 * n, n / 4, n]), high], "contact": contact}


def ball(n: float) -> dict[str, Any]:
    """A fitted ball on a block."""
    shape = {"type": "sphere", "center": [n, 1.25 * n, n], "radius": n}
    made = _box("ball", [], [], velocity=[0.0, -0.01, 0.0]) | {"shape": shape, "surface": "fitted"}
    return {"bodies": [_box("low", [0.0] * 3, [2 * n, n / 4, 2 * n]), made], "contact": [{"between": ["low", "ball"]}]}


def itself(n: float) -> dict[str, Any]:
    """A body with a slit along all of its length, whose sides meet."""
    slit = {"type": "box", "min": [3.0, n / 4, -1.0], "max": [2 * n + 1.0, n / 4 + 3.0, n + 1.0]}
    whole = {"type": "box", "min": [0.0] * 3, "max": [2 * n, n / 2 + 3.0, n]}
    body = _box("b", [], [], velocity=[0.0, f"-0.02*tanh(y - {n / 4 + 1.5})", 0.0])
    body["shape"] = {"type": "difference", "shapes": [whole, slit]}
    return {"bodies": [body], "contact": [{"self": "b"}]}


def tool(n: float) -> dict[str, Any]:
    """A ball that is pressed into a block."""
    die = {"name": "die", "shape": {"type": "sphere", "center": [n, n / 4 + 2 * n + 0.001, n / 2], "radius": 2 * n}}
    die |= {"velocity": {"y": -0.1}, "against": ["low"], "friction": 0.2}
    return {"bodies": [_box("low", [0.0] * 3, [2 * n, n / 4, n])], "tools": [die]}


SCENES = {
    "blocks": lambda n: blocks(n, friction=0.3),
    "ball": ball,
    "itself": itself,
    "tool": tool,
    "tie": lambda n: blocks(n, law="tie"),
}


class Spent:
    """CPU time by what has taken it, and of searches."""

    def __init__(self) -> None:
        self.parts: defaultdict[str, float] = defaultdict(float)
        self.searches: list[float] = []
        self.messages = 0.0
        find, hear = Surfaces._find, Ranks._hear

        def found(of: Surfaces, **how: Any) -> None:
            began, messages = time.thread_time(), self.messages
            find(of, **how)
            self.searches.append(time.thread_time() - began - (self.messages - messages))

        def heard(of: Ranks, mine: Any) -> Any:
            began = time.thread_time()
            try:
                return hear(of, mine)
            finally:
                self.messages += time.thread_time() - began

        Surfaces._find, Ranks._hear = found, heard  # type: ignore[method-assign]


def measured(made: wsph.Scene, steps: int, domain: Any, spent: Spent) -> dict[str, Any]:
    """The row of a scene."""
    composition = compose(made, domain)
    composition.compile()
    program = composition.program
    program.run(3)
    spent.parts.clear()
    spent.searches.clear()
    calls: list[Any] = []
    for step in range(steps):
        assert program._before is not None
        if program._before() or not step:
            calls = composition.clock.listing(program.step)
            calls = [(each, captured(each.run) if isinstance(each, Launch) else None) for each in calls]
        for each, graph in calls:
            began, waited = time.thread_time(), spent.messages
            name = "host"
            if graph is not None:
                wp.capture_launch(graph)
                kernel = each.kernel
                name = kernel.func.__name__ if kernel.func.__module__.startswith("wsph.contact") else "bodies"
            else:
                each.run()
            spent.parts[name] += time.thread_time() - began - (spent.messages - waited)
    parts = {name: 1e6 * seconds / steps for name, seconds in spent.parts.items()}
    coupling = composition.joint.couplings[0]  # type: ignore[union-attr]
    row = {"particles": composition.particles, "bodies": parts.pop("bodies"), "contact": sum(parts.values())}
    row |= {"searches": len(spent.searches), "search": sum(spent.searches) / max(len(spent.searches), 1)}
    row["launches"] = {name: round(us, 1) for name, us in sorted(parts.items(), key=lambda each: -each[1])}
    row["vertices"] = {name: [each.n, each._seen.placed.count] for name, each in coupling.surfaces.items()}  # type: ignore[attr-defined]
    return row


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--cells", type=float, default=16.0)
    parser.add_argument("--steps", type=int, default=60)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.quiet = True
    domain, spent = world.domain(), Spent()
    for name in options.scenes:
        run = {"integrator": "leapfrog", "formulation": "stress-points", "end": 1e6, "dt": 0.2, "guard": "off", "threads": 1}
        made = wsph.Scene(schema=1, dim=3, run=run, **SCENES[name](options.cells))
        row = measured(made, options.steps, domain, spent)
        for each in range(domain.size):
            words = domain.told(lambda: json.dumps(row), by=each)
            if domain.rank == 0:
                shown = {k: round(v, 4) if isinstance(v, float) else v for k, v in json.loads(words).items()}
                print(json.dumps({"scene": name, "process": f"{each} of {domain.size}"} | shown), flush=True)


if __name__ == "__main__":
    main()
