"""The particles of a body as those see them that they may meet: its own, or of a body that processes share those of all of
them.

Every process finds the forces on the particles that it owns, by all particles that are near these. Where they are and how
fast is brought up to date by a message before the forces are found, and the forces on copies by one after it.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from wsph.backend.space import Array
from wsph.contact.pinball.law import Balls
from wsph.sph.pairs import Pairs, find_pairs

T = TypeVar("T")


class Everyone:
    """The particles of a body that is here as a whole, as kernels see them: those of `own`."""

    def __init__(self, own: Balls):
        self.struct = own

    def bring(self) -> None:
        """Bring where they are, and how fast, up to date."""

    def spread(self, force: Array) -> None:
        """Have the copies have the forces (n,) vec that their owners have."""

    def rows(self, values: np.ndarray) -> np.ndarray:
        """What all of them have, of what those here have, (n, ...). All processes that share the body ask together."""
        return values

    def smallest(self, values: np.ndarray) -> float:
        """The smallest number of all of them, of those (n,) of the particles here."""
        return float(values.min())

    def near(self, where: np.ndarray, sources: np.ndarray, reach: float, device: str, *, same: bool) -> Pairs:
        """Pairs of the particles for which forces are found here, of all that are at `where`, with `sources` within `reach`,
        as rows of those that are here. `same`: they are the sources."""
        return find_pairs(where, sources, reach, device, same=same)

    def numbers(self, rows: np.ndarray) -> np.ndarray:
        """The numbers among all of them of particles that are here."""
        return rows

    def told(self, of: Callable[[], T], least: float) -> T:
        """What a function gives in the process that has the least of the numbers of all."""
        return of()

    def here(self, numbers: np.ndarray) -> np.ndarray:
        """Where particles stand here, by their numbers among all of them; -1 for those that do not."""
        return numbers
