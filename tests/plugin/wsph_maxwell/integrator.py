"""Ralston's two-stage Runge-Kutta method on one particle set."""

from wsph.protocols import OneSet
from wsph.stability.regions import Limit


class Ralston:
    """y* = y + 2/3 dt k1, y += dt (k1/4 + 3/4 k2). Order 2.

    Undamped waves grow by a factor 1 + (omega dt)^4/8 per step: for damped materials, at small steps.
    """

    sets = 1
    order = 2
    evaluations = 2

    def __init__(self, system: OneSet):
        self.system, self.state = system, system.state
        self.middle, self.k1, self.k2 = system.new(), system.new(), system.new()

    def limit(self) -> Limit:
        """Largest Courant number at which the fastest wave grows by less than 0.1 % per step."""
        return self.system.courant(0.3), "omega dt <= .3: growth below 0.1 % per step"

    def step(self) -> None:
        """One step, by launches alone."""
        s, y = self.system, self.state
        s.rate(y, self.k1)
        s.combine(self.middle, plain=[(1.0, y)], timed=[(2.0 / 3.0, self.k1)])
        s.impose(self.middle, 2.0 / 3.0)
        s.rate(self.middle, self.k2)
        s.combine(y, plain=[(1.0, y)], timed=[(0.25, self.k1), (0.75, self.k2)])
        s.accept(y)
