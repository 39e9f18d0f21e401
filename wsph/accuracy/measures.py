"""What two records of one column differ by: the quantities that a tolerance can be of.

    history    integral |y - y*| / integral |y*| over the time that both have (relative L1)
    frequency  of the crossings of the mean
    mean       over time
    final      the last value
    peak       the value of largest size
    arrival    when half of the peak is first reached

All but the history are one number, whose difference is relative to the number itself. With a `scale`, a size in the
column's own unit, differences are relative to that: for signals that are nearly zero, whose own size says nothing.
"""

# pyright: strict

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from wsph.scene.outputs import Quantity

QUANTITIES: tuple[str, ...] = get_args(Quantity)

SMALL = 1e-3
"""A column whose integral is below this part of the largest of its field is zero by symmetry, and not judged."""

SAMPLES = 2001
"""Times at which two records are compared beside their own."""


@dataclass(frozen=True)
class Record:
    """A column of a probe: `values` (n,) in their SI unit at `times` (n,) [s], which rise."""

    times: np.ndarray
    values: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """Its values at other times, linear between its own."""
        return np.interp(times, self.times, self.values)

    def between(self, begin: float, end: float) -> "Record":
        """The part of it from one time to another, both in it [s]."""
        inside = self.times[(self.times > begin) & (self.times < end)]
        times = np.array([begin, *inside, end])
        return Record(times, self.at(times))


def integral(values: np.ndarray, times: np.ndarray) -> float:
    """By trapezia."""
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(times)))


def distances(records: Sequence[Record], quantity: str = "history", scale: float | None = None) -> np.ndarray:
    """Relative differences of k records of one column, (k, k), symmetric: all relative to the first, which is the finest's.

    Infinite where the first has no size to be relative to, or a record no crossings to have a frequency of."""
    if quantity == "history":
        times = common_times(records)
        values = np.array([each.at(times) for each in records])
        size = scale * float(times[-1] - times[0]) if scale is not None else integral(np.abs(values[0]), times)
        apart = np.array([[integral(np.abs(one - other), times) for other in values] for one in values])
    else:
        own = numbers(records, quantity)
        size = scale if scale is not None else abs(float(own[0]))
        apart = np.abs(own[:, None] - own[None, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        found = apart / size
    return np.where(np.isfinite(found), found, np.where(apart == 0.0, 0.0, np.inf))


def numbers(records: Sequence[Record], quantity: str) -> np.ndarray:
    """A quantity that is one number, of k records of one column, (k,), over the time that all have: runs end with the first
    step that reaches the end, each at another time."""
    begin, end = _shared(records)
    return np.array([NUMBERS[quantity](each.between(begin, end)) for each in records])


def common_times(records: Sequence[Record]) -> np.ndarray:
    """Times that all records have, (n,) [s]: the first's own, and evenly spread ones."""
    begin, end = _shared(records)
    own = records[0].times
    spread = np.linspace(begin, end, SAMPLES)
    return np.sort(np.append(own[(own >= begin) & (own <= end)], spread))


def _shared(records: Sequence[Record]) -> tuple[float, float]:
    """The first and the last time that all records have [s]."""
    return max(float(each.times[0]) for each in records), min(float(each.times[-1]) for each in records)


def size(record: Record) -> float:
    """The integral of a column's size."""
    return integral(np.abs(record.values), record.times)


def frequency(record: Record) -> float:
    """Of the crossings of the mean, over whole periods [1/s]; not a number with fewer than three crossings."""
    y = record.values - mean(record)
    at = np.flatnonzero(np.signbit(y[1:]) != np.signbit(y[:-1]))
    if len(at) < 3:
        return float("nan")
    # The mean of a part of a period is no middle: half periods above and below it differ.
    at = at[: len(at) - (len(at) + 1) % 2]
    crossings = record.times[at] - y[at] * np.diff(record.times)[at] / (y[at + 1] - y[at])
    return float(0.5 * (len(at) - 1) / (crossings[-1] - crossings[0]))


def mean(record: Record) -> float:
    """Over time."""
    return integral(record.values, record.times) / float(record.times[-1] - record.times[0])


def final(record: Record) -> float:
    """The last value."""
    return float(record.values[-1])


def peak(record: Record) -> float:
    """The value of largest size, with its sign."""
    return float(record.values[np.argmax(np.abs(record.values))])


def arrival(record: Record) -> float:
    """When the size is first half of the peak [s], linear between records."""
    sizes = np.abs(record.values)
    half = 0.5 * float(sizes.max())
    k = int(np.argmax(sizes >= half))
    if k == 0 or sizes[k] == sizes[k - 1]:
        return float(record.times[k])
    part = (half - sizes[k - 1]) / (sizes[k] - sizes[k - 1])
    return float(record.times[k - 1] + part * (record.times[k] - record.times[k - 1]))


NUMBERS: dict[str, Callable[[Record], float]] = {
    "frequency": frequency,
    "mean": mean,
    "final": final,
    "peak": peak,
    "arrival": arrival,
}
