"""The residual."""

from wsph.quantities import Model, in_unit


class Residual(Model):
    """Stiffness of what a linear field leaves of the displacement differences, in Young's moduli."""

    coefficient: in_unit("", ge=0)
