"""Artificial stress (He & Seaid 2016, eqs 19-23; principal stresses by eigenvectors in any dimension).

Tension is opposed by -epsilon of it times (W(r)/W(spacing))^n, so that particles do not clump. The work done against it
is on the ledger.
"""

from typing import Annotated, ClassVar

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import principal
from wsph.parts.part import Host, Part
from wsph.parts.terms import PairTerm, StressTerm, answers_struct, points_struct
from wsph.protocols import Traits
from wsph.quantities import Unit
from wsph.sph.smoothing import SMOOTHING, SUPPORT

NUMBERS = ("epsilon", "exponent", "at_spacing")


class ArtificialStress(Part):
    """Artificial stress (He & Seaid 2016, eqs 19-23): tension is opposed by `epsilon` of it where particles are near."""

    key: ClassVar[str] = "artificial_stress"
    formal: ClassVar[int] = 1
    holds_modes: ClassVar[bool] = True
    epsilon: Annotated[float, Unit("", ge=0, le=1)] = 0.3
    exponent: Annotated[float, Unit("", ge=0)] = 4.0

    @property
    def every_direction(self) -> bool:
        return True

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        return traits.pairwise

    def coefficients(self, host: Host) -> dict[str, float]:
        value, real = SMOOTHING[host.smoothing](host.space)[0], host.space.scalar
        at_spacing = value(real(SUPPORT / host.support))
        return {"epsilon": self.epsilon, "exponent": self.exponent, "at_spacing": at_spacing}

    def pair_term(self, host: Host) -> PairTerm | None:
        return PairTerm("hold", _push, NUMBERS)

    def stress_term(self, host: Host) -> StressTerm | None:
        return StressTerm(_opposing, NUMBERS)


def _push(space: Space, layout: Layout, smoothing: str, Coefficients: type) -> wp.Function:
    """The factory of its pair term."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)
    Points, Answers, at = points_struct(space), answers_struct(space), element(space.mat)
    value = SMOOTHING[smoothing](space)[0]

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
        near = wp.pow(value(wp.sqrt(square) / c.h) / c.at_spacing, c.exponent)
        return near * ((at(answers.extra, i) + at(answers.extra, j)) * wr)

    return hold


def _opposing(space: Space, Coefficients: type) -> wp.Function:
    """The factory of its stress term: -epsilon times the tensile part of a stress, by principal stresses."""
    real, mat, dim, axes_of = space.scalar, space.mat, space.dim, principal(space)

    @wp.func
    def opposing(c: Coefficients, stress: mat) -> mat:
        axes, values = axes_of(stress)
        result = mat()
        for k in range(wp.static(dim)):
            tension = wp.max(values[k], real(0.0))
            for a in range(wp.static(dim)):
                for b in range(wp.static(dim)):
                    result[a, b] = result[a, b] - c.epsilon * tension * axes[a, k] * axes[b, k]
        return result

    return opposing
