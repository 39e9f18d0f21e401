"""Candidates: what may be met before anything has gone further than the skin, as rows on the device."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np
import warp as wp
from numpy.typing import NDArray

from wsph.backend.space import Array
from wsph.contact.meeting.structs import candidates_struct


class CandidateArrays(Protocol):
    """What kernels take of candidates, as `candidates_struct` has it."""

    which: Array
    offsets: Array
    indices: Array


@dataclass(frozen=True)
class Candidates:
    """Those that have candidates: `which` (k,), ascending, and the struct that kernels take."""

    which: NDArray[np.int64]
    struct: CandidateArrays

    @property
    def count(self) -> int:
        """How many have candidates."""
        return len(self.which)


def rows_of_pairs(targets: NDArray[np.int64], sources: NDArray[np.int64], device: str) -> Candidates:
    """The pairs (p,) as rows, each once, ascending."""
    wide = int(sources.max(initial=0)) + 1
    # Sorted by hand: for so many, np.unique takes several times as long.
    pairs = targets * wide + sources
    pairs.sort()
    pairs = pairs[np.diff(pairs, prepend=-1) > 0]
    target = pairs // wide
    begin = np.flatnonzero(np.diff(target, prepend=-1))
    struct = cast(CandidateArrays, candidates_struct()())
    struct.which = wp.array(target[begin], dtype=wp.int32, device=device)
    struct.offsets = wp.array(np.append(begin, len(pairs)), dtype=wp.int32, device=device)
    struct.indices = wp.array(pairs - target * wide, dtype=wp.int32, device=device)
    return Candidates(target[begin], struct)


def none(device: str) -> Candidates:
    """No candidates."""
    return rows_of_pairs(np.zeros(0, np.int64), np.zeros(0, np.int64), device)
