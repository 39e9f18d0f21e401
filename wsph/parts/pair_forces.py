"""What acts between two particles of one set beside the stress: viscosity, which stress points have too, hourglass control,
artificial stress. Each is there only where a scene names it, and its work is on the ledger.

- viscosity (He & Seaid 2016, eq 17): h v.x/(x^2 + .01 h^2), linear and quadratic, on approaching pairs or, linear, on all.
  It acts along the current line of two particles, with the weights of the hourglass control in place of a gradient: angular
  momentum is kept to rounding. The paper's acts along each particle's own corrected gradient and keeps no momentum at a
  boundary (`correction`): it is there to compare with. Stress points, which have no pairs among nodes, have it as a stress,
  the mean over all directions of what pairs do: rho alpha c h (tr D I + 2 D)/(2 (dim + 2)) on all motion, or against
  compression rho/2 (alpha c h tr D - beta (h tr D)^2) I, the bulk viscosity of von Neumann and Richtmyer;
- hourglass control (Ganzenmueller 2015): a spring along the current line of two particles against what their deformation
  gradients say of their distance. The weights |W'|/r, which sum with r^2 to one, stand for his V_j W_ij/X^2, which do too;
- artificial stress (He & Seaid 2016, eqs 19-23; principal stresses by eigenvectors in any dimension): tension is opposed
  by -epsilon of it times (W(r)/W(spacing))^n, so that particles do not clump.
"""

from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.protocols import BodyKeys


@dataclass(frozen=True)
class PairParts:
    """Which of them a composition has: part of what its kernels are made for. `viscosity` is its kind, "" for none; with
    `own` it acts along each particle's own corrected gradient."""

    viscosity: str = ""
    own: bool = False
    hourglass: bool = False
    artificial: bool = False

    @property
    def holding(self) -> bool:
        """Whether there are forces that hold spurious modes and do work of their own."""
        return self.hourglass or self.artificial


def parts_of(body: BodyKeys, correction: str) -> PairParts:
    """The pair forces that a body of a scene names; `correction` is that of the run."""
    hourglass = body.hourglass.coefficient if body.hourglass is not None else 0.0
    kind, own = "", False
    if body.viscosity is not None:
        kind, own = body.viscosity.kind, (body.viscosity.correction or correction) == "paper"
    return PairParts(kind, own, hourglass > 0.0, body.artificial_stress is not None)


@cache
def pair_struct(space: Space) -> type:
    """Struct of their nondimensional coefficients: speed sqrt(E/rho), smoothing length h, alpha, beta; a quarter of the
    hourglass stiffness; epsilon, exponent and W at the spacing."""
    names = ("speed", "h", "alpha", "beta", "spring", "epsilon", "exponent", "at_spacing")
    annotations = dict.fromkeys(names, space.scalar)
    return wp.struct(type("PairCoefficients", (), {"__annotations__": annotations, "__module__": __name__}))
