"""Initial stress of a body.

Of a rate law it is the stress that the state begins with, and nothing else has to be known. A total law has the stress of a
deformation, and none at the start: there an initial stress S0, of the reference configuration, is a field of the points, and
the law is one about it: energy W(F) + S0:E + W0, first Piola stress dW/dF + F S0, Cauchy stress more by F S0 F^T/J. That is
a hyperelastic law too, so energy is kept, and a rigid turn takes the initial stress with it. W0, what a linear solid stores
at S0, makes the energy that of the stress: for a linear law W(E) + S0:E + W0 = (E + E0):C:(E + E0)/2 with C E0 = S0.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, fields_struct
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.laws import Laws

INITIAL = "initial_stress"
"""The field of a total law's initial stress."""


def initial_field(constitutive: Constitutive, wanted: bool) -> Field:
    """The field of the initial stress of a total law, where there is one: all states of a body share it."""
    width = constitutive.width * (wanted and constitutive.laws.total is not None)
    return Field(INITIAL, width, "Pa", at_points=True, derived=True, hidden=True)


@cache
def total_of(space: Space, laws: Laws, layout: Layout) -> wp.Function:
    """Warp function (p, fields, H, i) -> stress and first Piola stress of point i by its total law, about its initial stress
    where it has any."""
    Params, mat, Fields = laws.Params, space.mat, fields_struct(space, layout)
    plain, about = laws.total or laws.respond, laws.total_about or laws.respond

    @wp.func
    def total(p: Params, fields: Fields, H: mat, i: int):
        if wp.static(INITIAL in layout):
            return about(p, H, fields.initial_stress[i])
        else:
            return plain(p, H)

    return total


@cache
def total_energy_of(space: Space, laws: Laws, layout: Layout) -> wp.Function:
    """Warp function (p, fields, i) -> the energy per reference volume of point i by its total law, about its initial stress
    where it has any."""
    real, Params, Fields = space.scalar, laws.Params, fields_struct(space, layout)
    plain, about = laws.total_energy or laws.energy, laws.total_energy_about or laws.energy

    @wp.func
    def energy(p: Params, fields: Fields, i: int) -> real:
        if wp.static(INITIAL in layout):
            return about(p, fields.deformation[i], fields.initial_stress[i])
        else:
            return plain(p, fields.deformation[i])

    return energy


def stored_by(constitutive: Constitutive, stress: np.ndarray) -> np.ndarray:
    """The energy density that a linear solid stores at stresses (m, width), (m,), nondimensional."""
    full = np.zeros((len(stress), 3, 3))
    for column, (i, j) in enumerate(constitutive.state.components):
        full[:, i, j] = full[:, j, i] = stress[:, column]
    mean = np.trace(full, axis1=1, axis2=2) / 3.0
    deviator = full - mean[:, None, None] * np.eye(3)
    bulk, shear = float(constitutive.params.elastic_bulk), float(constitutive.params.elastic_shear)
    return 0.5 * mean**2 / bulk + 0.25 * (deviator**2).sum((1, 2)) / shear
