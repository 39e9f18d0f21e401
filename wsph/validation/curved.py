"""Bodies with curved surfaces at rest: stress and displacement against closed forms, plane stress, nu = 0.3.

Fitted surfaces, and beside them the same bodies in steps of a cell. Motion is damped until what is left is the static
solution: the rates are near critical for the slowest mode of each.
"""

# pyright: strict

from collections.abc import Iterator
from typing import Any

import numpy as np

from wsph.formulations.system import System
from wsph.quantities import Table
from wsph.scene.scene import Scene
from wsph.validation import oracles
from wsph.validation.case import Row, at_most, between, case, reported
from wsph.validation.measures import finished

STIFF: Table = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": oracles.RATIO}
"""Units of the body: E = rho = 1."""

SMALL = 1e-6
"""Load over Young's modulus, at which what is of second order is below all errors that are measured."""


def _scene(end: float, body: Table, boundary: list[Any], cfl: float = 0.8) -> Scene:
    run = {"integrator": "leapfrog", "formulation": "stress-points", "end": end, "cfl": cfl}
    whole: Table = {"name": "b", "material": STIFF, "state": "stress", **body}
    return Scene.model_validate({"schema": 1, "dim": 2, "run": run, "bodies": [whole], "boundary": boundary})


def _stress(system: System) -> np.ndarray:
    """Cauchy stress xx, yy, xy at the points of a plane body [Pa], (m, 3)."""
    labels = system.constitutive.state.labels
    stress = system.state.read("stress") * system.scales.stress
    return stress[:, [labels.index(name) for name in ("xx", "yy", "xy")]]


def _apart(system: System, found: np.ndarray, exact: np.ndarray, where: np.ndarray | None = None) -> float:
    """L2 of a stress less an exact one (m, 3) over the volume, over that of the exact one, of the points `where`."""
    volume = system.geometry.cell_volume * (1.0 if where is None else where)
    shear_twice = np.array([1.0, 1.0, 2.0])
    gap, whole = ((each**2 @ shear_twice) @ volume for each in (found - exact, exact))
    return float(np.sqrt(gap / whole))


def ring(across: int, surface: str) -> tuple[int, float, float]:
    """Particles, displacement of the bore over the exact one, and L2 of the stress, of a ring with radii 0.5 and 1 and
    `across` cells along its diameter, under a pressure inside."""
    shape = {"type": "difference", "shapes": [
        {"type": "disc", "center": [0.0, 0.0], "radius": 1.0},
        {"type": "disc", "name": "bore", "center": [0.0, 0.0], "radius": 0.5}]}  # fmt: skip
    spacing = 2.0 / across
    body: Table = {"shape": shape, "spacing": spacing, "surface": surface, "damping": {"rate": 2.0}}
    inside: Table = {"patch": "bore"} if surface == "fitted" else {"where": "x*x + y*y < 0.5"}
    system = finished(_scene(12.0, body, [{"body": "b", "pressure": SMALL, **inside}])).bodies[0].system
    place = system.geometry.nodes
    r = np.hypot(*place.T)
    outward = (place * system.state.read("displacement")).sum(1) / r * system.scales.length
    bore = r < (0.5 * (1.0 + 1e-9) if surface == "fitted" else 0.5 + 0.6 * spacing)
    ratio = float((outward[bore] / oracles.ring_displacement(r[bore], SMALL)).mean())
    exact = oracles.ring_stress(system.geometry.cells, SMALL)
    return system.count, ratio, _apart(system, _stress(system), exact)


@case("ring", "a ring under a pressure inside", "Lame's closed form")
def ring_under_pressure(full: bool) -> Iterator[Row]:
    asked = {20: (0.5, 0.015), 40: (0.2, 0.006), 80: (0.1, 0.003)}
    for across in (20, 40, 80) if full else (20, 40):
        particles, ratio, stress = ring(across, "fitted")
        most, far = asked[across]
        words = f"{across} cells across, {particles} particles"
        yield between(f"{words}: displacement of the bore", "-", 100.0 * (ratio - 1.0), -most, most)
        yield at_most(f"{words}: L2 of the stress", "-", stress, far, "")
        particles, ratio, stress = ring(across, "stairs")
        words = f"{across} cells across, in stairs, {particles} particles"
        yield reported(f"{words}: displacement of the bore", "-", 100.0 * (ratio - 1.0))
        yield reported(f"{words}: L2 of the stress", "-", stress, "")


def _tractions() -> list[Table]:
    """Kirsch's tractions on the outer faces of the quarter of a plate from 0 to 4."""
    square = "(x*x + y*y)"
    # Cosines and sines of twice and of four times the angle about the hole.
    c2, s2 = f"((x*x - y*y)/{square})", f"(2*x*y/{square})"
    c4, s4 = f"(2*{c2}**2 - 1)", f"(2*{s2}*{c2})"
    a, b = f"(1/{square})", f"(1.5/{square}**2)"
    xx = f"{SMALL}*(1 - {a}*(1.5*{c2} + {c4}) + {b}*{c4})"
    yy = f"{SMALL}*(0 - {a}*(0.5*{c2} - {c4}) - {b}*{c4})"
    xy = f"{SMALL}*(0 - {a}*(0.5*{s2} + {s4}) + {b}*{s4})"
    return [
        {"body": "b", "face": "+x", "traction": {"x": xx, "y": xy}},
        {"body": "b", "face": "+y", "traction": {"x": xy, "y": yy}},
        {"body": "b", "face": "-x", "symmetry": "x"},
        {"body": "b", "face": "-y", "symmetry": "y"},
    ]


def kirsch(cells: int, surface: str) -> tuple[int, float, float]:
    """Particles, the largest stress at the hole over the one far away, and L2 of the stress within two radii of its middle,
    of a plate of 8 x 8 with a hole of radius 1 and `cells` a radius."""
    shape = {"type": "difference", "shapes": [
        {"type": "box", "min": [0.0, 0.0], "max": [4.0, 4.0]},
        {"type": "disc", "name": "hole", "center": [0.0, 0.0], "radius": 1.0}]}  # fmt: skip
    body: Table = {"shape": shape, "spacing": 1.0 / cells, "surface": surface, "damping": {"rate": 0.6}}
    system = finished(_scene(70.0, body, _tractions())).bodies[0].system
    place, found = system.geometry.cells, _stress(system)
    r = np.hypot(*place.T)
    # The two points that are nearest to the hole, of the row beside the axis across the load.
    beside = np.flatnonzero(place[:, 0] < 0.75 / cells)
    beside = beside[np.argsort(r[beside])[:2]]
    gap, stress = r[beside] - 1.0, found[beside, 0]
    peak = float((stress[0] * gap[1] - stress[1] * gap[0]) / (gap[1] - gap[0]))
    return system.count, peak / SMALL, _apart(system, found, oracles.kirsch_stress(place, SMALL), r < 2.0)


@case("kirsch", "a plate with a hole, pulled", "Kirsch's closed form, with its tractions on the outer faces")
def plate_with_hole(full: bool) -> Iterator[Row]:
    asked = {4: (2.6, 0.02), 8: (2.85, 0.006), 16: (2.94, 0.003)}
    for cells in (4, 8, 16) if full else (4, 8):
        particles, peak, stress = kirsch(cells, "fitted")
        words = f"{cells} cells a radius, {particles} particles"
        least, far = asked[cells]
        yield between(f"{words}: largest stress at the hole", "3", peak, least, 3.1, "")
        yield at_most(f"{words}: L2 of the stress within two radii", "-", stress, far, "")
        particles, peak, stress = kirsch(cells, "stairs")
        words = f"{cells} cells a radius, in stairs, {particles} particles"
        yield reported(f"{words}: largest stress at the hole", "3", peak, "")
        yield reported(f"{words}: L2 of the stress within two radii", "-", stress, "")


def disc(across: int, surface: str) -> tuple[int, float, float]:
    """Particles, displacement of the rim over the exact one, and L2 of the stress, of a disc with radius 1 that spins.

    The viscosity of the points, which falls with the spacing, damps what changes the shape and no spin; at the end the disc
    has turned by a few tenths of a radian.
    """
    speed = SMALL**0.5
    shape = {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}
    body: Table = {"shape": shape, "spacing": 2.0 / across, "surface": surface, "viscosity": {"alpha": 1.0, "kind": "pair"},
                   "velocity": [f"{-speed}*y", f"{speed}*x"]}  # fmt: skip
    end = 7.5 * across
    system = finished(_scene(end, body, [], cfl=0.4)).bodies[0].system
    place = system.geometry.nodes
    c, s = np.cos(speed * end), np.sin(speed * end)
    turn = np.array([[c, -s], [s, c]])
    # Displacement and stress along axes that turn with the disc.
    back = (place + system.state.read("displacement") * system.scales.length) @ turn
    rim = np.hypot(*place.T) > 1.0 - (1e-9 if surface == "fitted" else 0.6 * 2.0 / across)
    r = np.hypot(*place[rim].T)
    outward = ((back - place) * place)[rim].sum(1) / r
    ratio = float((outward / oracles.disc_displacement(r, speed)).mean())
    xx, yy, xy = _stress(system).T
    turned = turn.T @ np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1) @ turn
    found = np.stack([turned[:, 0, 0], turned[:, 1, 1], turned[:, 0, 1]], 1)
    return system.count, ratio, _apart(system, found, oracles.disc_stress(system.geometry.cells, speed))


@case("spinning-disc", "a disc that spins", "closed form")
def spinning_disc(full: bool) -> Iterator[Row]:
    asked = {16: 0.006, 32: 0.002}
    for across in (16, 32) if full else (16,):
        particles, rim, stress = disc(across, "fitted")
        words = f"{across} cells across, {particles} particles"
        yield between(f"{words}: displacement of the rim", "-", 100.0 * (rim - 1.0), -1.0, 1.0)
        yield at_most(f"{words}: L2 of the stress", "-", stress, asked[across], "")
        particles, rim, stress = disc(across, "stairs")
        words = f"{across} cells across, in stairs, {particles} particles"
        yield reported(f"{words}: displacement of the rim", "-", 100.0 * (rim - 1.0))
        yield reported(f"{words}: L2 of the stress", "-", stress, "")


CASES = (ring_under_pressure, plate_with_hole, spinning_disc)
