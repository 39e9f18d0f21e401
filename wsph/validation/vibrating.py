"""Bodies of cells of no grid that vibrate: frequencies against closed forms and finite elements, nu = 0.3."""

# pyright: strict

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import wsph
from wsph.quantities import Table
from wsph.scene.scene import Scene
from wsph.validation import meshes, oracles
from wsph.validation.case import Row, between, case, example, reported
from wsph.validation.measures import frequency

SPEED = 1e-6
"""Of the vibrations over that of waves, at which what is of second order is below all errors that are measured."""


def _of_energies(body: Table, periods: float, exact: float) -> tuple[int, float]:
    """Particles, and the frequency over the exact one [rad/s], of a free body that starts from rest in the velocities of a
    mode: the kinetic energy less the strain energy swings twice a period."""
    run = {"integrator": "leapfrog", "formulation": "stress-points", "end": periods * 2.0 * np.pi / exact, "cfl": 0.6}
    stiff = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": oracles.RATIO}
    whole: Table = {"name": "b", "material": stiff, **body}
    scene = Scene.model_validate({"schema": 1, "dim": 3, "run": run, "bodies": [whole], "output": {"history": 1}})
    result = wsph.run(scene)
    history = result.history
    gap, time = history["kinetic"] - history["strain"], history["time"]
    k = np.flatnonzero(np.diff(np.sign(gap)))
    zero = time[k] - gap[k] * (time[k + 1] - time[k]) / (gap[k + 1] - gap[k])
    found = 0.5 * np.pi * (len(zero) - 1) / (zero[-1] - zero[0])
    return len(result.particles["position"]), float(found / exact)


def sphere(across: int, surface: str) -> tuple[int, float]:
    """Particles, and the frequency of the breathing mode of a sphere of radius 1 over the exact one."""
    k, omega = oracles.breathing_sphere()
    # The first spherical Bessel function over its slope, as a series: good to 1e-3 at the surface.
    q = f"({k * k!r}*(x*x + y*y + z*z))"
    shape = f"{SPEED}*(1 - {q}/10 + {q}**2/280 - {q}**3/15120)"
    ball: Table = {"type": "sphere", "center": [0.0] * 3, "radius": 1.0}
    velocity = [f"x*{shape}", f"y*{shape}", f"z*{shape}"]
    return _of_energies({"shape": ball, "spacing": 2.0 / across, "surface": surface, "velocity": velocity}, 6.0, omega)


@case("sphere", "the breathing mode of a sphere", "closed form")
def breathing_sphere(full: bool) -> Iterator[Row]:
    asked = {8: 0.9, 12: 0.6, 16: 0.3}
    for across in (8, 12, 16) if full else (8,):
        particles, ratio = sphere(across, "fitted")
        words = f"{across} cells across, {particles} particles: frequency"
        yield between(words, "-", 100.0 * (ratio - 1.0), -asked[across], asked[across])
        if across > 8:  # a staircase so coarse has no such mode
            particles, ratio = sphere(across, "stairs")
            yield reported(
                f"{across} cells across, in stairs, {particles} particles: frequency", "-", 100.0 * (ratio - 1.0)
            )


def torsion(across: int, surface: str, length: float = 4.0) -> tuple[int, float]:
    """Particles, and the first frequency of torsion of a free round bar of radius 0.5 over the exact one."""
    bar: Table = {"type": "cylinder", "from": [0.0] * 3, "to": [0.0, 0.0, length], "radius": 0.5}
    wave = f"{SPEED}*cos({np.pi / length!r}*z)"
    body: Table = {
        "shape": bar,
        "spacing": 1.0 / across,
        "surface": surface,
        "velocity": [f"-y*{wave}", f"x*{wave}", "0"],
    }
    omega = np.pi / length * np.sqrt(0.5 / (1.0 + oracles.RATIO))
    return _of_energies(body, 3.0, float(omega))


@case("torsion", "the first mode of torsion of a round bar", "closed form")
def round_bar(full: bool) -> Iterator[Row]:
    asked = {6: 3.0, 8: 2.0, 12: 1.0}
    for across in (6, 8, 12) if full else (6,):
        for surface, words in (("fitted", ""), ("stairs", ", in stairs")):
            particles, ratio = torsion(across, surface)
            figure, error = f"{across} cells across{words}, {particles} particles: frequency", 100.0 * (ratio - 1.0)
            if surface == "fitted":
                yield between(figure, "-", error, -asked[across], asked[across])
            else:
                yield reported(figure, "-", error)


def plane_mesh(kind: str, rows: int) -> tuple[np.ndarray, Mapping[str, np.ndarray]]:
    """Nodes and cells of a beam of 0.5 x 0.1 with `rows` of moved cells across, which triangles are made of, or
    quadrilaterals of these."""
    nodes, corners = meshes.moved_grid((0.5, 0.1), (5 * rows, rows), 0.25)
    cells = meshes.triangles(corners)
    if kind == "triangles":
        return nodes, {"triangle": cells}
    nodes, quads = meshes.thirds(nodes, cells)
    return nodes, {"quad": quads}


def plane_beam(kind: str, rows: int) -> tuple[int, float]:
    """Particles, and the first frequency of the clamped magnesium beam of height 0.1 m over that of finite elements."""
    nodes, cells = plane_mesh(kind, rows)
    omega = oracles.BEAM_FREQUENCY[0.1]
    data: dict[str, Any] = example("oscillating_beam").with_(end=1.1 * 2.0 * np.pi / omega).data()
    body = data["bodies"][0]
    del body["shape"], body["spacing"]
    return _beam(data, nodes - [0.0, 0.05], cells, omega)


def solid_beam(rows: int) -> tuple[int, float]:
    """The same of a bar of 10 x 1 x 1, clamped, E = rho = 1, of tetrahedra: six of each moved cell."""
    nodes, corners = meshes.moved_grid((10.0, 1.0, 1.0), (10 * rows, rows, rows), 0.15)
    omega = oracles.BLOCK_FREQUENCY
    stiff = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": oracles.RATIO}
    body = {"name": "beam", "velocity": ["0", "1e-5*(x/10)**2*(1.5 - 0.5*x/10)", "0"], "material": stiff}
    run = {"integrator": "leapfrog", "formulation": "stress-points", "end": 1.1 * 2.0 * np.pi / omega, "cfl": 0.9}
    probe = {"name": "tip", "body": "beam", "at": [[10.0, 0.5, 0.5]], "fields": ["displacement"]}
    held = {"body": "beam", "face": "-x", "fixed": ["x", "y", "z"]}
    data: dict[str, Any] = {"schema": 1, "dim": 3, "run": run, "bodies": [body], "boundary": [held], "probes": [probe]}
    return _beam(data, nodes, {"tetra": meshes.tetrahedra(corners)}, omega)


def _beam(data: dict[str, Any], nodes: np.ndarray, cells: Mapping[str, np.ndarray], omega: float) -> tuple[int, float]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "beam.vtu"
        meshes.write(path, nodes, **cells)
        data["bodies"][0]["mesh"] = {"file": str(path)}
        result = wsph.run(Scene.model_validate(data))
    probe = result.probes["tip"]
    return len(nodes), frequency(probe["time"], probe["displacement_y"]) / omega


@case("meshed-beam", "clamped beams from mesh files", "finite elements of second order")
def meshed_beam(full: bool) -> Iterator[Row]:
    for kind, rows in (("triangles", 8), ("quadrilaterals", 4), *((("quadrilaterals", 8),) if full else ())):
        particles, ratio = plane_beam(kind, rows)
        words = f"plane, {kind}, {rows} rows of what they are made of, {particles} particles: frequency"
        yield between(words, "-", 100.0 * (ratio - 1.0), -1.0, 1.0)
    for rows in (3, 4) if full else (3,):
        particles, ratio = solid_beam(rows)
        words = f"10 x 1 x 1, tetrahedra, {rows} rows of what they are made of, {particles} particles: frequency"
        yield between(words, "-", 100.0 * (ratio - 1.0), -1.0, 1.0)


CASES = (breathing_sphere, round_bar, meshed_beam)
