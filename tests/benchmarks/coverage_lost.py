"""Scenes that do not converge with the spacing, for coverage.py: there is no answer, and the search is to say so.

Softening without a length, virtual links along the lattice, and blocks that are thrown about in a room, where every rebound
from a corner or from the round pillar in the middle (Sinai 1970) multiplies what the one before it had of errors.
"""

import math
from collections.abc import Callable

from coverage_scenes import Case, _bar, _box, _elastic, _probe, _scene


def _softening(name="", hardening=-0.1, pull=0.6e-3):
    """A bar that softens, pulled at both ends: where the waves meet it breaks within one cell (Bazant & Belytschko 1985)."""
    material = _elastic() | {"model": "mises", "yield_stress": 1e-3, "hardening_modulus": hardening}
    boundary = [{"face": sign + "x", "velocity": {"x": f"{sign}{pull}"}} for sign in "-+"]
    scene = _bar(1.0 / 40, form="total-lagrangian", end=0.9, material=material, boundary=boundary,
                 probes=_probe([0.5], "plastic_strain"))  # fmt: skip
    return Case(f"softening without a length{name}", "lost", scene, {}, 2e7, tolerances=(0.01,))


def _links(name="", rate=0.02):
    """A strip with a notch, pulled ever faster: its virtual links break at a stretch whatever the spacing, along the
    lattice, so that how much of it has broken is another on each."""
    pull = [{"face": sign + "x", "velocity": {"x": f"{sign}{rate}*t"}} for sign in "-+"]
    body = {
        "links": {"criterion": "stretch", "threshold": 0.01, "where": "abs(x-0.5) < 0.2"},
        "cracks": [{"from": [0.5, 0.0], "to": [0.5, 0.125]}],
        "viscosity": {"alpha": 0.5, "beta": 0.5},
    }
    probe = {"name": "p", "body": "b", "where": "abs(x-0.5) < 0.2", "reduce": "mean", "fields": ["damage"]}
    scene = _scene(2, _box(1.0, 0.25), 1.0 / 32, form="total-lagrangian", cfl=0.15, end=2.0, material=_elastic(0.3) | {"model": "jaumann"},
                   state="strain", body=body, boundary=pull, probes=[probe])  # fmt: skip
    return Case(f"virtual links{name}", "lost", scene, {}, 3e7, tolerances=(0.05,))


def _thrown(angle, spin, speed=0.2, end=30.0):
    """A block of rubber, thrown at an angle [degrees] into a room with a pillar, without friction or gravity: where it is,
    over some ten rebounds."""
    room = {"name": "room", "shape": {"type": "box", "from": [0.0, 0.0], "to": [2.0, 2.0]}, "inside": True}
    pillar = {"name": "pillar", "shape": {"type": "disc", "center": [1.0, 1.0], "radius": 0.45}}
    tools = [each | {"against": ["b"], "stiffness": 0.1} for each in (room, pillar)]
    way = [speed * math.cos(math.radians(angle)), speed * math.sin(math.radians(angle))]
    velocity = [f"{way[0]:.9g}-{spin}*(y-0.3)", f"{way[1]:.9g}+{spin}*(x-0.3)"]
    shape = {"type": "box", "min": [0.05, 0.05], "max": [0.55, 0.55]}
    scene = _scene(2, shape, 0.5 / 8, form="stress-points", end=end, state="strain", material=_elastic(0.3) | {"model": "neo-hookean"},
                   body={"velocity": velocity}, tools=tools, probes=_probe([0.3, 0.3], "displacement_x"))  # fmt: skip
    return Case(f"thrown at {angle:g} degrees, spin {spin:g}", "lost", scene, {}, 2e7, tolerances=(0.05,), limit=1.0)


SOFTENING: list[Callable[[], Case]] = [
    _softening,
    lambda: _softening(", half as steep", hardening=-0.05),
    lambda: _softening(", twice as steep", hardening=-0.2),
    lambda: _softening(", pulled faster", pull=0.8e-3),
]
LINKS: list[Callable[[], Case]] = [
    _links,
    *(
        lambda rate=rate: _links(f", pulled at {rate:g} t", rate)
        for rate in (0.01, 0.0125, 0.015, 0.025, 0.03, 0.035, 0.04, 0.05, 0.06)
    ),
]
THROWS: list[Callable[[], Case]] = [
    lambda angle=angle, spin=spin: _thrown(angle, spin)
    for angle, spin in ((25.0, 0.2), (40.0, 0.2), (55.0, -0.2), (70.0, 0.1), (15.0, 0.3), (80.0, -0.3))
]
LOST = [*SOFTENING, *LINKS, *THROWS]
