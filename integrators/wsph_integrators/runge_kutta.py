"""Runge-Kutta methods on one set: tableaus that check themselves, and low-storage chains.

Below a damping ratio of 0.9 no explicit Runge-Kutta method beats leapfrog on stability per evaluation: an undamped wave of s
evaluations is held up to omega dt = s - 1 at most, by leapfrog up to 2 a piece. Their limits here are where a mode of the
body, damped or not, is first multiplied by more than 1; methods that amplify every undamped wave (Euler, the two-stage ones)
have the limit 0 without damping on every mode: they are for comparisons.

Orders hold with loads, motions and damping that depend on time and for every smooth law. Where a yield surface is crossed
none above the second is left (the law has a kink there), and where the flow turns the first, the order of the return itself.
"""

# pyright: strict

import numpy as np

from wsph.protocols import OneSet
from wsph.stability.regions import Limit, limit_of


class Tableau:
    """A method y_i = y + dt sum_j a_ij k_j, k_i = f(t + c_i dt, y_i), y += dt sum_i b_i k_i; each row of `a` with up to
    three entries that are not zero."""

    formulations = ("stress-points", "total-lagrangian", "updated-lagrangian")
    order = 1
    a: tuple[tuple[float, ...], ...] = ()
    b: tuple[float, ...] = (1.0,)

    def __init__(self, system: OneSet):
        self.system, self.state = system, system.state
        self.stage = system.new() if self.a else None
        self.k = [system.new() for _ in self.b]
        self._check()

    @property
    def evaluations(self) -> int:
        """Right-hand sides in a step."""
        return len(self.b)

    @classmethod
    def _matrix(cls) -> np.ndarray:
        """`a` as a lower triangular matrix, (evaluations, evaluations)."""
        a = np.zeros((len(cls.b), len(cls.b)))
        for row, values in enumerate(cls.a, 1):
            a[row, : len(values)] = values
        return a

    @classmethod
    def conditions(cls) -> dict[int, float]:
        """How far the tableau is from the order conditions of orders 1 to 4, the largest of each."""
        a = cls._matrix()
        b, c = np.array(cls.b), a.sum(1)
        return {
            1: abs(b.sum() - 1.0),
            2: abs(b @ c - 1 / 2),
            3: max(abs(b @ c**2 - 1 / 3), abs(b @ a @ c - 1 / 6)),
            4: max(
                abs(b @ c**3 - 1 / 4),
                abs((b * c) @ a @ c - 1 / 8),
                abs(b @ a @ c**2 - 1 / 12),
                abs(b @ a @ a @ c - 1 / 24),
            ),
        }

    def _check(self) -> None:
        wrong = [order for order, gap in self.conditions().items() if order <= self.order and gap > 1e-14]
        if wrong:
            raise ValueError(f"{type(self).__name__}'s tableau misses the conditions of order {wrong[0]}")

    @classmethod
    def polynomial(cls) -> np.ndarray:
        """Coefficients of the stability polynomial R(z), ascending."""
        a = cls._matrix()
        power, result = np.ones(len(cls.b)), [1.0]
        for _ in cls.b:
            result.append(float(np.array(cls.b) @ power))
            power = a @ power
        return np.array(result)

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        return limit_of(self.system, self.polynomial(), self.order)

    def step(self) -> None:
        """One step, by launches alone."""
        s, y = self.system, self.state
        for i, k in enumerate(self.k):
            at = y
            if i > 0:
                row = self.a[i - 1]
                s.combine(self.stage, plain=[(1.0, y)], timed=[(c, self.k[j]) for j, c in enumerate(row) if c])
                s.impose(self.stage, sum(row))
                s.project(self.stage)
                at = self.stage
            s.rate(at, k)
        terms = [(c, k) for c, k in zip(self.b, self.k, strict=True) if c]
        s.combine(y, plain=[(1.0, y)], timed=terms[:3])
        if terms[3:]:
            s.combine(y, plain=[(1.0, y)], timed=terms[3:])
        s.accept(y)


class Euler(Tableau):
    """Euler's method, first order. Amplifies every undamped wave: for comparisons, and for strongly damped bodies."""


class Midpoint(Tableau):
    """The explicit midpoint rule (RK2), second order. Amplifies undamped waves by 1 + (omega dt)^4/8 a step."""

    order = 2
    a = ((0.5,),)
    b = (0.0, 1.0)


class PredictorCorrector(Midpoint):
    """The predictor-corrector of He & Seaid 2016, eq 29 (PC2): half a step to predict, half a step from there to correct,
    2 U - U^n; written out it is the midpoint rule."""


class RungeKutta4(Tableau):
    """The classical fourth-order method: for smooth problems whose phases have to hold, at omega dt <= 2.828.

    Of second order at most where a material begins to yield, of the first where it flows in turning directions.
    """

    order = 4
    a = ((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0))
    b = (1 / 6, 1 / 3, 1 / 3, 1 / 6)


class Chain:
    """Y = U; for a in `chain`: Y = U + a dt f(Y); with `tail` the last is U + dt/4 f(U) + 3 dt/4 f(Y) (order 3)."""

    formulations = ("stress-points", "total-lagrangian", "updated-lagrangian")
    order = 2
    chain: tuple[float, ...] = ()
    tail = False

    def __init__(self, system: OneSet):
        self.system, self.state = system, system.state
        self.stage, self.k = system.new(), system.new()
        self.first = system.new() if self.tail else None

    @property
    def evaluations(self) -> int:
        """Right-hand sides in a step."""
        return len(self.chain) + self.tail

    @classmethod
    def polynomial(cls) -> np.ndarray:
        """Coefficients of the stability polynomial R(z), ascending."""
        inner = np.array([1.0])
        for a in cls.chain:
            inner = np.concatenate([[1.0], a * inner])
        if not cls.tail:
            return inner
        whole = np.concatenate([[1.0], 0.75 * inner])
        whole[1] += 0.25
        return whole

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        return limit_of(self.system, self.polynomial(), self.order)

    def step(self) -> None:
        """One step, by launches alone."""
        s, y, at, time = self.system, self.state, self.state, 0.0
        for n, a in enumerate(self.chain):
            k = self.first if self.tail and n == 0 else self.k
            s.rate(at, k)
            if n == len(self.chain) - 1 and not self.tail:
                s.combine(y, plain=[(1.0, y)], timed=[(a, k)])
                break
            s.combine(self.stage, plain=[(1.0, y)], timed=[(a, k)])
            at, time = self.stage, a
            s.impose(self.stage, time)
            s.project(self.stage)
        if self.tail:
            s.rate(self.stage, self.k)
            s.combine(y, plain=[(1.0, y)], timed=[(0.25, self.first), (0.75, self.k)])
        s.accept(y)


class KinnmarkGray48(Chain):
    """The eight-evaluation method kg4-8 (Kinnmark & Gray 1984), third order, fourth on linear problems, omega dt <= 6.928:
    where a one-set Runge-Kutta method with a long step is needed. Of second order at most where a material begins to
    yield."""

    order = 3
    chain = (1 / 8, 1 / 14, 1 / 6, 1 / 6, 1 / 4, 1 / 3, 2 / 3)
    tail = True


class Wedge28(Chain):
    """An eight-evaluation second-order chain whose region holds a wedge about the imaginary axis (w20-2-8): waves with some
    damping on every mode, omega dt <= 6.43."""

    chain = (0.09966979814739331, 0.08021605019663398, 0.1556358290181721, 0.1716821628243327, 0.2496814365677456,
             0.3358573441523998, 0.5, 1.0)  # fmt: skip
