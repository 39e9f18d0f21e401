"""Runge-Kutta-Chebyshev on one set (He & Seaid 2016): second order, for bodies damped strongly in every mode.

Its region lies along the negative real axis. On the imaginary axis |R(iy)|^2 = 1 + y^4 (1/4 - 2 a3 + 2 a4) > 1 for every
number of stages, so undamped waves grow at every Courant number, and the paper's "not subjected to CFL" is its viscosity's
doing.
"""

# pyright: strict

import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from wsph.protocols import AnyState, OneSet
from wsph.stability.regions import Limit, damped_limit, margin

DAMPING = 2.0 / 13.0
MOST_STAGES = 200


class Coefficients:
    """The scheme's coefficients for s stages (He & Seaid 2016, after eq 25), gamma with the sign of the original scheme,
    gamma_j = -(1 - b_(j-1) T_(j-1)(q0)) mu~_j: the paper prints a plus, with which the scheme is not consistent."""

    def __init__(self, stages: int, epsilon: float = DAMPING):
        s, q0 = stages, 1.0 + epsilon / stages**2
        unit = [np.eye(s + 1)[j] for j in range(s + 1)]
        T: list[Any] = [chebyshev.chebval(q0, u) for u in unit]
        once: list[np.ndarray] = [chebyshev.chebder(u) for u in unit]
        twice: list[np.ndarray] = [chebyshev.chebder(u, 2) for u in unit]
        T1: list[Any] = [chebyshev.chebval(q0, u) if j else 0.0 for j, u in enumerate(once)]
        T2: list[Any] = [chebyshev.chebval(q0, u) if j > 1 else 0.0 for j, u in enumerate(twice)]
        q1 = T1[s] / T2[s]
        b = [0.0, 0.0, *(T2[j] / T1[j] ** 2 for j in range(2, s + 1))]
        b[0] = b[1] = b[2]
        self.mu = [0.0, 0.0, *(2.0 * q0 * b[j] / b[j - 1] for j in range(2, s + 1))]
        self.nu = [0.0, 0.0, *(-b[j] / b[j - 2] for j in range(2, s + 1))]
        self.mu_tilde = [0.0, b[1] * q1, *(2.0 * q1 * b[j] / b[j - 1] for j in range(2, s + 1))]
        self.gamma = [0.0, 0.0, *(-(1.0 - b[j - 1] * T[j - 1]) * self.mu_tilde[j] for j in range(2, s + 1))]
        self.c = [0.0, 0.0, *(q1 * T2[j] / T1[j] for j in range(2, s + 1))]
        self.c[1] = self.c[2] / T1[2]

    def weights(self) -> np.ndarray:
        """Weights w of the stages' rates in a step written out, U + dt sum_j w_j F_j, (s,)."""
        s = len(self.mu) - 1
        before, last = np.zeros(s), self.mu_tilde[1] * np.eye(s)[0]
        for j in range(2, s + 1):
            new = (
                self.mu[j] * last
                + self.nu[j] * before
                + self.mu_tilde[j] * np.eye(s)[j - 1]
                + self.gamma[j] * np.eye(s)[0]
            )
            before, last = last, new
        return last

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """The stability polynomial at z = lambda dt, by the recursion of a step: written in powers of z it would lose every
        digit beyond some fifteen stages."""
        before, last = np.ones_like(z), 1.0 + self.mu_tilde[1] * z
        for j in range(2, len(self.mu)):
            first = 1.0 - self.mu[j] - self.nu[j] + self.gamma[j] * z
            before, last = last, first + (self.mu[j] + self.mu_tilde[j] * z) * last + self.nu[j] * before
        return last


def stages_for(courant: float) -> int:
    """Stages for a Courant number with c = sqrt(E/rho) (He & Seaid 2016, eq 28, with the floor of the root: it gives the
    five stages that the text has at 2.5, and eleven of the twelve cells of table 1)."""
    return 1 + math.floor(math.sqrt(1.0 + courant / 0.131))


class RungeKuttaChebyshev:
    """RKC of second order with `stages` evaluations a step, 2 or more, or "auto": by eq 28 from the Courant number.

    For strong damping of every mode (a damping ratio above 0.9, where it holds more than leapfrog per evaluation). Without
    enough viscosity it is refused: leapfrog is the alternative. Plastic flow of one direction keeps the order; where it
    turns, the return to the yield surface is of first order.
    """

    formulations = ("total-lagrangian", "stress-points", "updated-lagrangian")
    order = 2

    def __init__(self, system: OneSet, stages: int | str = "auto"):
        self.system, self.state = system, system.state
        if stages == "auto":
            stages = max(stages_for(system.clock.dt / system.bar_time), 2)
        if not isinstance(stages, int) or isinstance(stages, bool) or not 2 <= stages <= MOST_STAGES:
            raise ValueError(f'stages = {stages!r}: a whole number from 2 to {MOST_STAGES}, or "auto"')
        self.evaluations = stages
        self.coefficients = Coefficients(stages)
        self.stages = [system.new() for _ in range(3)]
        self.first, self.k = system.new(), system.new()
        # Where velocities are prescribed stages hold prescribed values, and the recursion would carry them into the impulse
        # that reactions and their work are measured by: the velocity is then summed up from the rates.
        self.sum = system.new() if system.held else None
        # Every stage is brought back from where its own rates lead: what goes on is the stage as it was before.
        self.allowed = system.new() if system.projects else None
        self.weights = self.coefficients.weights()

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        if not self.system.damped:
            return 0.0, "RKC amplifies every undamped wave: give the body viscosity, or use leapfrog"
        share = margin(self.system, self.order, amplifies=True)
        return damped_limit(self.system, self.coefficients.amplification, self.evaluations, share)

    def _allowed(self, stage: AnyState) -> AnyState:
        """A stage whose stresses the law allows: a copy, where the law has a yield surface."""
        if self.allowed is None:
            return stage
        self.system.combine(self.allowed, plain=[(1.0, stage)])
        self.system.project(self.allowed)
        return self.allowed

    def step(self) -> None:
        """One step, by launches alone."""
        s, y, m = self.system, self.state, self.coefficients
        s.rate(y, self.first)
        if self.sum is not None:
            s.combine(self.sum, plain=[(1.0, y)], timed=[(self.weights[0], self.first)], part="velocity")
        before, last = y, self.stages[0]
        s.combine(last, plain=[(1.0, y)], timed=[(m.mu_tilde[1], self.first)])
        s.impose(last, m.c[1])
        for j in range(2, self.evaluations + 1):
            s.rate(self._allowed(last), self.k)
            if self.sum is not None:
                s.combine(self.sum, plain=[(1.0, self.sum)], timed=[(self.weights[j - 1], self.k)], part="velocity")
            out = y if j == self.evaluations else next(x for x in self.stages if x is not before and x is not last)
            plain = [(1.0 - m.mu[j] - m.nu[j], y), (m.mu[j], last), (m.nu[j], before)]
            s.combine(out, plain=plain, timed=[(m.mu_tilde[j], self.k), (m.gamma[j], self.first)])
            if out is not y:
                s.impose(out, m.c[j])
            before, last = last, out
        if self.sum is not None:
            s.combine(y, plain=[(1.0, self.sum)], part="velocity")
        s.accept(y)
