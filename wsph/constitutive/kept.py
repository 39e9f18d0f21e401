"""The internals that are kept beside a material's own."""

# pyright: strict

from dataclasses import dataclass

from wsph.constitutive.stress_state import StressState
from wsph.plugins.traits import dissipates, own_internals

THINNING, STORED = "thinning", "stored_energy"


@dataclass(frozen=True)
class Kept:
    """Where each stands in the vector of internals, -1 where it is not kept, and how many all are.

    thinning     # logarithm of the section (uniaxial stress) or thickness (plane stress) over that at the start
    stored       # energy stored by a rate law, per reference volume
    dissipation  # dissipated energy, per reference volume; always the last
    """

    thinning: int
    stored: int
    dissipation: int
    count: int

    @classmethod
    def of(cls, material: object, state: StressState, evolves: bool) -> "Kept":
        """What is kept of a material in a stress state. `evolves`: its stress follows from its rate law in a body whose
        deformation is followed."""
        own, thins, dissipating = len(own_internals(material)), evolves and bool(state.free), dissipates(material)
        stored = own + thins
        last = stored + evolves
        return cls(own if thins else -1, stored if evolves else -1, last if dissipating else -1, last + dissipating)

    @property
    def hidden(self) -> tuple[str, ...]:
        """Names of those that frames and probes do not read, in their order."""
        return (THINNING,) * (self.thinning >= 0) + (STORED,) * (self.stored >= 0)
