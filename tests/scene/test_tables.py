"""Tables: every key of a scene that has all parts, missing, misspelt and with odd values, is taken or named."""

import copy
import tomllib

import pytest

import wsph
from wsph.errors import SceneError
from wsph.scene import tables

RICH = tomllib.loads("""
schema = 1
dim = 2
title = "all parts"
[run]
integrator = { name = "rkc", stages = 4 }
formulation = "total-lagrangian"
cfl = 0.2
support = 2.6
seed = 3
correction = "symmetric"
kernel = "cubic-spline"
precision = "f32"
guard = "warn"
threads = 2
device = "cpu"
[[bodies]]
name = "a"
shape = { type = "difference", shapes = [ { type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }, { type = "disc", center = [0.5, 0.5], radius = 0.2 } ] }
spacing = 0.05
state = "strain"
velocity = ["x", 0.0]
jitter = 0.1
placement = "cells"
surface = "stairs"
residual = { coefficient = 0.5 }
lattice_rotate = 5.0
material = { model = "mises", density = 7800.0, youngs_modulus = "200 GPa", poisson_ratio = 0.3, yield_stress = "300 MPa", hardening_modulus = 1e9 }
viscosity = { alpha = 1.0, beta = 1.0, kind = "pair" }
hourglass = { coefficient = 0.1 }
artificial_stress = { epsilon = 0.3, exponent = 4.0 }
damping = { rate = 10.0 }
body_force = { x = "1 MN/m3", y = "x", where = "x > 0.5" }
[bodies.links]
criterion = "stretch"
threshold = 0.02
[[bodies]]
name = "b"
shape = { type = "polygon", points = [[2.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0]] }
spacing = 0.1
state = "strain"
material = { model = "jaumann", density = 7800.0, youngs_modulus = "200 GPa", poisson_ratio = 0.3 }
phase_field = { fracture_energy = 2e4, length = 0.2, model = "AT2" }
cracks = [ { from = [2.0, 0.5], to = [2.5, 0.5] } ]
[[bodies]]
name = "c"
shape = { type = "box", min = [4.0, 0.0], max = [5.0, 1.0] }
spacing = 0.1
state = "stress"
map = ["x + 0.1*y", "y"]
initial = { stress = { xx = "1 MPa", xy = "1e5*y" }, file = "before.npz" }
material = { model = "elastic", density = 7800.0, youngs_modulus = "200 GPa", poisson_ratio = 0.3 }
[[bodies]]
name = "d"
mesh = { file = "part.msh", scale = "1 mm", part = "steel" }
state = "stress"
material = { model = "elastic", density = 7800.0, youngs_modulus = "200 GPa", poisson_ratio = 0.3 }
[[bodies]]
name = "e"
points = { file = "particles.csv", scale = "1 mm" }
state = "stress"
material = { model = "elastic", density = 7800.0, youngs_modulus = "200 GPa", poisson_ratio = 0.3 }
[functions.ramp]
t = [0.0, 1e-3]
value = [0.0, 1.0]
[[boundary]]
name = "driven"
body = "a"
face = "-x"
velocity = { x = "ramp" }
[[boundary]]
body = "b"
where = "x > 2.9"
traction = { x = "1 MPa" }
steps = ["impact"]
[[boundary]]
body = "d"
patch = "hole"
traction = { x = "1 MPa" }
[[boundary]]
body = "d"
face = "+x"
pressure = "1 MPa"
spring = { stiffness = 1e9, damping = { normal = "1 kPa s/m", tangential = 2.0 } }
[[boundary]]
body = "e"
where = "x > 1"
displacement = { x = "0.1*t" }
acceleration = { y = "ramp" }
[[boundary]]
body = "c"
face = "+y"
quiet = true
[[contact]]
name = "ball-plate"
between = ["a", "b"]
law = "surface"
stiffness = "auto"
friction = 0.1
damping = 1.0
memory = 20
[[contact]]
self = "c"
law = "pinball"
stiffness = 1.0
radius = 0.5
[[contact]]
between = ["a", "d"]
law = "tie"
stiffness = 4.0
strength = "30 MPa"
[[tools]]
name = "punch"
shape = { type = "disc", center = [0.5, 2.0], radius = 0.5 }
velocity = { y = "ramp" }
turn = { about = [0.5, 2.0], rate = 1.0 }
against = ["a"]
friction = 0.1
stiffness = "auto"
damping = 1.0
memory = 20
[[tools]]
name = "hammer"
shape = { type = "box", from = [0.0, 3.0], to = [1.0, 4.0], rotate = 10.0 }
inside = false
mass = 2.0
inertia = 1.0
velocity = [0.0, -1.0]
spin = 0.5
against = ["a", "punch"]
[gravity]
y = -9.81
[[sections]]
name = "cut"
body = "a"
point = ["10 cm", 0.1]
normal = [1.0, 0.0]
[[probes]]
name = "p"
at = [[0.1, 0.1]]
fields = ["velocity"]
every = 2
[[probes]]
name = "q"
of = "cut"
fields = ["force", "torque"]
tolerance = false
quantity = "peak"
scale = 1e-3
[accuracy]
tolerance = "1%"
quantity = "history"
sure = true
budget = "30 s"
free = ["spacing", "integrator"]
[fields]
speed = { expression = "sqrt(velocity_x^2 + velocity_y^2)", unit = "m/s" }
[output]
every = "0.1 ms"
history = 5
formats = ["vtu"]
fields = ["velocity"]
[checkpoint]
every = 50
keep = 2
final = true
[relax]
until = 1e-6
max_steps = 1000
[[steps]]
name = "preload"
duration = "1 ms"
[[steps]]
name = "impact"
duration = "1 ms"
relax = { until = 1e-4 }
[stop]
energy = 0.1
""")


def leaves(data: object, path: tuple = ()) -> list[tuple]:
    """Paths of everything in a scene that is not a table or a list."""
    if isinstance(data, dict):
        return [p for key, value in data.items() for p in leaves(value, (*path, key))]
    if isinstance(data, list):
        return [p for k, value in enumerate(data) for p in leaves(value, (*path, k))]
    return [path]


def changed_at(path: tuple, value: object, name: str | None = None) -> dict:
    """RICH with another value at a path, or under another name, or without it."""
    data = copy.deepcopy(RICH)
    place = data
    for key in path[:-1]:
        place = place[key]
    old = place.pop(path[-1]) if isinstance(place, dict) else place[path[-1]]
    if name is not None:
        place[name] = old
    elif value is not None:
        place[path[-1]] = value
    return data


ODD = [True, "text", "1 parsec", "", -1, 0, -0.0, 1e308, 10**400, float("nan"), float("inf"), [], [1.0], {}, {"a": 1}]


def test_the_rich_scene_is_one_and_leaves_out_no_key() -> None:
    """Of its tables and of those of runs and bodies: but dt, which cfl stands for, and end, which steps do."""
    wsph.Scene(**copy.deepcopy(RICH))
    assert set(RICH) == {field.alias or name for name, field in wsph.Scene.model_fields.items()}
    assert set(RICH["run"]) == set(tables.Run.model_fields) - {"dt", "end"}
    assert {key for body in RICH["bodies"] for key in body} == set(tables.Body.model_fields)


def taken_or_named(data: dict) -> bool:
    """Whether it is a scene, or every fault of it names a key."""
    try:
        wsph.Scene(**data)
    except SceneError as error:
        return all(fault.key for fault in error.faults)
    return True


@pytest.mark.parametrize("path", leaves(RICH), ids=lambda p: ".".join(map(str, p)))
def test_every_key_missing_misspelt_and_with_odd_values_is_taken_or_named(path: tuple) -> None:
    for value in ODD:
        assert taken_or_named(changed_at(path, value)), value
    if isinstance(path[-1], str):
        assert taken_or_named(changed_at(path, None))
        with pytest.raises(
            SceneError, match=r"unknown key|is none of|is no|no entry|as an identifier|needs|is missing|exactly one"
        ):
            wsph.Scene(**changed_at(path, None, f"{path[-1]}x"))
