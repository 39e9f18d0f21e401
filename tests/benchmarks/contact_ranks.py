"""Where the time of contact goes where processes share a scene: CPU time of a step, by what takes it.

    mpiexec -n N python tests/benchmarks/contact_ranks.py [--cells 16] [--steps 60] [--json FILE] [SCENE...]

--json: into a file, beside what it has of other numbers of processes (docs/contact_ranks.json, for docs/make.py).
Prints a line of JSON a scene and process. CPU is a process's own time, in microseconds, the 10th percentile of the steps: of
the bodies, of contact, and of its kernels by name. Messages are `brought`, what surfaces hang on, and `told`, what acts; all
processes begin them together, so that none waits. `search`: the best of some. `visited`: pairs of a vertex and a face that
are looked at in a step.
"""

import argparse
import json
import os
import time
import warnings
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

import wsph
from wsph.backend.launch import Launch, captured
from wsph.contact.surfaces.coupling import Surfaces
from wsph.ranks import world
from wsph.ranks.exchange import ChosenExchange, Exchange
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
    "two plates": lambda n: blocks(n, friction=0.3),
    "a ball on a block": ball,
    "the sides of a slit": itself,
    "a plate and a rigid ball": tool,
    "two plates that are tied": lambda n: blocks(n, law="tie"),
}


class Searches:
    """CPU times of searches, without their messages, in which processes wait for each other [us]."""

    def __init__(self) -> None:
        self.found: list[float] = []
        self._messages, self._within, find = 0.0, 0, Surfaces._find

        def found(of: Surfaces, **how: Any) -> None:
            began, messages = time.thread_time(), self._messages
            find(of, **how)
            self.found.append(1e6 * (time.thread_time() - began - (self._messages - messages)))

        Surfaces._find = found  # type: ignore[method-assign]
        for of, name in ((Ranks, "joined"), (Ranks, "_hear"), (ChosenExchange, "fill")):
            setattr(of, name, self._apart(getattr(of, name)))

    def _apart(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def apart(*arguments: Any) -> Any:
            began = time.thread_time()
            self._within += 1
            try:
                return call(*arguments)
            finally:
                self._within -= 1
                if not self._within:
                    self._messages += time.thread_time() - began

        return apart


def together(domain: Any) -> None:
    """Wait for all processes."""
    if domain.size > 1:
        domain._comm.Barrier()


def measured(made: wsph.Scene, steps: int, domain: Any, searches: Searches) -> dict[str, Any]:
    """The row of a scene."""
    composition = compose(made, domain)
    composition.compile()
    program, coupling = composition.program, composition.joint.couplings[0]  # type: ignore[union-attr]
    program.run(3)
    searches.found.clear()
    spent: list[defaultdict[str, float]] = []
    calls: list[Any] = []
    for step in range(steps):
        assert program._before is not None
        if program._before() or not step:
            calls = composition.clock.listing(program.step)
            calls = [(each, captured(each.run) if isinstance(each, Launch) else None) for each in calls]
        spent.append(defaultdict(float))
        for each, graph in calls:
            if graph is not None:
                kernel = each.kernel
                name = kernel.func.__name__ if kernel.func.__module__.startswith("wsph.contact") else "bodies"
            else:
                of = each.call.func.__self__
                name = (
                    "told" if isinstance(of, ChosenExchange) else "of bodies" if isinstance(of, Exchange) else "brought"
                )
                together(domain)
            began = time.thread_time()
            if graph is not None:
                wp.capture_launch(graph)
            else:
                each.run()
            spent[-1][name] += 1e6 * (time.thread_time() - began)
    names = {name for each in spent for name in each}
    parts = {name: float(np.quantile([each[name] for each in spent], 0.1)) for name in names}
    bodies = parts.pop("bodies") + parts.pop("of bodies", 0.0)
    row = {"particles": composition.particles, "bodies": bodies, "contact": sum(parts.values())}
    row |= {
        "searches": len(searches.found),
        "search": min(*searches.found, *(coupling_search(coupling, searches) for _ in range(5))),
    }
    row["visited"] = sum(len(way.rows.struct.indices) for law in coupling.laws for way in getattr(law, "ways", []))  # type: ignore[attr-defined]
    row["launches"] = {name: round(us, 1) for name, us in sorted(parts.items(), key=lambda each: -each[1])}
    return row


def coupling_search(coupling: Any, searches: Searches) -> float:
    """A search more [us]."""
    coupling._find()
    return searches.found.pop()


def main() -> None:
    """Measure, print, and with --json keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--cells", type=float, default=16.0)
    parser.add_argument("--steps", type=int, default=60)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    wp.config.quiet = True
    domain, searches = world.domain(), Searches()
    kept: dict[str, list[dict[str, Any]]] = {}
    for name in options.scenes:
        run = {
            "integrator": "leapfrog",
            "formulation": "stress-points",
            "end": 1e6,
            "dt": 0.2,
            "guard": "off",
            "threads": 1,
        }
        made = wsph.Scene(schema=1, dim=3, run=run, **SCENES[name](options.cells))
        row = measured(made, options.steps, domain, searches)
        for each in range(domain.size):
            words = domain.told(partial(json.dumps, row), by=each)
            if domain.rank == 0:
                kept.setdefault(name, []).append(json.loads(words))
                shown = {k: round(v, 1) if isinstance(v, float) else v for k, v in json.loads(words).items()}
                print(json.dumps({"scene": name, "process": f"{each} of {domain.size}"} | shown), flush=True)
    if options.json is not None and domain.rank == 0:
        known = json.loads(options.json.read_text()) if options.json.exists() else {}
        known |= {str(domain.size): kept, "machine": f"{os.cpu_count()} cores", "cells": options.cells}
        options.json.write_text(json.dumps(known, indent=1) + "\n")


if __name__ == "__main__":
    main()
