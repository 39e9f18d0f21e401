"""Formulations by name: what each can do, and where it is built. Its module is imported only when a scene asks for it.

A formulation is added by its folder and an entry of `FORMULATIONS`.
"""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from wsph.protocols import Traits


@dataclass(frozen=True)
class Formulation:
    """A formulation by its `name`, for integrators of one or two `sets` of particles. `target` is where the function stands
    that builds its system from a setup, "module:function". `as_` names a formulation whose integrators work in it too."""

    name: str
    sets: int
    traits: Traits
    target: str
    as_: str = ""

    @property
    def build(self) -> Callable[[object], object]:
        """The function that builds a system from a `wsph.formulations.setup.Setup`."""
        module, _, function = self.target.partition(":")
        return getattr(import_module(module), function)


# Of two sets of particles a linear motion has a uniform stress with any support; more than 6 spacings smooth waves away.
# Where nodes have been moved two layers of cells are seen: a particle on a face that sees one, whose centres are not in one
# plane, finds 6 to 40 % of wrong stress under a linear velocity.
_TWO_SETS = Traits(needs_rate=True, splits_cracks=True, tried=True, support=1.2, jittered=1.8, supports=(0.0, 6.0))

FORMULATIONS = [
    Formulation("small-strain", 2, _TWO_SETS.with_(small_strain=True), "wsph.formulations.taylor.system:TwoSetSystem"),
    Formulation(
        "total-lagrangian",
        1,
        Traits(
            one_set=True, pairwise=True, reference=True, maps=True, edges=True, measures=True, cuts=True, pushable=True
        ),
        "wsph.formulations.lattice.edges.rates:build",
    ),
    Formulation(
        "stress-points",
        1,
        Traits(
            one_set=True,
            reference=True,
            stabilisation=0.6,
            support=1.5,
            # Up to 1.5 spacings in 1D, 1.58 in 2D and 1.65 in 3D a point sees the nodes of its own cell alone: the stress
            # of a linear motion is uniform to rounding. At 1.8 it is .4, .2 and .03 % off beside the faces, at 2 already
            # 3 %, at 2.4 13 %: what points hand to the nodes of a face is not what the face carries.
            supports=(0.0, 1.8),
            maps=True,
            corners=True,
            splits_cracks=True,
            measures=True,
            cuts=True,
            pushable=True,
        ),
        "wsph.formulations.lattice.rates:build",
    ),
    Formulation(
        "updated-lagrangian",
        1,
        Traits(one_set=True, pairwise=True, pairs_follow=True, measures=True, clumps=True, cuts=True, pushable=True),
        "wsph.formulations.updated.system:build",
    ),
    Formulation(
        "updated-lagrangian",
        2,
        _TWO_SETS.with_(courant_follows=True),
        "wsph.formulations.taylor.moving:MovingTwoSetSystem",
    ),
]


def names() -> list[str]:
    """Their names, each once."""
    return list(dict.fromkeys(each.name for each in FORMULATIONS))


def of_sets(sets: int) -> dict[str, Formulation]:
    """The formulations for integrators of `sets` sets, by name."""
    return {each.name: each for each in FORMULATIONS if each.sets == sets}


def offered(declared: tuple[str, ...], sets: int) -> tuple[str, ...]:
    """The formulations that an integrator works in: those that it `declared`, and those that name one of them as `as_`."""
    return (*declared, *(each.name for each in FORMULATIONS if each.sets == sets and each.as_ in declared))
