"""Stages of an evaluation: kernels, each of which takes what the rows around have from the one before."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.flow import drift_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lattice.edges import answers, volumes
from wsph.formulations.lattice.edges.flow import dilation_kernel, flow_kernel
from wsph.formulations.lattice.edges.kernels import force_kernel, gradient_kernel, spread_kernel
from wsph.parts.body_force import BodyForceKinds


@dataclass(frozen=True)
class Stage:
    """A kernel over rows or, of `means`, over runs of blocks: what it takes `before` and `after` the table of these, and its
    outputs."""

    kernel: wp.Kernel
    before: Sequence[object]
    after: Sequence[object]
    outputs: Sequence[object]
    means: bool = False


class EdgeKernels:
    """The kernels of a composition, as `wsph.formulations.lagrangian.rates.LagrangianKernels` has them; those that the form
    has."""

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form, width: int):
        self.gradient = gradient_kernel(space, width)
        self.spread = spread_kernel(space, width, form.stabilised, form.fades >= 0)
        self.force = force_kernel(space, layout, parts, form, width)
        self.drift = drift_kernel(space, layout)
        if form.blocks:
            self.mean = volumes.mean_kernel(space, width)
        if form.total and form.blocks:
            self.volume, self.close = volumes.volume_kernel(space, width), volumes.close_kernel(space, width)
            self.pull = volumes.pull_kernel(space, laws, layout, width)
            self.tell = volumes.telling_kernel(space, laws, layout, width)
        elif form.total:
            self.answer = answers.answer_kernel(space, laws, layout, width)
            self.tell = answers.telling_kernel(space, laws, layout, width)
        else:
            self.strain = answers.strain_kernel(space, laws, layout, form, width)
            self.flow = flow_kernel(space, laws, layout, form, width)
            if form.blocks:
                self.current = volumes.current_kernel(space, laws, layout, width)
                self.dilation = dilation_kernel(space, layout, width)


kernels_of = cache(EdgeKernels)
