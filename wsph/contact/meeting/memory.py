"""What contacts remember from step to step: kept arrays that evaluations read, and trial ones that they write."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import numpy as np
from numpy.typing import NDArray

from wsph.backend.arrays import Arrays, host, put
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.space import Array, Space, Struct
from wsph.contact.meeting.candidates import Candidates
from wsph.contact.meeting.dealt import Dealt
from wsph.contact.meeting.structs import FAR, memory, memory_struct
from wsph.contact.meeting.touch import keep_kernel

LONG = 1e9
"""The time for which a contact has been open that never was closed."""

ENERGIES = ("stored", "sprung", "lost")
"""What of it is energy."""


class Memory:
    """The memory of n contacts, right of those that are `dealt` to this process. Evaluations take `kept` and write `trial`;
    methods of several stages do so many times in a step, and `keep` takes the last one's as that of the step. A gap is that
    of the last evaluation, and none takes it: processes tell it like what acts."""

    def __init__(self, n: int, space: Space, clock: Clock, arrays: Arrays, domain: Domain = WHOLE):
        self._space, self._clock, self._known, self._domain = space, clock, arrays, domain
        self._make(n)

    def _make(self, n: int) -> None:
        self._n, self.dealt = n, Dealt(n, self._clock, self._domain)
        self.kept: Struct = memory_struct(self._space)()
        self.trial: Struct = memory_struct(self._space)()
        self._arrays: dict[str, Array] = {}
        for name, dtype in memory(self._space).items():
            self._arrays[name] = self._known.zeros(name, n, dtype, kept=True)
            setattr(self.kept, name, self._arrays[name])
            setattr(self.trial, name, self._known.zeros(f"trial.{name}", n, dtype) if name != "gap" else self["gap"])
        self._arrays["parted"].fill_(LONG)

    def renew(self, n: int, rows: NDArray[np.int64]) -> None:
        """Of other contacts, `n` of them: `rows` (old n,) are those of the old ones among them, -1 where one is gone. What
        these have lost stays lost, with their friction's springs; it is counted with the first."""
        self.deal(np.zeros(0, np.int64))
        old = {name: host(array).copy() for name, array in self._arrays.items()}
        self._make(n)
        stays = rows >= 0
        for name, array in self._arrays.items():
            values = host(array).copy()
            if name != "lost":
                values[rows[stays]] = old[name][stays]
            elif n:
                # Several vertices may have become one.
                np.add.at(values, np.where(stays, rows, 0), old["lost"] + np.where(stays, 0.0, old["sprung"]))
            put(array, values)

    def __getitem__(self, name: str) -> Array:
        """A kept array."""
        return self._arrays[name]

    def keep(self, rows: Candidates) -> None:
        """Take what the last evaluation has written for those that have candidates (a launch)."""
        if rows.count:
            self._clock.launch(keep_kernel(self._space), rows.count, [rows.struct.which, self.trial], [self.kept])

    def deal(self, near: NDArray[np.int64]) -> None:
        """Deal out anew those that are `near` anything (k,), ascending: on the host, by all processes together."""
        self.dealt.gather(*self._arrays.values())
        self.dealt.deal(near)

    def release(self, near: NDArray[np.int64]) -> None:
        """Forget all but those with candidates, `near` (k,), on the host; what the others have lost stays lost."""
        out = np.ones(self._n, bool)
        out[near] = False
        held = ("elastic", "stick", "account")
        out &= np.any([host(self[name]).reshape(self._n, -1).any(1) for name in held], axis=0)
        if not out.any():
            return
        values = {name: host(array).copy() for name, array in self._arrays.items()}
        values["lost"][out] += values["sprung"][out]
        for name in ("account", "elastic", "damper", "stick", "stored", "sprung", "ease"):
            values[name][out] = 0.0
        values["parted"][out] = LONG
        for name, array in self._arrays.items():
            put(array, values[name])

    def gaps(self, near: NDArray[np.int64]) -> NDArray[np.float64]:
        """Gaps (n,) at the end of the last step of those with candidates, `near` (k,); NaN of what has nothing to meet."""
        found = np.full(self._n, np.nan)
        found[near] = host(self["gap"])[near]
        return np.where(found < 0.1 * FAR, found, np.nan)

    @property
    def stored(self) -> float:
        """Energy that the contacts hold, nondimensional."""
        return self.dealt.total(self["stored"]) + self.dealt.total(self["sprung"])

    @property
    def lost(self) -> float:
        """Energy that friction and damping have taken so far, nondimensional."""
        return self.dealt.total(self["lost"])

    def shares(self, part: str = "") -> dict[str, Share]:
        """The part of the kept arrays that this process has, by their names, which begin with that of a `part`."""
        return self.dealt.shares([f"{part}.{name}" if part else name for name in self._arrays])
