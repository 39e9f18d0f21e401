"""Hourglass control (Ganzenmueller 2015): a spring along the current line of two particles against what their deformation
gradients say of their distance.

The weights |W'|/r, which sum with r^2 to one, stand for his V_j W_ij/X^2, which do too. The work done against it is on the
ledger.
"""

from typing import Annotated, ClassVar

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.declarations import example
from wsph.parts.part import Host, Part
from wsph.parts.terms import PairTerm, answers_struct, points_struct
from wsph.protocols import Traits
from wsph.quantities import Unit


class Hourglass(Part):
    """Hourglass control (Ganzenmueller 2015), in Young's moduli: in place of the residual, unless that is named too."""

    model_config = example({"coefficient": 0.1})
    key: ClassVar[str] = "hourglass"
    holds_modes: ClassVar[bool] = True
    switchable: ClassVar[bool] = True
    coefficient: Annotated[float, Unit("", ge=0)]

    @property
    def acts(self) -> bool:
        return self.coefficient > 0.0

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        return traits.pairwise and traits.reference

    def coefficients(self, host: Host) -> dict[str, float]:
        return {"spring": 0.25 * self.coefficient * host.youngs_modulus / host.scales.stress}

    def pair_term(self, host: Host) -> PairTerm | None:
        return PairTerm("hold", _spring, ("spring",), shares=True)


def _spring(space: Space, layout: Layout, smoothing: str, Coefficients: type) -> wp.Function:
    """The factory of its pair term."""
    real, vec, dim, Fields = space.scalar, space.vec, space.dim, fields_struct(space, layout)
    Points, Answers, at = points_struct(space), answers_struct(space), element(space.mat)

    @wp.func
    def hold(
        c: Coefficients,
        density: real,
        points: Points,
        answers: Answers,
        fields: Fields,
        others: Fields,
        i: int,
        j: int,
        wr: vec,
        r: vec,
        apart: vec,
        square: real,
        both: real,
    ) -> vec:
        # Twice the distance less what both deformations say of it, along the line between.
        H = real(2.0) * wp.identity(n=dim, dtype=real) + at(answers.gradient, i)
        gap = real(2.0) - wp.dot((H + at(answers.gradient, j)) * r, apart) / square
        return (c.spring * both * gap) * apart

    return hold
