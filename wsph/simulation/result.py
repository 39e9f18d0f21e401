"""The result of a run: fields, records and cost, and its error against an exact solution."""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wsph.errors import Unstable
from wsph.output import fields, presenting
from wsph.output.cells import Cells
from wsph.scene.scene import Scene
from wsph.simulation.summary import Summary, TableUnits

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pyvista import Plotter

    from wsph.output.presenting import DataFrame, Dataset
    from wsph.output.view.recorded import Shot

ENERGIES = (
    "kinetic",
    "strain",
    "dissipated",
    "hourglass",
    "contact",
    "contact_stored",
    "contact_dissipated",
    "contact_numerical",
    "fracture",
    "external_work",
    "residual",
)
"""Columns of the history that are energies."""


@dataclass(repr=False)
class Result:
    """Result of a run. `history`: columns of history.csv; `probes[name]`: columns by field; `particles`: final fields, SI.

    `status` is "completed", "unstable" (a state is not finite), "stopped" (energy was created) or "interrupted"; `stable` is
    False for the second and the third. `particles["position"]` is the reference position; fields have the precision of the
    run. Of processes that share a scene the first has those of all, and each those of its part where frames are in parts:
    its own, and copies of corners of its cells, of which the field "vtkGhostType" is 1. `cells`: those that the particles
    are corners of, with what stands inside them as computed, None where they are but points; `units` of fields by their
    names. `cost` holds steps, right_hand_sides, wall_seconds and particle_steps_per_second.
    """

    scene: Scene
    status: str
    reason: str
    time: float
    history: dict[str, np.ndarray]
    probes: dict[str, dict[str, np.ndarray]]
    particles: dict[str, np.ndarray]
    summary: Summary
    failure: Unstable | None = field(default=None, repr=False)
    cells: Cells | None = field(default=None, repr=False)
    units: dict[str, str] = field(default_factory=dict[str, str], repr=False)

    @property
    def stable(self) -> bool:
        """Whether the run stayed within what it can vouch for."""
        return self.failure is None

    @property
    def cost(self) -> dict[str, float]:
        """Steps, right-hand sides and seconds of the run."""
        return {
            key: self.summary[key] for key in ("steps", "right_hand_sides", "wall_seconds", "particle_steps_per_second")
        }

    @property
    def work(self) -> int:
        """Pair visits: the pairs of all operators times the right-hand sides."""
        return self.summary["pairs"] * self.summary["right_hand_sides"]

    @property
    def seconds(self) -> float:
        """Wall time inside of steps [s], without setting up and compiling; zero where none was measured."""
        rate = self.summary["particle_steps_per_second"]
        return self.summary["particles"] * self.summary["steps"] / rate if rate > 0.0 else 0.0

    @property
    def crack_area(self) -> float:
        """Of the cracks of all bodies [m^(dim-1)], of those parts that know it."""
        return float(sum(body.get("crack_area", 0.0) for body in self.summary.get("fracture", {}).values()))

    def recorded(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """The columns of all probes by "PROBE.COLUMN": the times [s] and the values of each, (n,) and (n,)."""
        return {
            f"{name}.{key}": (columns["time"], values)
            for name, columns in self.probes.items()
            for key, values in columns.items()
            if key != "time"
        }

    def error(
        self, exact: Callable[[np.ndarray, float], np.ndarray] | np.ndarray, name: str, norm: float | str = 2
    ) -> float:
        """Relative error of a final scalar field or component ("stress_xx") against `exact`.

        `exact` is an array (n,), or a function of reference position (n, dim) [m] and time [s]. Norm 1 is
        sum|e|/sum|exact|, 2 is sqrt(sum e^2/sum exact^2), inf the largest |e| over the largest |exact|. Raises ValueError
        for another norm, another shape or an exact solution that is zero, KeyError for a field that is not there.
        """
        computed = self.field(name).astype(np.float64)
        wanted = np.asarray(exact(self.particles["position"], self.time) if callable(exact) else exact, float)
        if wanted.size != computed.size:
            raise ValueError(f"exact has {wanted.size} values for {computed.size} particles")
        e, wanted = np.abs(computed - wanted.reshape(-1)), np.abs(wanted.reshape(-1))
        norm = np.inf if norm == "inf" else norm
        measures: dict[float | str, Callable[[np.ndarray], float]] = {1: np.sum, 2: _euclidean, np.inf: np.max}
        if norm not in measures:
            raise ValueError(f"norm {norm!r} is none of 1, 2, inf")
        size = measures[norm](wanted)
        if size == 0.0:
            raise ValueError("exact is zero everywhere: there is no relative error")
        return float(measures[norm](e) / size)

    def field(self, name: str) -> np.ndarray:
        """A final scalar field or component, (n,), SI: "density", "stress_xy", "velocity_x", ..."""
        if name in self.particles and (self.particles[name].ndim == 1 or self.particles[name].shape[1] == 1):
            return self.particles[name].reshape(-1)
        if "strain" in self.particles and fields.primitive(name) == fields.DEFORMATION and name != "strain":
            full = self.particles["strain"]
            derived = fields.DERIVED.get(name)
            return derived.of(full) if derived else full[..., fields.TENSOR.index(name.rpartition("_")[2])]
        base = fields.primitive(name)
        if base == name or base not in self.particles:
            hint = f"; name a component of {name}" if name in self.particles else ""
            raise KeyError(f"no scalar field {name!r} in the result{hint}; there is {', '.join(self.particles)}")
        try:
            return fields.component(name, self.particles[base], fields.TENSOR)
        except IndexError:
            raise KeyError(f"no component {name!r} in {self.scene.dim}D") from None

    def to_pandas(self, name: str = "history") -> "DataFrame":
        """The history, or a probe by its name, as a pandas DataFrame over the time [s]; `attrs["units"]` are the SI units of
        its columns. Raises OutputError where pandas is not installed, KeyError for another name."""
        return presenting.frame(self._table(name), self._units(name))

    def to_xarray(self) -> "Dataset":
        """The history and all probes as an xarray Dataset: a variable COLUMN over `time`, and of every probe PROBE.COLUMN
        over `time_PROBE`, each with its SI unit in `attrs["units"]`. Raises OutputError where xarray is not installed."""
        names = ("history", *self.probes)
        return presenting.dataset({name: (self._table(name), self._units(name)) for name in names}, self.scene.title)

    def _table(self, name: str) -> dict[str, np.ndarray]:
        if name != "history" and name not in self.probes:
            raise KeyError(f"no table {name!r}; there is {', '.join(('history', *self.probes))}")
        return self.history if name == "history" else self.probes[name]

    def _units(self, name: str) -> dict[str, str]:
        units: TableUnits = self.summary.get("units", {"history": {}, "probes": {}})
        return units["history"] if name == "history" else units["probes"].get(name, {})

    def _lines(self) -> list[tuple[str, str]]:
        """What is said of it in short."""
        s = self.summary
        rows = [
            ("status", f"{self.status}{': ' + self.reason if self.reason else ''}"),
            ("time", f"{self.time:.6g} s in {s['steps']} steps of {s['dt']:.4g} s"),
            ("particles", f"{s['particles']}, with {', '.join(self.particles)}"),
            ("probes", ", ".join(self.probes) or "none"),
            ("energy", ", ".join(f"{key} {value:.4g}" for key, value in s["energy"].items() if value)),
            ("cost", f"{s['wall_seconds']:.3g} s, {s['right_hand_sides']} right-hand sides"),
        ]
        return [*rows, *(("finding", words) for words in s["findings"])]

    def __repr__(self) -> str:
        title = self.scene.title or ", ".join(body.name for body in self.scene.bodies)
        return f"<result of {title!r}: {self.status} at t = {self.time:.6g} s, {self.summary['particles']} particles>"

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        return presenting.html(self.scene.title or "result", self._lines())

    def plot(self, name: str = "velocity", save: str | Path | None = None) -> "Figure":
        """A picture of a final field or component, of a probe over time by its name, of a column of the history, or of the
        ledger, "energy" (needs the extra "view"). Returns matplotlib's figure; with `save` it is written too. Raises
        OutputError for another name."""
        from wsph.output.view import pictures
        from wsph.output.view.look import Look

        made = self._curves(name)
        if made is None:
            made = pictures.picture(self._shot(), Look(name))
        if save is not None:
            pictures.save_figure(made, save)
        return made

    def interactive(self, name: str = "velocity") -> "Plotter":
        """A final field as a pyvista plotter, whose `show()` turns it with the mouse, in a window or, with the extra
        "notebook", in a notebook. Raises OutputError for another name."""
        from wsph.output.view import pictures
        from wsph.output.view.look import Look

        return pictures.plotter(self._shot(), Look(name))

    def _shot(self) -> "Shot":
        from wsph.output.view import recorded

        names = tuple(body.name for body in self.scene.bodies)
        return recorded.shot(self.particles, self.time, self.cells, self.units, names)

    def _curves(self, name: str) -> "Figure | None":
        """The figure of a probe or of the energies; None for a field."""
        from wsph.output.view.curves import over_time

        if fields.primitive(name) in self.particles:
            return None
        units: TableUnits = self.summary.get("units", {"history": {}, "probes": {}})
        if name in self.probes:
            columns = {key: values for key, values in self.probes[name].items() if key != "time"}
            return over_time(self.probes[name]["time"], columns, units["probes"].get(name, {}), f"probe {name}")
        if name in self.history:
            return over_time(self.history["time"], {name: self.history[name]}, units["history"], name)
        if name != "energy":
            return None
        columns = {key: self.history[key] for key in ENERGIES if np.any(self.history.get(key, 0.0))}
        unit = {1: "J/m2", 2: "J/m", 3: "J"}[self.scene.dim]
        return over_time(self.history["time"], columns, dict.fromkeys(columns, unit), "energy")


def _euclidean(values: np.ndarray) -> float:
    return np.sqrt(np.sum(values**2))
