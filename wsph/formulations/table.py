"""Every formulation, by the number of particle sets that an integrator works on and by name."""

from wsph.formulations.lagrangian.system import StressPointSystem, TotalLagrangianSystem
from wsph.formulations.setup import Formulation
from wsph.formulations.taylor.moving import MovingTwoSetSystem
from wsph.formulations.taylor.system import TwoSetSystem
from wsph.formulations.updated.system import UpdatedLagrangianSystem

FORMULATIONS = [
    Formulation(system.formulation, sets, system.traits, system)
    for sets, system in (
        (1, TotalLagrangianSystem),
        (1, StressPointSystem),
        (1, UpdatedLagrangianSystem),
        (2, TwoSetSystem),
        (2, MovingTwoSetSystem),
    )
]


def of_sets(sets: int) -> dict[str, Formulation]:
    """The formulations for integrators of so many sets, by name."""
    return {each.name: each for each in FORMULATIONS if each.sets == sets}


def takers(part: str) -> list[str]:
    """The names of the one-set formulations that take a part."""
    return [name for name, each in of_sets(1).items() if part in each.traits.takes]
