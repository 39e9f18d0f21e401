"""Scenes whose answer is known in closed form, for coverage.py: bars and bodies with E = rho = 1 whose motion is so small
that it is linear, where nothing else is said.

KNOWN are of the kinds on which the search's constants were chosen; FRESH were written after these were frozen, but the rule
that gravity is no jump was made by the two bars hung up. Scenes that do not converge are in coverage_lost.py,
round bodies in coverage_round.py.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import wsph
from wsph.scene.scene import Scene
from wsph.validation import oracles

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SMALL = 1e-6
"""Of velocities over that of waves, at which what is of second order is below all errors that are measured."""

COARSER = (0.05, 0.02, 0.01)
"""Tolerances of bodies in 2D and 3D."""

Exact = Callable[[np.ndarray], np.ndarray]
"""A column at times (n,) [s]."""


@dataclass(frozen=True)
class Case:
    """A scene and its answer by column "PROBE.COLUMN", or that column's frequency; `kind` is what its figures join, `work`
    the largest of a row of the ladder, `limit` that of a search over it [pair visits]; errors below `floor` are the answer's
    own, or of second order in the velocity."""

    name: str
    kind: str
    scene: Scene
    exact: dict[str, Exact]
    work: float = 1.5e7
    frequency: float | None = None
    tolerances: tuple[float, ...] = COARSER
    floor: float = 1e-5
    limit: float = 4.0


def _elastic(ratio=0.0, **more):
    return {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": ratio} | more


def _scene(
    dim,
    shape,
    spacing,
    *,
    integrator="leapfrog",
    form=None,
    cfl="auto",
    end,
    material=None,
    probes,
    state="stress",
    **more,
):
    """A scene of one body."""
    body = {"name": "b", "shape": shape, "spacing": spacing, "material": material or _elastic()}
    if dim < 3:
        body["state"] = state
    body |= more.pop("body", {})
    for condition in more.get("boundary", []):
        condition["body"] = "b"
    run = {"integrator": integrator, "end": end, "cfl": cfl, "threads": 1, **({"formulation": form} if form else {})}
    return Scene(schema=1, dim=dim, run=run, bodies=[body], probes=probes, output={"history": 10**6}, **more)


def _bar(spacing=0.02, **more):
    return _scene(1, {"type": "box", "min": [0.0], "max": [1.0]}, spacing, **more)


def _probe(place, *fields, name="p"):
    return [{"name": name, "at": [place], "fields": list(fields)}]


def _box(*sides):
    return {"type": "box", "min": [0.0] * len(sides), "max": list(sides)}


FINER = (0.05, 0.02, 0.01, 0.005, 0.002)
"""Tolerances of bars, which are cheap."""


# --- of the kinds that the constants were chosen on ------------------------------------------------------------------


def _shock(name, integrator, form=None, **more):
    scene = wsph.load(EXAMPLES / "shock_bar.toml").with_(
        **{"run.integrator": integrator, "run.formulation": form, "run.cfl": "auto", "run.threads": 1}
    )
    exact = {
        "fixed-end.stress_xx": lambda t: -oracles.elastic(t),
        "middle.velocity_x": lambda t: 1.0 * ((t > 2.5e-3) & (t <= 5e-3)) - 1.0 * ((t > 7.5e-3) & (t <= 10e-3)),
    }
    data = scene.data()
    data["probes"][0]["fields"] = ["stress_xx"]
    data["probes"][1]["fields"] = ["velocity_x"]
    return Case(name, "jumps", Scene(**data), exact, tolerances=FINER, **more)


def _viscoplastic():
    data = wsph.load(EXAMPLES / "viscoplastic_bar.toml").with_(cfl="auto", end=7.4e-3, threads=1).data()
    data["bodies"][0]["material"]["hardening_modulus"] = 0.0
    data["probes"][0]["fields"] = ["stress_xx"]
    exact = {"fixed-end.stress_xx": lambda t: np.where(t > 5e-3, -oracles.viscoplastic(t), 0.0)}
    return Case("viscoplastic bar", "jumps", Scene(**data), exact, tolerances=FINER)


def _vibrating(name, integrator, form=None):
    scene = _bar(
        integrator=integrator, form=form, end=2.5, body={"velocity": [f"{SMALL}*sin(pi*x)"]},
        boundary=[{"face": "-x", "fixed": ["x"]}, {"face": "+x", "fixed": ["x"]}], probes=_probe([0.25], "velocity_x", "stress_xx"),
    )  # fmt: skip
    exact = {
        "p.velocity_x": lambda t: SMALL * math.sin(0.25 * math.pi) * np.cos(np.pi * t),
        "p.stress_xx": lambda t: SMALL * math.cos(0.25 * math.pi) * np.sin(np.pi * t),
    }
    return Case(name, "smooth", scene, exact, tolerances=FINER)


def _magnesium():
    data = wsph.load(EXAMPLES / "magnesium_bar.toml").data()
    data["run"] = {
        "integrator": "leapfrog",
        "formulation": "total-lagrangian",
        "end": 1.2e-4,
        "cfl": "auto",
        "threads": 1,
    }
    data["bodies"][0]["viscosity"] = {"alpha": 0.5, "beta": 0.5}
    data["bodies"][0]["material"]["poisson_ratio"] = 0.0
    c = oracles.MAGNESIUM_SPEED
    v = 8.8436e6 / (1738.0 * c)
    exact = {
        "middle.velocity_x": lambda t: v * (t > 0.5 / c),
        "middle.stress_xx": lambda t: -8.8436e6 * (t > 0.5 / c),
    }
    return Case("step in a magnesium bar", "jumps", Scene(**data), exact, tolerances=(0.1, *FINER))


def _karman(name, integrator, form=None, **body):
    hardening = 1.0 / 3.0
    # Tangent E H/(E + H) = 1/4: plastic waves of half the speed of elastic ones.
    material = {"model": "mises", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.0, "yield_stress": SMALL,
                "hardening_modulus": hardening}  # fmt: skip
    scene = _bar(integrator=integrator, form=form, end=0.9, material=material, body=body,
                 boundary=[{"face": "-x", "velocity": {"x": 2.0 * SMALL}}, {"face": "+x", "fixed": ["x"]}],
                 probes=_probe([0.25], "velocity_x"))  # fmt: skip
    exact = {"p.velocity_x": lambda t: np.where(t > 0.5, 2.0 * SMALL, SMALL * (t > 0.25))}
    return Case(name, "jumps", scene, exact, tolerances=FINER)


def _beam():
    data = wsph.load(EXAMPLES / "oscillating_beam.toml").with_(cfl="auto", end="8 ms", threads=1).data()
    data["probes"][0] |= {"fields": ["displacement_y"], "quantity": "frequency"}
    found = oracles.BEAM_FREQUENCY[0.1] / (2.0 * math.pi)
    return Case("beam in bending", "smooth", Scene(**data), {}, 8e6, found, floor=4e-4)


def _pulse_3d():
    ratio, wave = 0.3, math.sqrt(0.7 / (1.3 * 0.4))
    sides = [{"face": sign + axis, "symmetry": axis} for axis in "yz" for sign in "-+"]
    ends = [{"face": sign + "x", "fixed": ["x"]} for sign in "-+"]
    scene = _scene(3, _box(1.0, 0.25, 0.25), 1.0 / 16, end=0.35 / wave, material=_elastic(ratio),
                   body={"velocity": [f"{SMALL}*exp(-((x-0.5)/0.12)**2)", "0", "0"]}, boundary=[*sides, *ends],
                   probes=_probe([0.75, 0.125, 0.125], "velocity_x"))  # fmt: skip
    shape = lambda x: SMALL * np.exp(-(((x - 0.5) / 0.12) ** 2))  # noqa: E731
    exact = {"p.velocity_x": lambda t: 0.5 * (shape(0.75 - wave * t) + shape(0.75 + wave * t))}
    return Case("pulse in 3D", "smooth", scene, exact, 1e7)


def _rods():
    data = wsph.load(EXAMPLES / "two_rods.toml").data()
    for body, ends in zip(data["bodies"], ((0.0, 0.1), (0.1, 0.3)), strict=True):
        body |= {"shape": {"type": "box", "min": [ends[0], 0.0], "max": [ends[1], 0.02]}, "spacing": 0.005}
    data["run"] |= {"cfl": "auto", "end": 65e-6, "threads": 1}
    data["probes"] = [{"name": "p", "body": "long", "at": [[0.15, 0.01]], "fields": ["velocity_x"]}]
    c = math.sqrt(200e9 / 7850.0)
    exact = {"p.velocity_x": lambda t: 0.5 * ((t > 0.05 / c) & (t < 0.25 / c))}
    return Case("two rods", "jumps", Scene(**data), exact, 2e7, tolerances=(0.1, 0.05, 0.02, 0.01))


# --- written after the constants were frozen ---------------------------------------------------------------------------


def _hanging(name, integrator, form=None):
    scene = _bar(integrator=integrator, form=form, end=3.0, boundary=[{"face": "-x", "fixed": ["x"]}], gravity={"x": SMALL},
                 probes=_probe([1.0], "displacement_x"))  # fmt: skip
    # It falls freely until the wave from the wall is there, and its motion is symmetric about t = 2.
    exact = {"p.displacement_x": lambda t: SMALL * np.where(t < 1.0, 0.5 * t**2, 1.0 - 0.5 * (2.0 - t) ** 2)}
    return Case(name, "jumps", scene, exact, tolerances=FINER)


def _push(name, integrator, form=None):
    """A smooth push on the free end of a held bar."""
    load = lambda t: SMALL * np.sin(np.pi * np.clip(t, 0.0, 0.5) / 0.5) ** 2  # noqa: E731
    sign, key = ("-", {"stress": "xx"}) if integrator == "tsph" else ("", {"traction": "x"})
    ((table, component),) = key.items()
    push = {"face": "-x", table: {component: f"{sign}{SMALL}*sin(2*pi*t)**2*(t<0.5)"}}
    # At Courant number 1 Taylor-SPH has no error.
    cfl = 0.9 if integrator == "tsph" else "auto"
    scene = _bar(integrator=integrator, form=form, cfl=cfl, end=1.8, boundary=[push, {"face": "+x", "fixed": ["x"]}],
                 probes=_probe([1.0], "stress_xx"))  # fmt: skip
    exact = {"p.stress_xx": lambda t: -2.0 * load(t - 1.0)}
    return Case(name, "smooth", scene, exact, tolerances=FINER)


def _struck():
    """A bar that flies into a wall."""
    scene = _bar(integrator="tsph", end=1.8, body={"velocity": [-SMALL]}, boundary=[{"face": "-x", "fixed": ["x"]}],
                 probes=[*_probe([0.5], "velocity_x", name="p"), *_probe([0.0], "stress_xx", name="q")])  # fmt: skip
    exact = {
        "p.velocity_x": lambda t: -SMALL * (t < 0.5) + SMALL * (t > 1.5),
        "q.stress_xx": lambda t: np.full(len(t), -SMALL),
    }
    return Case("bar into a wall", "jumps", scene, exact, tolerances=FINER)


def _lame(dim, spacing, work):
    """The mode of a free square that changes no volume (Lame); in 3D between planes of symmetry."""
    ratio = 0.3
    omega = math.pi * math.sqrt(2.0) * math.sqrt(0.5 / (1.0 + ratio))
    velocity = [f"{SMALL}*cos(pi*x)*sin(pi*y)", f"-{SMALL}*sin(pi*x)*cos(pi*y)", "0"][:dim]
    walls = [{"face": sign + "z", "symmetry": "z"} for sign in "-+"] if dim == 3 else []
    middle = [0.5] * (dim - 2)
    scene = _scene(dim, _box(*[1.0] * dim), spacing, end=5.0, state="strain", material=_elastic(ratio),
                   body={"velocity": velocity}, boundary=walls, probes=_probe([0.5, 0.0, *middle], "velocity_y"))  # fmt: skip
    exact = {"p.velocity_y": lambda t: -SMALL * np.cos(omega * t)}
    return Case(f"free square, {dim}D", "smooth", scene, exact, work)


def _cavity():
    """Pressure waves between four walls that bodies slide along."""
    ratio = 0.3
    omega = math.pi * math.sqrt(2.0) * math.sqrt(0.7 / (1.3 * 0.4))
    velocity = [f"{SMALL}*sin(pi*x)*cos(pi*y)", f"{SMALL}*cos(pi*x)*sin(pi*y)"]
    walls = [{"face": sign + axis, "symmetry": axis} for axis in "xy" for sign in "-+"]
    scene = _scene(2, _box(1.0, 1.0), 1.0 / 12, end=3.0, state="strain", material=_elastic(ratio), body={"velocity": velocity},
                   boundary=walls, probes=_probe([0.5, 0.0], "velocity_x", "stress_xx"))  # fmt: skip
    exact = {
        "p.velocity_x": lambda t: SMALL * np.cos(omega * t),
        "p.stress_xx": lambda t: np.zeros(len(t)),
    }
    data = scene.data()
    data["probes"][0]["fields"] = ["velocity_x"]
    del exact["p.stress_xx"]
    return Case("square between walls", "smooth", Scene(**data), exact, 1e7)


def _pulled():
    """A square pulled at once to a plane wave, in plane stress without a Poisson's ratio: a step of a traction in 2D."""
    scene = _scene(2, _box(1.0, 0.25), 1.0 / 16, end=1.4,
                   boundary=[{"face": "-x", "fixed": ["x"]}, {"face": "+x", "traction": {"x": SMALL}}],
                   probes=_probe([1.0, 0.125], "displacement_x"))  # fmt: skip
    exact = {"p.displacement_x": lambda t: SMALL * t}
    return Case("strip pulled at once", "jumps", scene, exact, 1e7)


KNOWN: list[Callable[[], Case]] = [
    lambda: _shock("shock bar, Taylor-SPH", "tsph"),
    lambda: _shock("shock bar, leapfrog", "leapfrog", "stress-points"),
    _viscoplastic,
    lambda: _vibrating("vibrating bar, Taylor-SPH", "tsph"),
    lambda: _vibrating("vibrating bar, leapfrog", "leapfrog", "stress-points"),
    _magnesium,
    lambda: _karman("plastic bar, Taylor-SPH", "tsph"),
    lambda: _karman("plastic bar, leapfrog", "leapfrog", "total-lagrangian", viscosity={"alpha": 0.5, "beta": 0.5}),
    _beam,
    _pulse_3d,
    _rods,
]
FRESH: list[Callable[[], Case]] = [
    lambda: _hanging("bar hung up, Taylor-SPH", "tsph"),
    lambda: _hanging("bar hung up, leapfrog", "leapfrog", "stress-points"),
    lambda: _push("smooth push, Taylor-SPH", "tsph"),
    lambda: _push("smooth push, leapfrog", "leapfrog", "stress-points"),
    _struck,
    lambda: _lame(2, 1.0 / 12, 8e6),
    lambda: _lame(3, 1.0 / 8, 1e7),
    _cavity,
    _pulled,
]
