"""Which part of a scene this process has, and what it asks of the others."""

# pyright: strict

from typing import Protocol

import numpy as np

from wsph.backend.space import Array


class Domain(Protocol):
    """The particles of a scene that a process owns. All processes call all of these in the same order: one that skips a call
    leaves the others waiting. The numbers returned are the same in every process, to the bit."""

    def exchange(self, *arrays: Array) -> None:
        """Update the copies of other parts' particles, in arrays over particles, from the parts that own them."""
        ...

    def sum(self, x: np.ndarray) -> np.ndarray:
        """The sums of the parts' numbers, element by element."""
        ...

    def max(self, x: np.ndarray) -> np.ndarray:
        """The largest of the parts' numbers, element by element; NaN where any is."""
        ...

    def min(self, x: np.ndarray) -> np.ndarray:
        """The smallest of the parts' numbers, element by element; NaN where any is."""
        ...

    def gather(self, x: np.ndarray) -> np.ndarray:
        """The rows of all parts, in the order of the particles of the whole."""
        ...


class Whole:
    """The domain of a scene in one process: every call gives what it was given."""

    def exchange(self, *arrays: Array) -> None:
        """There are no other parts."""

    def sum(self, x: np.ndarray) -> np.ndarray:
        """The numbers themselves."""
        return x

    def max(self, x: np.ndarray) -> np.ndarray:
        """The numbers themselves."""
        return x

    def min(self, x: np.ndarray) -> np.ndarray:
        """The numbers themselves."""
        return x

    def gather(self, x: np.ndarray) -> np.ndarray:
        """The rows themselves."""
        return x


WHOLE = Whole()
