"""A scene that is right, to be spoilt: a steel beam that is pushed down at its end, or with a ball that flies at it."""

import copy
from typing import Any

STEEL = {"model": "elastic", "density": 7850.0, "youngs_modulus": 210e9, "poisson_ratio": 0.3}
YIELDING = {"model": "mises", "density": 7850.0, "youngs_modulus": 210e9, "poisson_ratio": 0.3, "yield_stress": 350e6}

BEAM: dict[str, Any] = {
    "schema": 1,
    "dim": 2,
    "run": {"integrator": "leapfrog", "end": 2e-5, "cfl": 0.9},
    "bodies": [
        {
            "name": "beam",
            "shape": {"type": "box", "min": [0.0, 0.0], "max": [0.05, 0.01]},
            "spacing": 0.0025,
            "state": "stress",
            "material": STEEL,
        }
    ],
    "functions": {"push": {"t": [0.0, 1e-5], "value": [0.0, -2e6]}},
    "boundary": [
        {"body": "beam", "face": "-x", "fixed": ["x", "y"]},
        {"body": "beam", "face": "+x", "traction": {"y": "push"}},
    ],
    "probes": [{"name": "tip", "at": [[0.05, 0.005]], "fields": ["displacement"]}],
}

BALL: dict[str, Any] = {
    "name": "ball",
    "shape": {"type": "box", "min": [0.02, 0.011], "max": [0.03, 0.021]},
    "spacing": 0.0025,
    "state": "stress",
    "velocity": [0.0, -100.0],
    "material": STEEL,
}


def spoilt(changes: dict[str, Any]) -> dict[str, Any]:
    """The scene with some of its keys, dotted paths, changed, or taken out where the value is None; "ball" adds the ball."""
    data: Any = copy.deepcopy(BEAM)
    changes = dict(changes)
    if changes.pop("ball", False):
        data["bodies"].append(copy.deepcopy(BALL))
    for path, value in changes.items():
        place, (*outer, last) = data, path.split(".")
        for key in outer:
            place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
        if value is None:
            place.pop(int(last) if isinstance(place, list) else last)
        elif isinstance(place, list) and int(last) == len(place):
            place.append(value)
        else:
            place[int(last) if isinstance(place, list) else last] = value
    return data
