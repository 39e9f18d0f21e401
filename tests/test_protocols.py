"""What systems promise to integrators, they have: every member of the protocols, with its arguments."""

import inspect
from itertools import chain
from typing import Any

import pytest

from tests import scenes
from wsph.protocols import LawForm, OneSet, Stability, Timed, TwoSets
from wsph.simulation.compose import compose


def members(protocol: type) -> dict[str, Any]:
    """What a protocol and its bases declare, by name."""
    declared = chain.from_iterable(
        vars(each).items() for each in protocol.__mro__ if each.__module__ == "wsph.protocols"
    )
    return {name: value for name, value in declared if not name.startswith("_")}


def lacks(system: object, protocol: type) -> list[str]:
    """What a system lacks of a protocol, or has with other arguments."""
    found = []
    for name, declared in members(protocol).items():
        own = inspect.getattr_static(system, name, None)
        if own is None:
            found.append(name)
        elif inspect.isfunction(declared):
            wanted, given = (inspect.signature(each).parameters.values() for each in (declared, own))
            if [(p.name, p.kind, p.default) for p in wanted] != [(p.name, p.kind, p.default) for p in given]:
                found.append(f"{name}{inspect.signature(own)}")
    return found


@pytest.mark.parametrize(
    ("integrator", "formulation", "protocol"),
    [
        ("leapfrog", "stress-points", OneSet),
        ("leapfrog", "total-lagrangian", OneSet),
        ("leapfrog", "updated-lagrangian", OneSet),
        ("tsph", "small-strain", TwoSets),
        ("ul-tsph", "updated-lagrangian", TwoSets),
    ],
)
def test_a_system_has_what_its_integrators_are_promised(integrator: str, formulation: str, protocol: type) -> None:
    run = {"integrator": integrator, "formulation": formulation, "cfl": 0.5}
    system = compose(scenes.block(1, 4, run=run)).bodies[0].system
    assert not lacks(system, protocol)
    assert not lacks(system.clock, Timed)
    if protocol is OneSet:
        assert not lacks(system.form, LawForm)


def test_what_is_missing_or_different_is_found() -> None:
    class Poor:
        frequency = 1.0

        def courant(self, product: float, more: int) -> float:
            return product

    found = lacks(Poor(), Stability)
    assert {"modes", "largest"} <= set(found)
    assert any(each.startswith("courant(") for each in found)
    assert "frequency" not in found
