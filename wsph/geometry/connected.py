"""Connected parts of a graph."""

# pyright: strict

import numpy as np


def connected(first: np.ndarray, second: np.ndarray, count: int) -> np.ndarray:
    """The part that each of `count` nodes belongs to, joined by edges from `first` (e,) to `second` (e,): parts are
    numbered in the order of their lowest node, (count,) int."""
    lowest = np.arange(count)
    while True:
        before = lowest.copy()
        least = np.minimum(lowest[first], lowest[second])
        for ends in (first, second):
            # The roots of both ends are hooked to the lower of them, so that parts join as trees do, not node by node.
            np.minimum.at(lowest, before[ends], least)
            np.minimum.at(lowest, ends, least)
        while (lowest != lowest[lowest]).any():
            lowest = lowest[lowest]
        if (lowest == before).all():
            return np.unique(lowest, return_inverse=True)[1].reshape(count)
