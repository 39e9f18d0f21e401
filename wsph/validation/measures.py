"""Figures read off the runs of the published cases: plateaus, bands, stress intensity factors."""

# pyright: strict

from collections.abc import Iterator
from typing import TypedDict, cast

import numpy as np

from wsph.formulations.taylor.system import TwoSetSystem
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.simulation.result import Result
from wsph.validation import oracles

BAND_COLUMNS = (0.1, 0.4)
"""A band is measured in the columns of particles between these x [m], away from the symmetry axis and the free edge."""


def finished(scene: Scene) -> Composition:
    """A composition after its last step, for the particles' own values: a frame's are averaged over a cell."""
    composition = compose(scene)
    composition.program.run(composition.steps)
    return composition


def at_times(scene: Scene, times: tuple[float, ...]) -> Iterator[Composition]:
    """A composition at rising times [s]: with the first state at or after each."""
    composition, done = compose(scene.with_(end=times[-1])), 0
    composition.compile()
    for time in times:
        steps = int(np.ceil(time / composition.dt - 1e-9))
        composition.program.run(steps - done)
        composition.publish()
        done = steps
        yield composition


def compression(result: Result) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and compression at the fixed end over the plateau's, of a shock bar's result."""
    probe = result.probes["fixed-end"]
    return probe["time"], -probe["stress_xx"] / oracles.AMPLITUDE


class Band(TypedDict):
    """A shear band: its angle [degrees], its full width at half maximum across it [m], its peak strain and where that is."""

    angle: float
    width: float
    peak: float
    where: np.ndarray


def band(scene: Scene) -> Band:
    """The figures of a scene's shear band."""
    system = finished(scene).bodies[0].system
    position: np.ndarray = system.position
    strain, x, y = system.state.read("internals")[:, 0], position[:, 0], position[:, 1]
    columns = np.unique(np.round(x, 9))
    columns = columns[(columns > BAND_COLUMNS[0] - 1e-9) & (columns < BAND_COLUMNS[1] + 1e-9)]
    crest: list[tuple[float, float]] = []
    widths: list[float] = []
    for column in columns:
        on = np.abs(x - column) < 1e-9
        order = np.argsort(y[on])
        height, value = y[on][order], strain[on][order]
        k, spacing = int(np.argmax(value)), height[1] - height[0]
        if not 0 < k < len(value) - 1:
            continue
        # The vertex of the parabola through the three highest particles.
        before, top, after = value[k - 1 : k + 2]
        shift = 0.5 * (before - after) / (before - 2 * top + after)
        crest.append((column, height[k] + shift * spacing))
        half = 0.5 * (top - 0.25 * (before - after) * shift)
        edges = np.flatnonzero(np.diff(np.sign(value - half)))
        cuts = height[edges] + spacing * (half - value[edges]) / (value[edges + 1] - value[edges])
        if (cuts < height[k]).any() and (cuts > height[k]).any():
            widths.append(cuts[cuts > height[k]].min() - cuts[cuts < height[k]].max())
    line: np.ndarray = np.polyfit([x for x, _ in crest], [y for _, y in crest], 1)
    slope = np.arctan(abs(line[0]))
    peak = int(np.argmax(strain))
    return {
        "angle": float(np.degrees(slope)),
        "width": float(np.mean(widths) * np.cos(slope)) if widths else np.nan,
        "peak": float(strain[peak]),
        "where": position[peak],
    }


def _williams(n: int, r: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """stress_yy of the n-th symmetric term of the crack-tip expansion, per unit coefficient."""
    m = n / 2
    return m * r ** (m - 1) * ((2 - m - (-1) ** n) * np.cos((m - 1) * angle) + (m - 1) * np.cos((m - 3) * angle))


def stress_intensity(
    scene: Scene, tip: tuple[float, float] = (5.0, 0.0), points: int = 4
) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and mode-I stress intensity factor [Pa sqrt(m)] at every step.

    From stress_yy of the first `points` virtual particles ahead of the tip, fitted with the first two terms of Williams'
    expansion that have a stress_yy there (r^-1/2 and r^1/2), weighted by sqrt(r). Crack-opening displacements are of no
    use so near the tip.
    """
    composition = compose(scene)
    system = cast(TwoSetSystem, composition.bodies[0].system)
    offset = system.lattice.cells - np.array(tip)
    ahead = np.flatnonzero((offset[:, 0] > 0.0) & (np.abs(offset[:, 1] - 0.5 * system.spacing) < 1e-6 * system.spacing))
    ahead = ahead[np.argsort(offset[ahead, 0])][:points]
    r, angle = np.hypot(*offset[ahead].T), np.arctan2(offset[ahead, 1], offset[ahead, 0])
    terms: np.ndarray = np.stack([_williams(n, r, angle) for n in (1, 3)], 1) * np.sqrt(r)[:, None]
    fit: np.ndarray = np.linalg.pinv(terms)[0] * np.sqrt(2.0 * np.pi)
    label = system.constitutive.state.labels.index("yy")
    times: list[float] = []
    factors: list[float] = []
    for step in range(1, composition.steps + 1):
        composition.program.run(1)
        stress = system.at_virtual("stress")[ahead, label] * composition.scales.stress
        times.append(step * composition.dt)
        factors.append(float(fit @ (stress * np.sqrt(r))))
    return np.array(times), np.array(factors)


def ligament(composition: Composition) -> tuple[np.ndarray, np.ndarray]:
    """Positions x [m] and sigma_yy over its mean along the first row of stress points above y = 0."""
    system = composition.bodies[0].system
    lattice = system.lattice
    column = lattice.index[lattice.corners].mean(1)[:, 1]
    row = np.flatnonzero(column < column.min() + 0.5)
    row = row[np.argsort(lattice.cells[row, 0])]
    stress = system.state.read("stress")[row, system.constitutive.state.labels.index("yy")]
    width = lattice.cell_volume[row] / lattice.cells[row, 1]
    return lattice.cells[row, 0], stress * width.sum() / (stress @ width)


def frequency(time: np.ndarray, displacement: np.ndarray) -> float:
    """Circular frequency [rad/s] of a vibration from rest, from the first two returns through zero."""
    k = np.flatnonzero(np.diff(np.sign(displacement[1:])))[:2] + 1
    zero = time[k] - displacement[k] * (time[k + 1] - time[k]) / (displacement[k + 1] - displacement[k])
    return float(np.pi / (zero[1] - zero[0]))


def crack_angle(result: Result, tip: tuple[float, float] = (0.05, 0.025), broken: float = 0.95) -> float:
    """Median direction from the notch of Kalthoff's plate to what has broken above it, up to y = 80 mm [degrees]."""
    X, damage = result.particles["position"], result.field("damage")
    r = X[:, :2] - np.array(tip)
    above = (damage > broken) & (r[:, 1] > 4e-3) & (X[:, 1] < 0.08) & (r[:, 0] < 0.045)
    return float(np.degrees(np.median(np.arctan2(r[above, 1], r[above, 0]))))


def first_break(result: Result, probe: str = "first_break", broken: float = 0.95) -> float:
    """The first record of a probe at which the damage is beyond `broken` [s]."""
    record = result.probes[probe]
    return float(record["time"][np.argmax(record["damage"] > broken)])


def crack_offset(result: Result, start: float) -> float:
    """How far the damage-weighted middle of a crack beyond x = start is from y = 0, at most, over slices of 4 mm [m]."""
    X, damage = result.particles["position"], result.field("damage")
    there = (damage > 0.5) & (X[:, 0] > start)
    slices = np.floor((X[:, 0] - start) / 4e-3).astype(int)
    middles = [
        np.average(X[there & (slices == k), 1], weights=damage[there & (slices == k)]) for k in np.unique(slices[there])
    ]
    return float(np.abs(middles).max())
