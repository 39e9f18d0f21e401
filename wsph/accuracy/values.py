"""The numbers themselves that an accuracy is of, with their units; and records that have none yet."""

# pyright: strict

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wsph.accuracy.columns import Aim, Seen, judged
from wsph.accuracy.measures import Record, distances, frequency, mean, numbers
from wsph.accuracy.row import Halted, Row
from wsph.output.files import finite_or_none
from wsph.quantities import Table

UNITS = {"frequency": "Hz", "arrival": "s"}
"""Of quantities whose unit is not that of the column."""

PERIODS = np.arange(0.05, 2.0, 0.01)
"""Parts of a period that a record of less than one is compared with."""


def unit_of(name: str, quantity: str, row: Row) -> str:
    """The SI unit of a quantity of a column "PROBE.COLUMN"."""
    probe, _, column = name.rpartition(".")
    probes = row.result.summary.get("units", {}).get("probes", {})
    return UNITS.get(quantity) or str(probes.get(probe, {}).get(column, ""))


def values(rows: Sequence[Row], seen: Mapping[str, Seen]) -> list[Table]:
    """Of every row, for a plot of convergence: the numbers of the columns, in SI, where the quantity is one, and how far
    their records are from the finest's, relative, as estimates are."""
    own: list[dict[str, float | None]] = [{} for _ in rows]
    apart: list[dict[str, float | None]] = [{} for _ in rows]
    for name, each in seen.items():
        records, aim = [row.records[name] for row in reversed(rows)], each.aim
        for k, number in enumerate(distances(records, aim.quantity, aim.scale)[0]):
            apart[-1 - k][name] = finite_or_none(number)
        for k, number in enumerate(numbers(records, aim.quantity) if aim.quantity != "history" else ()):
            own[-1 - k][name] = finite_or_none(number)
    return [{"values": a, "differences": b} for a, b in zip(own, apart, strict=True)]


def value(name: str, each: Seen, rows: Sequence[Row]) -> Table:
    """The number of a column in SI with its `unit`, None of a history, and its bar: `half_width`, in that unit, of the
    number or of a band about the record; the number with its bar in words."""
    records, quantity = [row.records[name] for row in reversed(rows)], each.aim.quantity
    record = records[0]
    own = None if quantity == "history" else float(numbers(records, quantity)[0])
    size = mean(Record(record.times, np.abs(record.values))) if own is None else abs(own)
    width, unit = finite_or_none(each.estimate.bar * (each.aim.scale or size)), unit_of(name, quantity, rows[-1])
    words = "" if own is None else f"{quantity} {with_bar(own, width, unit)}"
    return {"value": own, "half_width": width, "unit": unit, "words": words}


def with_bar(number: float, bar: float | None, unit: str) -> str:
    """A number in words, to the digits that its bar leaves: "416.5 +- 0.9 Hz"."""
    if bar is None or not bar > 0.0:
        return f"{number:.6g} {unit}".rstrip() + (", no bar" if bar is None else "")
    size = max(abs(number), bar)
    digits = max(math.floor(math.log10(size)) - math.floor(math.log10(bar)) + 1, 1)
    if 1e-3 <= size < 1e6:
        places = max(digits - 1 - math.floor(math.log10(size)), 0)
        return f"{number:.{places}f} +- {bar:.{places}f} {unit}".rstrip()
    return f"{number:.{digits - 1}e} +- {bar:.1g} {unit}".rstrip()


def check_periods(row: Row, asked: Mapping[str, Aim]) -> None:
    """Raise Halted where a frequency is asked of a record without a whole period between crossings of its mean."""
    for name, aim in judged(row.records, asked)[0].items():
        record = row.records[name]
        if aim.quantity != "frequency" or math.isfinite(frequency(record)):
            continue
        length, part = float(record.times[-1] - record.times[0]), periods(record)
        # Crossings begin within the first half period: three are there after one and a half.
        end = float(record.times[0]) + 1.5 * length / part
        raise Halted(
            "refused",
            f"{name}: no whole period to have a frequency of: the record has about {part:.1g} of one; end at {end:.3g} s or later,"
            " or ask for another quantity",
        )


def periods(record: Record) -> float:
    """How many periods a record has that is too short to have a frequency: of the sine about a constant that is nearest."""
    phase = 2.0 * np.pi * np.linspace(0.0, 1.0, 201)
    begin, end = float(record.times[0]), float(record.times[-1])
    y = record.at(begin + (end - begin) * phase / (2.0 * np.pi))
    left: list[float] = []
    for part in PERIODS:
        waves: np.ndarray = np.stack([np.ones_like(phase), np.cos(part * phase), np.sin(part * phase)], 1)
        q: np.ndarray = np.linalg.qr(waves)[0]
        left.append(float(np.linalg.norm(y - q @ (y @ q))))
    return float(PERIODS[int(np.argmin(left))])
