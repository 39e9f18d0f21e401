"""What holds spurious modes fades where a body has flowed; what drags stays: a plastic shock needs its viscosity."""

from typing import Any

import numpy as np
import pytest

from tests import scenes
from wsph.simulation.compose import compose

MISES = {"yield_stress": 1e-3, "hardening_modulus": 0.1}
FORMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "along edges, by rows": ({"formulation": "total-lagrangian"}, {}),
    "along edges, by lists": ({"formulation": "total-lagrangian"}, {"jitter": 0.1}),
    "with a kernel's pairs": ({"formulation": "total-lagrangian", "support": 2.6}, {}),
    "stress points": ({"formulation": "stress-points"}, {}),
}


@pytest.mark.parametrize("kind", ["approach", "pair"])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_drag_is_that_of_a_body_that_has_not_flowed(dim: int, form: str, kind: str) -> None:
    run, keys = FORMS[form]
    found: dict[float, tuple[np.ndarray, float]] = {}
    for flowed in (0.0, 10.0):
        body = scenes.body(
            scenes.box(*[0.6] * dim),
            0.1,
            material=scenes.material("mises", **MISES),
            velocity=["-0.1*x*x", "0.1*x*y", "0.1*z*x"][:dim],
            viscosity={"alpha": 0.5, "beta": 1.0, "kind": kind},
            **keys,
        )
        made = compose(scenes.scene(body, run={"guard": "off", "cfl": 0.1, "end": 1.0, **run}))
        made.compile()
        system = made.bodies[0].system
        rng = np.random.default_rng(3)
        internals = system.state.struct.internals.numpy()
        internals[:, 0] = flowed
        system.state.struct.internals.assign(internals)
        place = system.state.struct.displacement.numpy()
        system.state.struct.displacement.assign(place + 1e-3 * rng.standard_normal(place.shape).astype(place.dtype))
        out = system.new()
        system.rate(system.state, out, "velocity")
        found[flowed] = out.struct.drag.numpy(), float(system.rates.held_energy(system.state))
    assert np.abs(found[0.0][0]).max() > 0.0
    assert np.array_equal(found[0.0][0], found[10.0][0])
    assert 0.0 < found[10.0][1] < 0.1 * found[0.0][1]
