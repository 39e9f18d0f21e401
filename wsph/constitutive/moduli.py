"""Consequences of a material's moduli alone: its wave speed, and the digits that single precision leaves of its shear."""

# pyright: strict

import numpy as np

from wsph.backend.space import Space
from wsph.constitutive.stress_state import StressState
from wsph.doubts import doubt
from wsph.errors import Refused
from wsph.plugins.blame import blame
from wsph.protocols import Material

MODULI_SIGNATURE = "moduli(self) -> (bulk modulus, shear modulus) [Pa], both above zero, and density"

MOST_STIFFER = 1000.0
"""Bulk over shear modulus above which single precision is warned of."""


def wave_speed(material: Material, state: StressState, who: str) -> float:
    """The wave speed of a material in a stress state [m/s]. Raises Refused where it, or a modulus, is not finite and above
    zero. `who` is what messages call the material."""
    with blame(who, MODULI_SIGNATURE):
        bulk, shear = material.moduli()
        if not (np.isfinite([bulk, shear]).all() and bulk > 0.0 and shear > 0.0):
            raise Refused(f"{who}: its moduli {bulk:g} and {shear:g} Pa are not finite and above zero")
        speed = state.wave_speed(bulk, shear, material.density)
    if not (np.isfinite(speed) and speed > 0.0):
        raise Refused(f"{who}: its wave speed {speed:g} m/s is not finite and above zero")
    return speed


def warn_of_lost_digits(body: str, material: Material, space: Space, who: str) -> None:
    """Warn where single precision, which has seven digits for a stress, has few of them left for the deviator: where the
    bulk modulus is far above the shear modulus. `body` is the body's name."""
    bulk, shear = material.moduli()
    if space.precision == "f32" and bulk > MOST_STIFFER * shear:
        digits = 7.2 - np.log10(bulk / shear)
        doubt(
            f"body {body!r}: the bulk modulus of {who} is {bulk / shear:.3g} times its shear modulus: in single precision"
            f' about {max(digits, 0.0):.1f} digits are left for shear stresses; use run.precision = "f64", or a smaller poisson_ratio',
            stacklevel=6,
        )
