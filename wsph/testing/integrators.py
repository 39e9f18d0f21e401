"""Checks that every integrator has to pass."""

# pyright: strict

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from wsph.scene.scene import Scene
from wsph.simulation.run import run

AMPLITUDE = 0.01


def vibrating_bar(
    integrator: str | Mapping[str, object],
    *,
    cells: int = 20,
    courant: float = 0.2,
    precision: str = "f64",
    periods: float = 0.25,
    amplitude: float = AMPLITUDE,
    material: Mapping[str, object] | None = None,
    formulation: str | None = None,
    **body: object,
) -> Scene:
    """A bar of length 1 m held at both ends, started in its first mode, for `periods` of it: smooth, with a closed form.

    v = a sin(pi x) cos(pi c t), stress = rho c a cos(pi x) sin(pi c t), a = `amplitude` [m/s] (0.01 is a strain that large-
    deformation methods take for small, and no shock forms), c = 1 m/s, rho = 1 kg/m3, E = 1 Pa. `material` are keys of
    another material of that E and rho, `body` further keys of the body.
    """
    return Scene(
        schema=1,
        dim=1,
        title="vibrating bar",
        run={
            "integrator": integrator if isinstance(integrator, str) else dict(integrator),
            "end": 2.0 * periods,
            "cfl": courant,
            "precision": precision,
            "guard": "off",
            "device": "cpu",
            **({"formulation": formulation} if formulation else {}),
        },
        bodies=[
            {
                "name": "bar",
                "shape": {"type": "box", "min": [0.0], "max": [1.0]},
                "spacing": 1.0 / cells,
                "state": "stress",
                "velocity": [f"{amplitude}*sin(pi*x)"],
                "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.0}
                | dict(material or {}),
                **body,
            }
        ],
        stop={"energy": 1e9},
        boundary=[{"body": "bar", "face": "-x", "fixed": ["x"]}, {"body": "bar", "face": "+x", "fixed": ["x"]}],
    )


def temporal_order(
    integrator: str | Mapping[str, object], courant: tuple[float, ...] = (0.2, 0.1, 0.05, 0.025), **scene: object
) -> float:
    """Order in time at a fixed spacing: slope of the differences between runs at halved time steps, by regression.

    `scene` are further arguments of `vibrating_bar`.
    """
    further: dict[str, Any] = scene
    states = [run(vibrating_bar(integrator, courant=c, **further)).particles["velocity"][:, 0] for c in courant]
    differences = [np.linalg.norm(a - b) for a, b in itertools.pairwise(states)]
    return float(np.polyfit(np.log(courant[:-1]), np.log(differences), 1)[0])


def check_integrator(
    integrator: str | Mapping[str, object],
    *,
    order: float,
    tolerance: float = 0.1,
    courant: tuple[float, ...] = (0.2, 0.1, 0.05, 0.025),
) -> None:
    """Run what a registered integrator must do: its order in time over the Courant numbers `courant`, the same bits again,
    both precisions agree."""
    measured = temporal_order(integrator, courant)
    assert abs(measured - order) <= tolerance, f"{integrator}: order {measured:.3f} in time, not {order}"
    runs = [run(vibrating_bar(integrator, courant=courant[0])) for _ in range(2)]
    a, b = (r.particles["velocity"] for r in runs)
    assert np.array_equal(a, b), f"{integrator}: the same scene gave other bits"
    single = run(vibrating_bar(integrator, courant=courant[0], precision="f32")).particles["velocity"]
    gap = np.abs(single - a).max() / AMPLITUDE
    assert gap < 1e-4, f"{integrator}: single and double precision differ by {gap:.2e} of the velocity"
