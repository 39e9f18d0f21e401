"""Integrators that a third party might write: their sources, for distributions that a test makes."""

SHU_OSHER = '''
"""SSP-RK3 of Shu & Osher (1988) as its paper writes it: stages from stages on which values were set."""
import numpy as np

from wsph.stability.regions import limit_of


class Plugin:
    formulations = ("stress-points", "total-lagrangian", "updated-lagrangian")
    order = 3
    evaluations = 3
    share = 1.0

    def __init__(self, system):
        self.system, self.state = system, system.state
        self.u1, self.u2, self.k = system.new(), system.new(), system.new()

    def limit(self):
        value, reason = limit_of(self.system, np.array([1.0, 1.0, 1 / 2, 1 / 6]), order=3)
        return self.share * value, reason

    def step(self):
        s, y = self.system, self.state
        s.rate(y, self.k)
        s.combine(self.u1, plain=[(1.0, y)], timed=[(1.0, self.k)])
        s.impose(self.u1, 1.0)
        s.rate(self.u1, self.k)
        s.combine(self.u2, plain=[(0.75, y), (0.25, self.u1)], timed=[(0.25, self.k)])
        s.impose(self.u2, 0.5)
        s.rate(self.u2, self.k)
        s.combine(y, plain=[(1 / 3, y), (2 / 3, self.u2)], timed=[(2 / 3, self.k)])
        s.accept(y)
'''

LEAPS = '''
"""The leapfrog of meteorologists: from the state before the last, by two steps."""


class Plugin:
    formulations = ("stress-points", "total-lagrangian")
    order = 2
    evaluations = 1

    def __init__(self, system):
        self.system, self.state = system, system.state
        self.before, self.now, self.k = system.new(), system.new(), system.new()

    def begin(self):
        s, y = self.system, self.state
        # The state before the start, to second order.
        s.rate(y, self.k)
        s.combine(self.now, plain=[(1.0, y)], timed=[(-0.5, self.k)])
        s.impose(self.now, -0.5)
        s.rate(self.now, self.k)
        s.combine(self.before, plain=[(1.0, y)], timed=[(-1.0, self.k)])
        s.impose(self.before, 0.0)

    def step(self):
        s, y = self.system, self.state
        s.rate(y, self.k)
        s.combine(self.now, plain=[(1.0, y)])
        s.combine(y, plain=[(1.0, self.before)], timed=[(2.0, self.k)])
        s.combine(self.before, plain=[(1.0, self.now)])
        s.accept(y)
'''
