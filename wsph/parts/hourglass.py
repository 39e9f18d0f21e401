"""Hourglass control."""

from wsph.quantities import Model, in_unit


class Hourglass(Model):
    """Hourglass control (Ganzenmueller 2015), in Young's moduli: in place of the residual, unless that is named too."""

    coefficient: in_unit("", ge=0)
