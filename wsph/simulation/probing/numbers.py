"""Numbers that people read off a run, of what the scene names: forces, torques and works, as columns and as probes.

Whatever has such numbers says which sums on the device they are (`wsph.reporting.Reported`); their names, units and columns
are made here, alike for boundaries, contacts, tools and sections.
"""

from collections.abc import Collection, Mapping, Sequence
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain
from wsph.backend.kernels import kernel
from wsph.errors import Fault, SceneError
from wsph.output.fields import AXES
from wsph.reporting import Reported, Term
from wsph.scene.messages import nearest
from wsph.scene.probes import Probe
from wsph.simulation.probing.recorder import Recorder
from wsph.units import Scales

UNITS = {"force": ("N/m2", "N/m", "N"), "torque": ("J/m2", "N", "N m"), "work": ("J/m2", "J/m", "J")}
"""SI units of the numbers in 1D, 2D and 3D: per area of the bar, per depth of the sheet."""


WORK = "work"


def components(field: str, dim: int) -> tuple[str, ...]:
    """The numbers that a field of a probe stands for."""
    if field == "force":
        return tuple(f"force_{axis}" for axis in AXES[:dim])
    if field == "torque":
        return ((), ("torque",), tuple(f"torque_{axis}" for axis in AXES))[dim - 1]
    return (field,)


def field_of(number: str) -> str:
    """The field that a number is a component of."""
    return number.partition("_")[0]


def unit(number: str, dim: int) -> str:
    """The SI unit of a number."""
    return UNITS[field_of(number)][dim - 1]


def scale(number: str, scales: Scales, dim: int) -> float:
    """The SI value of a nondimensional number."""
    return scales.stress * scales.length ** (dim - 1 if field_of(number) == "force" else dim)


def column(reported: Reported, number: str) -> str:
    """The column of history.csv of a number: "reaction_NAME_x", "work_NAME", "section_NAME_moment", ..."""
    kind, name, (field, _, axis) = reported.kind, reported.name, number.partition("_")
    if field == "force":
        return f"{kind}_{name}_{axis}"
    if kind == "reaction":
        return f"{field}_{name}{'_' * bool(axis)}{axis}"
    called = "moment" if kind == "section" and field == "torque" else field
    return f"{kind}_{name}_{called}{'_' * bool(axis)}{axis}"


class Numbers:
    """All numbers of a run: columns of history.csv with their units, and their values.

    `stood`: what the works stood at when the run began, by column, nondimensional, which is not of the run: zero, but after
    a relaxation, or where something is stored from the start (`wsph.simulation.ledger` does the same).
    """

    def __init__(
        self,
        reported: Sequence[Reported],
        scales: Scales,
        dim: int,
        domain: Domain = WHOLE,
        shared: Collection[str] = (),
    ):
        """`shared`: the names of those of which every process of a `domain` has a part; of others each has all."""
        self._reported = reported
        self._terms = [
            (column(each, number), terms, scale(number, scales, dim), domain if each.name in shared else WHOLE)
            for each in reported
            for number, terms in each.numbers.items()
        ]
        self.stood = {column(each, WORK): 0.0 for each in reported if WORK in each.numbers}
        self.units = {column(each, number): unit(number, dim) for each in reported for number in each.numbers}
        """SI units of the columns, in their order."""

    def values(self) -> list[float]:
        """The columns at present, SI (launches, and copies from the device)."""
        found = self.present()
        return [(found[name] - self.stood.get(name, 0.0)) * scale for name, _, scale, _ in self._terms]

    def open(self) -> None:
        """Begin to count works (launches, and copies from the device)."""
        found = self.present()
        self.stood = {name: found[name] for name in self.stood}

    def present(self) -> dict[str, float]:
        """All sums as they are, by column, nondimensional."""
        for each in self._reported:
            each.gather()
        copies: dict[int, np.ndarray] = {}
        return {name: _value(terms, copies, domain) for name, terms, _, domain in self._terms}


def _value(terms: Sequence[Term], copies: dict[int, np.ndarray], domain: Domain) -> float:
    total = 0.0
    for term in terms:
        key = id(term.values)
        if key not in copies:
            copies[key] = np.asarray(term.values.numpy(), np.float64).ravel()
        mine = copies[key][term.first : term.first + term.count * term.stride : term.stride]
        # As the device adds them up, one after the other.
        rows = np.concatenate([[total], term.factor * domain.joined(mine)])
        total = float(np.add.accumulate(rows)[-1])
    return total


@cache
def _kernel() -> wp.Kernel:
    @kernel()
    def record(
        step: wp.array(dtype=wp.int64),
        first: wp.array(dtype=wp.int32),
        count: wp.array(dtype=wp.int32),
        stride: wp.array(dtype=wp.int32),
        factor: wp.array(dtype=wp.float64),
        values: wp.array(dtype=wp.float64),
        adds: int,
        ring_out: wp.array2d(dtype=wp.float64),
    ):
        c = wp.tid()
        row = int(step[0] % wp.int64(ring_out.shape[0]))
        total = wp.float64(0.0)
        if adds != 0:
            total = ring_out[row, c]
        for k in range(count[c]):
            total += factor[c] * values[first[c] + k * stride[c]]
        ring_out[row, c] = total

    return record


class NumberRecorder(Recorder):
    """A probe of the numbers of one thing in the scene. A row has a column for each number; a launch adds a term to each
    that has one in an array. `_stood`: what its work stood at when the run began, nondimensional.

    _passes  # of each launch, `first`, `count`, `stride` (c,) int32, `factor` (c,) float64, and the array, flat
    """

    _stood = 0.0

    def __init__(
        self, probe: Probe, key: str, reported: Sequence[Reported], scales: Scales, clock: Clock, dim: int, often: bool
    ):
        """`often`: every step."""
        self._of = of = _named(probe.of or "", f"{key}.of", reported)
        for k, name in enumerate(probe.fields):
            if not any(number in of.numbers for number in components(name, dim)):
                there = ", ".join(dict.fromkeys(field_of(number) for number in of.numbers))
                text = f"{of.name!r} has no {name}{' in 1D' * (dim == 1 and name == 'torque')}: it has {there}"
                raise SceneError("scene", [Fault(0, f"{key}.fields.{k}", text)])
        self._numbers = [number for name in probe.fields for number in components(name, dim)]
        self._scale = [scale(number, scales, dim) for number in self._numbers]
        self._units = {number: unit(number, dim) for number in self._numbers}
        super().__init__(probe, clock, len(self._numbers), wp.float64, every_step=often)
        self._passes = _passes([of.numbers[number] for number in self._numbers], clock.device)

    def record(self) -> None:
        self._of.gather()
        for number, inputs in enumerate(self._passes):
            self._clock.launch(
                _kernel(), len(self._numbers), [self._clock.step, *inputs, int(number > 0)], [self._ring]
            )

    def columns(self) -> dict[str, np.ndarray]:
        """The record so far, SI: one array (records,) a number."""
        rows, _ = self.kept()
        stood = {WORK: self._stood}
        return {name: (rows[:, k] - stood.get(name, 0.0)) * self._scale[k] for k, name in enumerate(self._numbers)}

    def begin(self, stood: Mapping[str, float]) -> None:
        self._stood = stood.get(column(self._of, WORK), 0.0)

    @property
    def units(self) -> dict[str, str]:
        return self._units


def _named(name: str, key: str, reported: Sequence[Reported]) -> Reported:
    """What has a name. Raises SceneError where nothing does that has numbers."""
    names = {each.name: each for each in reported}
    if name not in names:
        there = "there is " + ", ".join(names) if names else "nothing in this scene has any"
        text = f"nothing that has numbers is named {name!r}; {nearest(name, names, there)}"
        raise SceneError("scene", [Fault(0, key, text)])
    return names[name]


def _passes(numbers: Sequence[Sequence[Term]], device: str) -> list[list[object]]:
    """The terms of numbers (c of them) by launches, each of one array and at most one term a number; at least one launch."""
    left = [list(terms) for terms in numbers]
    found: list[list[object]] = []
    while any(left) or not found:
        array = next((terms[0].values for terms in left if terms), None)
        mine = [next((term for term in terms if term.values is array), None) for terms in left]
        for terms, term in zip(left, mine, strict=True):
            if term is not None:
                terms.remove(term)
        whole = [(0, 0, 1) if term is None else (term.first, term.count, term.stride) for term in mine]
        rows = [wp.array(list(row), dtype=wp.int32, device=device) for row in zip(*whole, strict=True)]
        factor = wp.array([0.0 if term is None else term.factor for term in mine], dtype=wp.float64, device=device)
        values = wp.zeros(1, dtype=wp.float64, device=device) if array is None else array.flatten()  # pyright: ignore[reportAttributeAccessIssue]
        found.append([*rows, factor, values])
    return found
