"""What a phase field costs: the time of a step with it over that without, alternating, in 2D and 3D.

python tests/benchmarks/fracture.py
"""

import itertools
import statistics
import time
from typing import Any

import wsph
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition


def plate(dim: int, form: str, phase_field: bool) -> wsph.Scene:
    """40 000 cells in plane strain, or 27 000 in 3D, that shear and vibrate below their strength."""
    cells = {2: 200, 3: 30}[dim]
    body: dict[str, Any] = {"name": "b", "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim}, "spacing": 1.0 / cells,
                            "velocity": ["1e-3*sin(3*y)", "1e-3*cos(2*x)", "0"][:dim], "residual": {"coefficient": 0.1},
                            "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}}  # fmt: skip
    if dim == 2:
        body["state"] = "strain"
    if form == "total-lagrangian":
        body["viscosity"] = {"alpha": 0.5, "beta": 0.5}
    if phase_field:
        body["phase_field"] = {"fracture_energy": 1e-3, "length": 1.5 / cells}
    run = {"integrator": "leapfrog", "formulation": form, "end": 1e3, "cfl": 0.3, "threads": 1}
    return wsph.Scene(schema=1, dim=dim, run=run, bodies=[body])


def ready(scene: wsph.Scene) -> Composition:
    """A composition whose kernels are loaded and whose launches are recorded."""
    composition = compose(scene)
    composition.compile()
    composition.program.run(5)
    return composition


def main() -> None:
    """Print the medians of the ratios."""
    for dim, form in itertools.product((2, 3), ("total-lagrangian", "stress-points")):
        bare, breaking = ready(plate(dim, form, False)), ready(plate(dim, form, True))
        ratios = []
        for _ in range(15):
            seconds = []
            for composition in (bare, breaking):
                started = time.perf_counter()
                composition.program.run(10)
                seconds.append(time.perf_counter() - started)
            ratios.append(seconds[1] / seconds[0])
        print(
            f"{dim}D, {form}, one core: a step with a phase field takes {statistics.median(ratios):.3f} of one without"
            f" ({min(ratios):.3f} to {max(ratios):.3f})",
            flush=True,
        )


if __name__ == "__main__":
    main()
