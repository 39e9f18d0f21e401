"""Probes of many places, reduced on the host to one number a column: the smallest and the largest, the mean, the sum, the
integral over the volume at the start, of any field, also of those that are not linear in the state.

The device records what every place reads; the rows are reduced when they are read.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Sequence

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.output import fields
from wsph.output.fields import Formulas
from wsph.scene.probes import Probe
from wsph.simulation.probing.points import Probed, fault, no_field, record_kernel, selected, unit_of
from wsph.simulation.probing.recorder import RING, Recorder
from wsph.units import unit

MOST_BYTES = 2**28
"""Of a ring on the device."""

REDUCE: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "min": lambda values, _: values.min(1),
    "max": lambda values, _: values.max(1),
    "mean": lambda values, _: values.mean(1),
    "sum": lambda values, _: values.sum(1),
    "integral": lambda values, volumes: values @ volumes,
}
"""Of values (steps, places) and the volumes of the places, (steps,)."""


def needs_places(probe: Probe, formulas: Formulas) -> bool:
    """Whether a probe reduces what is read at every place: not what the device sums up, or whose largest it finds."""
    if probe.reduce is None:
        return False
    if any(name in formulas for name in probe.fields):
        return True
    curved = any(name in fields.DERIVED or fields.primitive(name) == fields.DEFORMATION for name in probe.fields)
    whole = not {"velocity", "displacement", "stress"}.isdisjoint(probe.fields)
    return probe.reduce in ("min", "integral") or curved or (probe.reduce == "max" and whole)


class ReducedRecorder(Recorder):
    """A probe of the places that `where` selects. A row on the device has, for each primitive field and each of its
    components, a number a place; of each row one number a column is kept, in SI units."""

    def __init__(
        self,
        probe: Probe,
        key: str,
        bodies: Sequence[Probed],
        space: Space,
        clock: Clock,
        every_step: bool,
        formulas: Formulas,
    ):
        able = [each for each in bodies if probe.body in (None, each.body.name)]
        self._body, read, sizes, stand = selected(probe, probe.where or "", key, able, formulas)
        self._reading, self._space, self._formulas = self._body.reading, space, formulas
        primitives = sorted({base for name in probe.fields for base in fields.primitives(name, formulas)})
        for name in primitives:
            if name not in self._reading.fields:
                raise no_field(self._body, name, key)
        made = {name: read(name)[0] for name in primitives}
        self._volumes = {name: sizes(name) for name in primitives}
        for name in (name for name in probe.fields if name in formulas):
            bases = fields.primitives(name, formulas)
            if len({self._reading.apart(base) for base in bases}) > 1:
                text = f"{name!r} is made of fields that stand at particles and inside of cells: name points with `at`"
                raise fault(f"{key}.fields", text)
        self._places = {name: stand(name) for name in primitives}
        self._names = [c for name in probe.fields for c in fields.columns(name, self._reading.labels, space.dim)]
        width = sum(len(components) * components[0].count for components in made.values())
        rows = RING if every_step else 1
        if width * rows * np.dtype(space.numpy).itemsize > MOST_BYTES:
            text = (
                f"{width} numbers of every step are too many to keep on the device: record it less often, as every = 10"
            )
            raise fault(f"{key}.every", text)
        super().__init__(probe, clock, width, space.scalar, every_step=every_step, kept=len(self._names))
        entries = [(name, c, each) for name, components in made.items() for c, each in enumerate(components)]
        bounded = [
            np.full(each.count, self._reading.fields[name].bounded and bool((each.weights < 0.0).any()))
            for name, _, each in entries
        ]
        kinds = (
            (np.arange(width + 1), wp.int32),
            (np.ones(width), space.scalar),
            (np.concatenate(bounded).astype(int), wp.int32),
            (np.cumsum([0, *np.concatenate([np.diff(each.offsets) for _, _, each in entries])]), wp.int32),
            (np.concatenate([self._reading.index(name, each.places, c) for name, c, each in entries]), wp.int32),
            (np.concatenate([each.weights for _, _, each in entries]), space.scalar),
        )
        self._arrays = [wp.array(numbers, dtype=kind, device=clock.device) for numbers, kind in kinds]

    def record(self) -> None:
        inputs = [self._clock.step, *self._arrays, *self._reading.buffers, 0]
        self._clock.launch(record_kernel(self._space), self._ring.shape[1], inputs, [self._ring])

    def reduced(self, rows: np.ndarray) -> np.ndarray:
        """One number a column, (steps, columns), SI."""
        start, values = 0, dict[str, np.ndarray]()
        for name, volumes in self._volumes.items():
            field = self._reading.fields[name]
            end = start + field.width * len(volumes)
            values[name] = np.moveaxis(rows[:, start:end].reshape(len(rows), field.width, -1), 1, 2) * field.scale
            start = end
        reduce = REDUCE[self.probe.reduce or "mean"]
        labels = self._reading.labels
        found: list[np.ndarray] = []
        for column in self._names:
            base = fields.primitives(column, self._formulas)[0]
            if column in self._formulas:
                series = self._formulas[column].of(values, labels, self._places[base])
            else:
                series = fields.component(column, values[base], labels)
            found.append(reduce(series, self._volumes[base]))
        return np.stack(found, 1)

    def columns(self) -> dict[str, np.ndarray]:
        rows, _ = self.kept()
        return {name: rows[:, k] for k, name in enumerate(self._names)}

    @property
    def units(self) -> dict[str, str]:
        of = {name: unit_of(name, self._reading, self._formulas) for name in self._names}
        if self.probe.reduce != "integral":
            return of
        return {name: _times_volume(each, self._space.dim) for name, each in of.items()}


def _times_volume(text: str, dim: int) -> str:
    """The unit of an integral over a volume, an area in 2D or a length in 1D."""
    volume = ("m", "m2", "m3")[dim - 1]
    if text in ("1", ""):
        return volume if text else ""
    known = {dimension: name for name, dimension in ((n, unit(n)[1]) for n in ("J", "N", "kg", "N/m", "J/m"))}
    return known.get(unit(f"{text} {volume}")[1], f"{text} {volume}")
