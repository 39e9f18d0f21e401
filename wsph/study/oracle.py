"""The answer that a study compares its runs with."""

# pyright: strict

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, model_validator

from wsph.errors import Fault, SceneError
from wsph.expressions import compile_expression
from wsph.quantities import Model
from wsph.simulation.result import Result


def _expression(text: str) -> str:
    compile_expression(text)
    return text


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

    def error(self, result: Result, folder: Path) -> float:
        """Relative error of a run; `folder` holds the reference's file, a time and a value a row. Raises SceneError for a
        probe, a column or a field that the run does not have, and for a file that cannot be read."""
        exact = compile_expression(self.exact or "0")
        if self.field is not None:
            try:
                position = result.particles["position"]
                return result.error(exact(position, result.time), self.field, self.norm)
            except KeyError as error:
                raise SceneError("study", [Fault(0, "oracle.field", str(error.args[0]))]) from None
        probe = result.probes.get(self.probe or "")
        if probe is None or self.column not in probe:
            there = ", ".join(probe or result.probes) or "no probe"
            raise SceneError(
                "study", [Fault(0, "oracle", f"no column {self.column!r} of probe {self.probe!r}; there is {there}")]
            )
        if self.reference is not None:
            try:
                times, values = np.loadtxt(folder / self.reference, delimiter=",", skiprows=1, unpack=True, ndmin=2)
            except (OSError, ValueError) as error:
                raise SceneError(
                    "study", [Fault(0, "oracle.reference", f"{self.reference}: cannot be read: {error}")]
                ) from None
            wanted: np.ndarray = np.interp(probe["time"], np.asarray(times), np.asarray(values))
            return self._norm(probe[self.column] - wanted, wanted)
        at = result.scene.probes[[p.name for p in result.scene.probes].index(self.probe or "")].at or ((0.0,),)
        points = np.tile(np.array(at[0]), (len(probe["time"]), 1))
        wanted = np.array([float(exact(p[None, :], float(t))[0]) for p, t in zip(points, probe["time"], strict=True)])
        return self._norm(probe[self.column] - wanted, wanted)

    def _norm(self, gap: np.ndarray, wanted: np.ndarray) -> float:
        power = float(self.norm)
        return float((np.sum(np.abs(gap) ** power) / np.sum(np.abs(wanted) ** power)) ** (1.0 / power))
