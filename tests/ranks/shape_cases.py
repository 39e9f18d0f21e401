"""Bodies that no grid has cut, which processes share: fitted surfaces, meshes, and points from files.

    mpiexec -n 4 python -m tests.ranks.shape_cases CASE...

As `tests.ranks.shared_cases`, which says what is printed.
"""

from pathlib import Path

import numpy as np

import wsph
from tests.ranks.case_runs import begin
from tests.ranks.shared_cases import CRACKING, MISES, PERIODIC, SWAYING, UPDATED, VISCOUS, scene
from wsph.validation import meshes

NAMES = ("quads.vtu", "triangles.vtu", "mixed.vtu", "hexahedra.vtu", "tetrahedra.vtu", "flat.csv", "solid.csv")


def write_files(folder: Path) -> None:
    """Meshes of boxes, 90 by 50 and 24 by 15 by 15, whose nodes are moved at random, and points of such grids."""
    plane, corners = meshes.moved_grid((90.0, 50.0), (90, 50), 0.2)
    left = plane[corners].mean(1)[:, 0] < 31.0
    triangles = meshes.triangles(corners)
    meshes.write(folder / NAMES[0], plane, quad=meshes.around(corners))
    meshes.write(folder / NAMES[1], plane, triangle=triangles)
    half = {"quad": meshes.around(corners[left]), "triangle": meshes.triangles(corners[~left])}
    meshes.write(folder / NAMES[2], plane, **half)
    solid, cells = meshes.moved_grid((24.0, 15.0, 15.0), (24, 15, 15), 0.2)
    meshes.write(folder / NAMES[3], solid, hexahedron=meshes.around(cells))
    meshes.write(folder / NAMES[4], solid, tetra=meshes.tetrahedra(cells))
    for name, places in zip(NAMES[5:], (plane, solid), strict=True):
        volume = np.random.default_rng(2).uniform(0.9, 1.1, len(places))
        rows = np.concatenate([places, volume[:, None]], 1)[np.random.default_rng(3).permutation(len(places))]
        head = ",".join([*"xyz"[: places.shape[1]], "volume"])
        np.savetxt(folder / name, rows, delimiter=",", header=head, comments="", fmt="%.17g")


def of_mesh(name: str, dim: int = 2, **changes: object) -> wsph.Scene:
    """The usual scene of the body of a mesh file."""
    of = {"shape": None, "spacing": None, "mesh": {"file": str(Path(name).absolute())}}
    return scene(dim, body=of | changes.pop("body", {}), **changes)  # type: ignore[operator]


def of_points(name: str, dim: int = 2, form: str = "total-lagrangian", **changes: object) -> wsph.Scene:
    """A body of points that is held at one end and pulled inside, where points have no faces."""
    of = {"shape": {"type": "points", "file": str(Path(name).absolute())}, "spacing": None}
    of |= {"body_force": [{"where": "x > 15", "y": "1e-5*min(t, 1)"}]}
    made = scene(dim, form=form, body=of | changes.pop("body", {}), **changes)  # type: ignore[operator]
    root = {"name": "root", "body": "b", "where": "x < 0.6", "fixed": list("xyz"[:dim])}
    return made.with_(boundary=[root])


HOLES = [{"type": "disc", "name": "hole", "center": [50.0, 30.0], "radius": 14.0}]
PLATE = {"shape": {"type": "difference", "shapes": [{"type": "box", "min": [0.0, 0.0], "max": [100.0, 60.0]}, *HOLES]}}
FIRST = {"type": "disc", "name": "hole", "center": [12.0, 30.0], "radius": 6.0}
AT_ONE_END = {
    "shape": {"type": "difference", "shapes": [{"type": "box", "min": [0.0, 0.0], "max": [140.0, 60.0]}, FIRST]}
}
"""A hole that the parts of some processes have nothing of."""

BAR = {"shape": {"type": "cylinder", "from": [0.0, 7.5, 7.5], "to": [30.0, 7.5, 7.5], "radius": 7.0}}
BALL = {"shape": {"type": "sphere", "center": [12.0, 7.5, 7.5], "radius": 12.0}}
PRESSED = [{"name": "hole", "body": "b", "patch": "hole", "pressure": "1e-3*min(t, 1)"}]
ON_HOLE = [
    *PRESSED,
    {"name": "slide", "body": "b", "face": "-y", "normal": 0.0},
    {"name": "held", "body": "b", "face": "+y", "spring": {"stiffness": 0.02, "damping": {"normal": 0.1}}},
]
CUT = {"name": "cut", "body": "b", "point": [50.0, 0.0], "normal": [1.0, 0.2]}
RATE = {"integrator": "rk4", "precision": "f32"}
LINED = {"stress": {"xx": "2e-6*x", "xy": 1e-4}}
COMING = {"shape": {"type": "disc", "center": [50.0, 95.2], "radius": 35.0}, "velocity": ["0.0", "-0.2"]}

CREEPS = {"yield_stress": 1e-3, "hardening_modulus": 0.1, "fluidity": 0.004, "exponent": 1.0}
BESIDE = ("c", [2.5, 50.0], [72.5, 115.0], {"mesh": None, "spacing": 1.0, "velocity": ["2e-3*y", "-0.1"]})
ABOVE = ("c", [2.5, 51.0], [72.5, 116.0], {"spacing": 1.0, "velocity": ["2e-3*y", "-0.5"], "body_force": []})
BALLS = [{"name": "touch", "between": ["b", "c"], "law": "pinball", "friction": 0.2}]
LINKS = {"links": {"criterion": "stretch", "threshold": 0.03}, "velocity": ["0.0", "0.02*tanh(y - 25.5)"]}
TEARING = {"phase_field": CRACKING, "velocity": ["0.0", "0.02*tanh(y - 25.5)"]}
DIE = {
    "name": "die",
    "shape": {"type": "disc", "center": [95.1, 20.0], "radius": 5.0},
    "velocity": {"x": "-0.3"},
    "against": ["b"],
    "friction": 0.2,
}

CASES = {
    "fitted": lambda: scene(**MISES, body=PLATE | VISCOUS, boundary=PRESSED),
    "fitted, rates": lambda: scene(law="jaumann", body=PLATE, boundary=ON_HOLE, sections=[CUT], run=RATE),
    "fitted at one end": lambda: scene(**MISES, body=AT_ONE_END | {"initial": LINED}, boundary=PRESSED),
    "fitted bar": lambda: scene(3, **MISES, body=BAR | {"viscosity": {"alpha": 0.1}}, run={"precision": "f32"}),
    "fitted ball": lambda: scene(3, law="neo-hookean", body=BALL).with_(boundary=[], probes=[]),
    "fitted, relaxed": lambda: scene(
        body=PLATE | {"body_force": [{"where": "y > 20", "y": "-1e-5"}]},
        relax={"until": 0.7, "max_steps": 5000},
        run={"dt": 0.3},
        checkpoint={"every": 40},
    ),
    "fitted contact": lambda: scene(
        body=PLATE, more=[("c", [], [], COMING)], contact=[{"name": "touch", "between": ["b", "c"], "friction": 0.3}]
    ),
    "quads": lambda: of_mesh("quads.vtu", body=VISCOUS, **MISES, run={"dt": None, "cfl": "auto"}),
    "triangles": lambda: of_mesh("triangles.vtu", law="jaumann", body=VISCOUS, run=RATE),
    "mixed": lambda: of_mesh("mixed.vtu", **MISES, boundary=ON_HOLE[1:], sections=[CUT]),
    "periodic": lambda: of_mesh("quads.vtu", boundary=[PERIODIC]),
    "round": lambda: of_mesh("quads.vtu", body={"velocity": ["0.02*sin(x)", "0.01*cos(y)"]}).with_(
        boundary=[{"body": "b", "face": "-x", "periodic": "+x"}, PERIODIC], probes=[]
    ),
    "fitted, periodic": lambda: scene(body=PLATE, boundary=[PERIODIC]),
    "hexahedra": lambda: of_mesh("hexahedra.vtu", 3, law="perzyna", material=CREEPS, run={"precision": "f32"}),
    "tetrahedra": lambda: of_mesh("tetrahedra.vtu", 3, body={"viscosity": {"alpha": 0.1}}),
    "points": lambda: of_points(
        "flat.csv", body={"viscosity": {"alpha": 0.5}, "hourglass": {"coefficient": 0.1}}, gravity={"y": -1e-4}
    ),
    "points of links": lambda: of_points(
        "flat.csv", law="jaumann", body=LINKS, more=[ABOVE], contact=BALLS, run={"dt": 0.1}
    ),
    "fitted, breaking": lambda: scene(body=PLATE | TEARING),
    "breaking": lambda: of_mesh("quads.vtu", law="jaumann", body=TEARING),
    "breaking, touched": lambda: of_mesh(
        "mixed.vtu",
        body=TEARING | {"velocity": ["0.0", "0.08*tanh(y - 25.5)"]},
        more=[BESIDE],
        contact=[{"between": ["b", "c"], "friction": 0.3}, {"self": "b"}],
        tools=[DIE],
        run={"end": 7.2},
    ),
    "tied": lambda: of_mesh("quads.vtu", more=[BESIDE], contact=[{"between": ["b", "c"], "law": "tie"}], tools=[DIE]),
    "moving points": lambda: of_points("flat.csv", form=UPDATED, body=SWAYING | VISCOUS),
    "points, rates": lambda: of_points("solid.csv", 3, law="jaumann", run={"precision": "f32", "support": 2.0}),
}
"""Of every kind of cells and of form, law and dimension some, with what crosses the cuts."""

if __name__ == "__main__":
    begin(CASES, write_files)
