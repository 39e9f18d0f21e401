"""Which part of a scene this process has, and what it asks of the others."""

# pyright: strict

from typing import Protocol

import numpy as np

from wsph.backend.space import Array


class Domain(Protocol):
    """The part of a scene that a process has. All processes call all of these in the same order: one that skips a call
    leaves the others waiting. What they give back is the same number in every process, to the bit."""

    def exchange(self, *arrays: Array) -> None:
        """Set what this part has of the others' particles, in arrays over particles, to what the others have there."""
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
