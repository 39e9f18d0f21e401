"""The answer that a study compares its runs with."""

# pyright: strict

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, model_validator

from wsph.errors import Fault, SceneError
from wsph.expressions import compile_expression
from wsph.quantities import Model
from wsph.scene.scene import Scene
from wsph.simulation.result import Result


def _expression(text: str) -> str:
    compile_expression(text)
    return text


def _fault(key: str, text: str) -> SceneError:
    return SceneError("study", [Fault(0, key, text)])


@dataclass(frozen=True)
class Reference:
    """A series to compare with, `values` at `times` [s], both (n,): times do not fall, and all numbers are finite."""

    times: np.ndarray
    values: np.ndarray

    @classmethod
    def read(cls, path: Path, name: str) -> "Reference":
        """Read a file with a line of headings, then a time and a value a line. Raises SceneError."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of a file without numbers, which is said below
                times, values = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True, ndmin=2)
        except (OSError, ValueError) as error:
            raise _fault("oracle.reference", f"{name}: cannot be read: {error}") from None
        made = cls(np.asarray(times), np.asarray(values))
        wrong = np.flatnonzero(~(np.isfinite(made.times) & np.isfinite(made.values)))
        if len(made.times) < 2:
            raise _fault(
                "oracle.reference", f"{name}: has {len(made.times)} rows of a time and a value; at least 2 are needed"
            )
        if len(wrong):
            raise _fault("oracle.reference", f"{name}: line {wrong[0] + 2}: has what is no finite number")
        if len(fallen := np.flatnonzero(np.diff(made.times) < 0.0)):
            raise _fault("oracle.reference", f"{name}: line {fallen[0] + 3}: its time is before that of the line above")
        return made

    def covers(self, times: np.ndarray) -> np.ndarray:
        """Which of the times [s] lie where it has values, (n,) bool."""
        slack = 1e-9 * (self.times[-1] - self.times[0])
        return (times >= self.times[0] - slack) & (times <= self.times[-1] + slack)


@dataclass(frozen=True)
class Compared:
    """The relative `error` of a run, and what it was compared over where that is not the whole run, in words."""

    error: float
    over: str = ""


class Oracle(Model):
    """The answer to compare with: of a probe's column over the whole run, or of a field's component at its end."""

    probe: str | None = None
    column: str | None = None
    field: str | None = None
    exact: Annotated[str, AfterValidator(_expression)] | None = None
    reference: str | None = None
    norm: Literal[1, 2] = 2

    @model_validator(mode="after")
    def _one(self) -> "Oracle":
        if (self.field is None) == (self.probe is None) or (self.probe is None) != (self.column is None):
            raise ValueError("give either field, or probe and column")
        if (self.exact is None) == (self.reference is None) or (self.reference and self.probe is None):
            raise ValueError("give either exact, or with a probe the file of a reference")
        return self

    def content(self, folder: Path) -> str:
        """What the file of its reference holds, a file in `folder`, or nothing. Raises SceneError."""
        try:
            return (folder / self.reference).read_text(encoding="utf-8") if self.reference is not None else ""
        except (OSError, UnicodeDecodeError) as error:
            raise _fault("oracle.reference", f"{self.reference}: cannot be read: {error}") from None

    def check(self, scene: Scene, folder: Path) -> None:
        """Raise SceneError, before anything runs, where a scene has no such probe, where the reference, a file in `folder`,
        cannot be read or has nothing of the run, or where the exact answer asks for a place that a probe does not have."""
        if self.probe is None:
            return
        probes = {probe.name: probe for probe in scene.probes}
        if self.probe not in probes:
            there = ", ".join(probes) or "none"
            raise _fault("oracle.probe", f"no probe is named {self.probe!r} in the scene; there is {there}")
        exact = compile_expression(self.exact or "0")
        if probes[self.probe].at is None and any(exact.uses(axis) for axis in "xyz"):
            text = f"{self.exact!r} uses a place, but probe {self.probe!r} is over a selection: write it with t alone"
            raise _fault("oracle.exact", text)
        if self.reference is not None:
            own = Reference.read(folder / self.reference, self.reference).times
            if own[-1] <= 0.0 or own[0] > scene.end:
                text = f"{self.reference}: is of {own[0]:g} to {own[-1]:g} s, the run of 0 to {scene.end:g} s"
                raise _fault("oracle.reference", text)

    def error(self, result: Result, folder: Path) -> Compared:
        """Relative error of a run; `folder` holds the reference's file. A reference is compared with where it has values.
        Raises SceneError for a probe, a column or a field that the run does not have, for a file that cannot be read, and
        for an answer that is zero all over."""
        if self.field is not None:
            exact = compile_expression(self.exact or "0")
            try:
                return Compared(result.error(exact(result.particles["position"], result.time), self.field, self.norm))
            except KeyError as error:
                raise _fault("oracle.field", str(error.args[0])) from None
            except ValueError as error:
                raise _fault("oracle.exact", str(error)) from None
        probe = result.probes.get(self.probe or "")
        if probe is None or self.column not in probe:
            there = ", ".join(probe or result.probes) or "no probe"
            raise _fault("oracle", f"no column {self.column!r} of probe {self.probe!r}; there is {there}")
        times, values = probe["time"], probe[self.column]
        if self.reference is None:
            return Compared(self._norm(values, self._exact(result, times), "oracle.exact"))
        reference = Reference.read(folder / self.reference, self.reference)
        covered = reference.covers(times)
        if not covered.any():
            raise _fault("oracle.reference", f"{self.reference}: no record of the probe is within its times")
        wanted = np.interp(times[covered], reference.times, reference.values)
        error = self._norm(values[covered], wanted, "oracle.reference")
        if covered.all():
            return Compared(error)
        first, last = times[covered][[0, -1]].tolist()
        return Compared(
            error, f"from {first:g} to {last:g} s of {times[0]:g} to {times[-1]:g} s: the reference has no more"
        )

    def _exact(self, result: Result, times: np.ndarray) -> np.ndarray:
        """The exact answer at the times of a probe, at the point that the column is of."""
        exact = compile_expression(self.exact or "0")
        probe = next(each for each in result.scene.probes if each.name == self.probe)
        number = re.search(r"\[(\d+)\]$", self.column or "")
        place = np.array((probe.at or ((0.0,) * result.scene.dim,))[int(number[1]) if number else 0])[None, :]
        return np.array([float(exact(place, float(t))[0]) for t in times])

    def _norm(self, values: np.ndarray, wanted: np.ndarray, key: str) -> float:
        power = float(self.norm)
        size = float(np.sum(np.abs(wanted) ** power))
        if size == 0.0:
            raise _fault(key, "is zero wherever it is compared with: there is no relative error")
        return float((np.sum(np.abs(values - wanted) ** power) / size) ** (1.0 / power))
