"""Every formulation, by the number of particle sets that an integrator works on and by name. One is added by its folder and
an entry here."""

from collections.abc import Callable
from functools import partial

from wsph.backend.state import State
from wsph.formulations.lagrangian.rates import LagrangianRates
from wsph.formulations.one_set import OneSetSystem, Rates
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.setup import Formulation
from wsph.formulations.taylor.moving import MovingTwoSetSystem
from wsph.formulations.taylor.system import TwoSetSystem
from wsph.formulations.updated.rates import UpdatedRates
from wsph.parts.part import Part
from wsph.protocols import Traits


def _one_set(rates: Callable[[RateSetup, State], Rates]) -> Callable:
    return partial(OneSetSystem, rates=rates)


_TWO_SETS = Traits(needs_rate=True, splits_cracks=True, tried=True, support=1.2)

FORMULATIONS = [
    Formulation(
        "total-lagrangian",
        1,
        Traits(one_set=True, pairwise=True, reference=True, maps=True, measures=True, pushable=True),
        _one_set(LagrangianRates),
    ),
    Formulation(
        "stress-points",
        1,
        Traits(
            one_set=True,
            reference=True,
            stabilisation=0.6,
            support=1.8,
            maps=True,
            splits_cracks=True,
            measures=True,
            pushable=True,
        ),
        _one_set(LagrangianRates),
    ),
    Formulation(
        "updated-lagrangian",
        1,
        Traits(one_set=True, pairwise=True, pairs_follow=True, measures=True, clumps=True, pushable=True),
        _one_set(UpdatedRates),
    ),
    Formulation("small-strain", 2, _TWO_SETS, TwoSetSystem),
    Formulation("updated-lagrangian", 2, _TWO_SETS.with_(courant_follows=True), MovingTwoSetSystem),
]


def of_sets(sets: int) -> dict[str, Formulation]:
    """The formulations for integrators of so many sets, by name."""
    return {each.name: each for each in FORMULATIONS if each.sets == sets}


def takers(part: type[Part]) -> list[str]:
    """The names of the formulations that take a part."""
    return [each.name for each in FORMULATIONS if part.fits(each.traits)]
