"""Taylor's test on a cylinder with a fitted surface: the copper bar of examples/taylor_bar.toml on stress points."""

# pyright: strict

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import wsph
from wsph.scene.scene import Scene
from wsph.validation.case import Row, at_most, between, case, example, reported

LENGTH, RADIUS = 32.4e-3, 3.2e-3
"""Of the bar [m]."""


class Struck(NamedTuple):
    """What is left of the bar [mm]: its length, and the radius of the rim of its foot, mean, least and largest; the energy
    that the ledger misses over what was dissipated [%]; particles, steps, and seconds of the run."""

    length: float
    rim: float
    least: float
    largest: float
    missed: float
    particles: int
    steps: int
    seconds: float


def struck(across: int, surface: str, quarter: bool) -> Struck:
    """The bar of about `across` cells along its diameter; of it a quarter, by symmetry."""
    data: dict[str, Any] = example("taylor_bar").data()
    body = data["bodies"][0]
    spacing = LENGTH / round(LENGTH * across / (2.0 * RADIUS))
    body |= {"spacing": spacing, "surface": surface}
    # Viscosity would stiffen the foot; the shock is weak, and plastic flow takes its ringing.
    del body["viscosity"]
    if quarter:
        far = spacing * (across // 2 + 1)
        cut = [{"type": "box", "min": [-far, -far, 0.0], "max": [*high, LENGTH]} for high in ([0.0, far], [far, 0.0])]
        body["shape"] = {"type": "difference", "shapes": [body["shape"], *cut]}
        data["boundary"] += [{"body": "bar", "where": f"{axis} <= 1e-9", "symmetry": axis} for axis in "xy"]
    data["run"] |= {"formulation": "stress-points", "cfl": 0.8}
    result = wsph.run(Scene(**data))
    before = result.particles["position"]
    now = 1e3 * (before + result.particles["displacement"])
    r, energy = np.hypot(now[:, 0], now[:, 1]), result.summary["energy"]
    foot, away = before[:, 2] < 1e-9, np.hypot(before[:, 0], before[:, 1])
    rim = foot & (away > (RADIUS * (1.0 - 1e-6) if surface == "fitted" else away[foot].max() - 0.5 * spacing))
    top = before[:, 2] > LENGTH * (1.0 - 1e-6)
    return Struck(
        length=float(now[top, 2].mean()),
        rim=float(r[rim].mean()),
        least=float(r[rim].min()),
        largest=float(r[foot].max()),
        missed=100.0 * energy["residual"] / energy["dissipated"],
        particles=len(before),
        steps=int(result.cost["steps"]),
        seconds=result.cost["wall_seconds"],
    )


@case("taylor-cylinder", "Taylor's test on copper", "21.4 to 21.5 mm, foot 7.0 to 7.2 mm in published codes")
def taylor_cylinder(full: bool) -> Iterator[Row]:
    # The short form has a quarter of the bar, which cannot show what breaks its symmetry.
    for across, quarter in ((8, True), (12, False)) if full else ((8, True),):
        words = f"{across} cells across{', a quarter' if quarter else ''}"
        found = struck(across, "fitted", quarter)
        yield between(f"{words}: length", "21.4 to 21.5", found.length, 21.4, 21.5, "mm")
        yield between(f"{words}: radius of the foot", "7.0 to 7.2", found.rim, 7.0, 7.2, "mm")
        petals = 100.0 * (found.largest - found.least) / found.rim
        yield at_most(
            f"{words}: largest radius of the foot less the least one", "round", petals, 6.0 if quarter else 3.0
        )
        yield between(f"{words}: energy missed over that dissipated", "-", found.missed, -0.3, 0.3)
        yield from _cost(f"{words}, {found.particles} particles", found)
        if full:
            found = struck(across, "stairs", quarter)
            words = f"{words}, in stairs, {found.particles} particles"
            yield reported(f"{words}: length", "-", found.length, "mm")
            yield reported(f"{words}: largest radius of the foot", "-", found.largest, "mm")
            yield from _cost(words, found)


def _cost(words: str, found: Struck) -> Iterator[Row]:
    yield reported(f"{words}: steps", "-", found.steps, "")
    yield reported(f"{words}: time", "-", found.seconds, "s")


CASES = (taylor_cylinder,)
