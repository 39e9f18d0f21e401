"""Quiet faces, which let plane waves out: Lysmer & Kuhlemeyer 1969, J. Eng. Mech. Div. 95 (4), 859-877.

t = -rho c_p v_n n - rho c_s v_t, dashpots of the body's own impedance at the start: c_p is the wave speed of its stress
state (sqrt(E/rho) in a bar), c_s = sqrt(G/rho). Waves that meet the face along its normal leave without a reflection; of
those at an angle a part comes back. What leaves is dissipated. Nothing holds the face at rest: a steady load goes on
pushing it.
"""

# pyright: strict

from typing import ClassVar

from pydantic import model_validator

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.boundary.loads.acting import ActingLoad, Load
from wsph.boundary.loads.ground import Ground
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.boundary.loads.spring import by_face
from wsph.units import Scales


class Quiet(Load):
    """`quiet = true`."""

    key: ClassVar[str] = "quiet"
    shorthand: ClassVar[tuple[dict[str, object], ...]] = ({"const": True},)
    # Half a cell inside of the face, the mass before it would send back 2 to 4 % of a wave of 30 to 60 cells.
    on_faces: ClassVar[bool] = True

    @model_validator(mode="before")
    @classmethod
    def _switch(cls, given: object) -> object:
        if given is False:
            raise ValueError("false says nothing: leave the key out")
        return {} if given is True else given

    @property
    def resists(self) -> bool:
        return True

    def attach(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays) -> ActingLoad:
        damping = by_face(faces, *faces.impedance) / (scales.density * scales.velocity)
        return Ground(faces, None, damping, space, clock, arrays)
