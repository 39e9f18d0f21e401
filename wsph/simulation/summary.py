"""The contents of summary.json."""

# pyright: strict

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from typing import NotRequired, TypedDict

import numpy as np

from wsph.plugins import registry
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.ledger import Ledger

VERSIONS = (("wsph", "wsph"), ("warp", "warp-lang"), ("numpy", "numpy"), ("meshio", "meshio"))
"""Packages that a result depends on: the name in the summary, and the distribution."""


@dataclass(frozen=True)
class Ending:
    """How a run ended: `status` and `reason`, at which `step`, from which step on it ran (`first`), the wall time of all
    and that `inside` of steps [s]."""

    status: str
    reason: str
    step: int
    first: int
    wall: float
    inside: float


class TableUnits(TypedDict):
    """SI units of the columns of the `history` and of the `probes`, by their names."""

    history: dict[str, str]
    probes: dict[str, dict[str, str]]


class Summary(TypedDict):
    """What summary.json holds. `findings` are what makes the answer worth less, in words; `energy` by the ledger's columns
    [J], `fracture` by the bodies that can break, `units` of the columns of tables."""

    status: str
    reason: str
    findings: list[str]
    steps: int
    time: float
    dt: float
    particles: int
    pairs: int
    right_hand_sides: int
    wall_seconds: float
    particle_steps_per_second: float
    bytes_per_particle: float
    energy: dict[str, float]
    fracture: NotRequired[dict[str, dict[str, float]]]
    relaxation: NotRequired[Mapping[str, object]]
    energy_step: int
    momentum: list[float]
    device: str
    units: NotRequired[TableUnits]
    versions: dict[str, str]
    plugins: dict[str, str]
    scene: dict[str, object]


class _Fracture(TypedDict):
    fracture: NotRequired[dict[str, dict[str, float]]]


def summary(
    composition: Composition, ledger: Ledger, history: dict[str, np.ndarray], ending: Ending, findings: list[str]
) -> Summary:
    """Everything that is said of a run as a whole. `history` are the columns of its records."""
    last = {name: float(values[-1]) if len(values) else 0.0 for name, values in history.items()}
    scene, particles, timeline = composition.scene, composition.particles, composition.time_step.timeline
    steps = particles * (ending.step - ending.first)
    return {
        "status": ending.status,
        "reason": ending.reason,
        "findings": findings,
        "steps": ending.step,
        "time": timeline.time(ending.step),
        "dt": timeline.dt,
        "particles": particles,
        "pairs": composition.pairs,
        "right_hand_sides": ending.step * composition.evaluations,
        "wall_seconds": ending.wall,
        "particle_steps_per_second": steps / ending.inside if ending.inside > 0.0 else 0.0,
        "bytes_per_particle": composition.nbytes / particles,
        # external_work includes what the bodies started with: the residual is it less all the others.
        "energy": {name: last[name] for name in ledger.columns},
        **_fracture(composition),
        # Of the last good state: where the run ended in a state that is not finite, before its last step.
        "energy_step": int(last["step"]),
        "momentum": [last[f"momentum_{axis}"] for axis in "xyz"[: scene.dim]],
        "device": composition.device,
        "versions": {name: metadata.version(package) for name, package in VERSIONS}
        | {"python": platform.python_version()},
        "plugins": plugins_of(scene),
        "scene": scene.data(),
    }


def _fracture(composition: Composition) -> _Fracture:
    """By body that can break: the energy set free, the energy of the crack surfaces [J], their area [m^(dim-1)], and the
    broken particles."""
    scales, found, dim = composition.scales, dict[str, dict[str, float]](), composition.scene.dim
    units = {"energy": scales.stress * scales.length**dim, "area": scales.length ** (dim - 1)}
    for run in (run for run in composition.bodies if run.system.breaks):
        parts: dict[str, float] = run.system.fracture()
        found[run.body.name] = {name: v * units.get(name.rpartition("_")[2], 1) for name, v in parts.items()}
    return {"fracture": found} if found else {}


def plugins_of(scene: Scene) -> dict[str, str]:
    """Distributions and versions of the plugins that the scene names."""
    name = scene.run.integrator.name
    models = [body.material.model for body in scene.bodies]
    return {
        f"integrator {name}": registry.origin("integrators", name),
        **{f"material {model}": registry.origin("materials", model) for model in models},
    }
