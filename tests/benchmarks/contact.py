"""What contact costs: the step of two bodies of which a tenth of the surface touches, over that of the same without contact.

python tests/benchmarks/contact.py [--particles 100000]

Both are run in turns, in blocks of steps; the figure is the ratio of the medians of their CPU times.
"""

import argparse
import statistics
import time
from typing import Any

import wsph
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

STEPS, TURNS = 40, 7


def scene(dim: int, particles: int, form: str, contact: list[dict[str, Any]]) -> wsph.Scene:
    """Two equal boxes, one on the other, that press and slide on each other where they meet: a tenth of their surfaces."""
    # Of a box 1 by 1 (by 1) that stands on a fifth of another's top: what meets is a tenth or less of both surfaces.
    cells = round((particles / 2) ** (1.0 / dim))
    h = 1.0 / cells
    shift = round(0.6 * cells) * h if dim == 2 else round(0.4 * cells) * h
    kinds = {
        "spacing": h,
        "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3},
    }
    kinds |= {"state": "strain"} if dim == 2 else {}
    low = {"name": "low", "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim}, **kinds}
    high = {"name": "high", "velocity": [0.001, -0.002, 0.0][:dim],
            "shape": {"type": "box", "min": [shift, 1.0, 0.0][:dim], "max": [shift + 1.0, 2.0, 1.0][:dim]}, **kinds}  # fmt: skip
    run = {"integrator": "leapfrog", "formulation": form, "end": 1e3, "cfl": 0.2, "threads": 1}
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=[low, high], contact=contact)


def seconds(made: Composition) -> float:
    """CPU time of a block of steps."""
    started = time.process_time()
    made.program.run(STEPS)
    return (time.process_time() - started) / STEPS


def main() -> None:
    """Print the costs."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--particles", type=int, default=100_000)
    particles = options.parse_args().particles
    for dim in (2, 3):
        for form in ("stress-points", "total-lagrangian"):
            made = []
            for contact in ([], [{"between": ["low", "high"], "friction": 0.2}]):
                composition = compose(scene(dim, particles, form, contact))
                composition.compile()
                composition.program.prepare(STEPS)
                composition.program.run(STEPS)
                made.append(composition)
            turns = [[seconds(each) for each in made] for _ in range(TURNS)]
            without, touching = (statistics.median(column) for column in zip(*turns, strict=True))
            print(
                f"{dim}D, {form}, {made[0].particles} particles: {1e3 * without:.2f} ms a step, with contact {1e3 * touching:.2f} ms:"
                f" {100 * (touching / without - 1):+.1f} %",
                flush=True,
            )


if __name__ == "__main__":
    main()
