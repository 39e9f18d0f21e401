"""What states carry of the velocities that were set in them, so that reactions are right for every form of a method.

What setting has changed a velocity by so far, s, obeys a method's own arithmetic: of sum c x + dt sum c k it is the sum of
c s(x), as rates set nothing. A method that goes on from a stage on which values were set (Shu & Osher's form of a
Runge-Kutta method), or from the state before the last (two-step methods), hands a part of s on; that part is counted with
what the accepted state itself is changed by. Few methods do: whether one does is found from steps that are listed, and the
others pay nothing.
"""

from functools import cache

import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.state import State

Plain = list[tuple[float, State]]


@cache
def _kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    """Kernels that sum up what setting changes, combine such sums, and give what is to be counted."""
    real, module = space.scalar, space.module("carried")

    @kernel(ranged=True, module=module)
    def change(first: int, velocity: wp.array(dtype=real), sign: wp.float64, sums_out: wp.array(dtype=wp.float64)):
        e = first + wp.tid()
        sums_out[e] = sums_out[e] + sign * wp.float64(velocity[e])

    @kernel(ranged=True, module=module)
    def mix(
        first: int,
        c: wp.vec3d,
        x0: wp.array(dtype=wp.float64),
        x1: wp.array(dtype=wp.float64),
        x2: wp.array(dtype=wp.float64),
        sums_out: wp.array(dtype=wp.float64),
    ):
        e = first + wp.tid()
        sums_out[e] = c[0] * x0[e] + c[1] * x1[e] + c[2] * x2[e]

    @kernel(ranged=True, module=module)
    def handed(
        first: int,
        place: wp.array(dtype=wp.int32),
        velocity: wp.array(dtype=real),
        sums: wp.array(dtype=wp.float64),
        counted: wp.array(dtype=wp.float64),
        free_out: wp.array(dtype=real),
    ):
        e = first + wp.tid()
        free_out[e] = velocity[place[e]] - real(sums[place[e]] - counted[place[e]])

    return change, mix, handed


class Forms:
    """Whether a method hands on what was set: watched while steps are listed. `_known`: by states, how many times values had
    been counted in what they were made from, or None of those with more in them."""

    def __init__(self) -> None:
        self.found, self._times = False, 0
        self._known: dict[State, int | None] = {}

    def combined(self, out: State, plain: Plain) -> None:
        """`out` is a sum of states, and of rates."""
        of = {self._known.get(x, self._times) for c, x in plain if c != 0.0}
        self._known[out] = of.pop() if len(of) == 1 else None

    def set(self, state: State, counted: bool) -> None:
        """Values were set in a state, `counted` or not."""
        if not counted:
            self._known[state] = None
            return
        # What was never seen is as the step found it.
        self.found |= self._known.get(state, self._times) != self._times
        self._times += 1
        self._known[state] = self._times


class Carried:
    """What states carry of the velocities set by a kind of boundaries: of the numbers that stand before the rest of a state,
    in their unit.

    _sums     # by states, (split,) float64
    _counted  # (split,) float64, that of the state whose work was counted last
    """

    def __init__(self, space: Space, state: State, arrays: Arrays):
        self._space, self._n, self._arrays = space, state.split, arrays
        self._sums: dict[State, Array] = {}
        self._counted = arrays.zeros("counted", self._n, wp.float64, kept=True)

    def _of(self, state: State) -> Array:
        if state not in self._sums:
            name = f"sums{len(self._sums)}"
            self._sums[state] = self._arrays.zeros(name, self._n, wp.float64, kept=True)
        return self._sums[state]

    def combined(self, out: State, plain: Plain, clock: Clock) -> None:
        """`out` is a sum of states (a launch)."""
        terms = [(c, self._of(x)) for c, x in plain]
        terms += [(0.0, terms[0][1])] * (3 - len(terms))
        inputs = [wp.vec3d(*(c for c, _ in terms)), *(x for _, x in terms)]
        clock.launch(_kernels(self._space)[1], self._n, inputs, [self._of(out)])

    def changes(self, state: State, sign: float, clock: Clock) -> None:
        """Before velocities are set, with -1, and after it, with 1: what this changes (a launch)."""
        clock.launch(_kernels(self._space)[0], self._n, [state.buffer, wp.float64(sign)], [self._of(state)])

    def count(self, state: State, place: Array, free: Array, clock: Clock) -> None:
        """`free` (k,) = the velocities at `place` (k,) in a state, which have been set, without all that setting has changed
        them by since it was counted last; it is counted now (launches)."""
        _, mix, handed = _kernels(self._space)
        sums = self._of(state)
        clock.launch(handed, int(place.size), [place, state.buffer, sums, self._counted], [free])
        clock.launch(mix, self._n, [wp.vec3d(1.0, 0.0, 0.0), sums, sums, sums], [self._counted])

    def start(self) -> None:
        """Nothing has been set yet."""
        for each in (*self._sums.values(), self._counted):
            each.zero_()
