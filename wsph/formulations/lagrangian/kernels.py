"""The kernels of a Lagrangian composition; `wsph.formulations.lagrangian.system` has the equations."""

from functools import cache

from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.flow import drift_kernel, flow_kernel
from wsph.formulations.lagrangian.forces import force_between_kernel, force_from_points_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.held_energy import held_energy_kernel
from wsph.formulations.lagrangian.strain import strain_kernel
from wsph.formulations.updated.moments import moments_kernel
from wsph.parts.body_force import Parts


class Kernels:
    """The kernels of a composition: one instance per (space, laws, which fields there are, form).

    `strain` (`moments` in the current configuration) finds what forces take of every point, `force` the accelerations,
    `drift` and `flow` the rates of the rest, `residual` the energy of the residual; those that the form has.
    """

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: Parts, form: Form, smoothing: str):
        if form.moving:
            self.moments = moments_kernel(space, laws, layout, form, smoothing)
        else:
            self.strain = strain_kernel(space, laws, layout, form, smoothing)
        if form.points:
            self.force = force_from_points_kernel(space, layout, parts, form)
        else:
            self.force = force_between_kernel(space, layout, parts, form, smoothing)
        self.drift = drift_kernel(space, layout)
        if form.residual:
            self.residual = held_energy_kernel(space, fields_struct(space, layout), form.points)
        if form.moving or not form.total:
            self.flow = flow_kernel(space, laws, layout, form, smoothing)


@cache
def kernels(space: Space, laws: Laws, layout: Layout, parts: Parts, form: Form, smoothing: str) -> Kernels:
    return Kernels(space, laws, layout, parts, form, smoothing)
