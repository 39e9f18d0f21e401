"""Bodies of cells that are alike and that differ, and the forces of a displacement on their particles."""

import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import wsph
from tests import scenes
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.validation import meshes

STAIRS = {"type": "polygon", "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}
NOTCHED = {"type": "difference", "shapes": [scenes.box(1.0, 1.0), scenes.box((0.4, 0.6), (0.4, 1.0))]}
TURNED = {**scenes.box(1.0, 0.6), "rotate": 30.0}
BALL = {"type": "sphere", "center": [0.5] * 3, "radius": 0.5}
PIPE = {"type": "difference", "shapes": [
    {"type": "cylinder", "from": [0.5, 0.5, 0.0], "to": [0.5, 0.5, 0.6], "radius": 0.5},
    {"type": "cylinder", "from": [0.5, 0.5, 0.0], "to": [0.5, 0.5, 0.6], "radius": 0.25}]}  # fmt: skip
BODIES = {
    "bar": (scenes.box(1.0), 0.1),
    "square": (scenes.box(1.0, 1.0), 0.1),
    "flat cells": (scenes.box(1.0, 1.0), [0.1, 0.05]),
    "one row": (scenes.box(1.0, 0.1), 0.1),
    "notched": (NOTCHED, 0.1),
    "stairs": (STAIRS, 0.1),
    "turned": (TURNED, 0.1),
    "cube": (scenes.cube(3), 0.25),
    "ball": (BALL, 0.125),
    "pipe": (PIPE, 0.1),
}
IRREGULAR = {
    "jittered square": (scenes.box(1.0, 1.0), {"jitter": 0.3, "seed": 2}),
    "jittered notch": (NOTCHED, {"jitter": 0.3, "seed": 3}),
    "jittered cube": (scenes.cube(3), {"jitter": 0.25, "seed": 4}),
    "quarter of a ring": (scenes.box((1.0, 2.0), (0.0, 1.5)), {"map": ["x*cos(y)", "x*sin(y)"]}),
    "bent bar": (scenes.box(1.0, 0.4, 0.4), {"map": ["x", "y + 0.3*x*x", "z*(1 + 0.5*x) + 0.2*x*y"]}),
}

FITTED = {
    "fitted disc": ({"type": "disc", "center": [0.5, 0.5], "radius": 0.5}, 0.1),
    "fitted wedge": (STAIRS, 0.1),
    "fitted ball": (BALL, 0.125),
    "fitted pipe": (
        {
            "type": "difference",
            "shapes": [
                {"type": "cylinder", "from": [0.5, 0.5, 0.0], "to": [0.5, 0.5, 0.3], "radius": 0.5},
                {"type": "cylinder", "from": [0.5, 0.5, 0.0], "to": [0.5, 0.5, 0.3], "radius": 0.1},
            ],
        },
        0.1,
    ),
}  # fmt: skip
MESHED = ("quads", "triangles", "quads and triangles", "hexahedra", "tetrahedra", "hexahedra and tetrahedra")
"""Boxes of side 1 from files, their inner nodes moved."""

FOLDER = tempfile.TemporaryDirectory()


@cache
def mesh_file(name: str) -> str:
    """The file of one of the MESHED."""
    path = Path(FOLDER.name) / f"{name}.vtu"
    if name.startswith(("quads", "triangles")):
        nodes, corners = meshes.moved_grid((1.0, 1.0), (6, 5), 0.25)
        whole = {"quads": 30, "triangles": 0, "quads and triangles": 15}[name]
        cells = {"quad": meshes.around(corners[:whole]), "triangle": meshes.triangles(corners[whole:])}
    else:
        nodes, corners = meshes.moved_grid((1.0, 1.0, 1.0), (3, 3, 4), 0.2)
        cells = {"hexahedron": meshes.around(corners), "tetra": meshes.tetrahedra(corners)}
        if " and " in name:
            # Sides with four corners cannot be sides with three: two boxes, apart.
            cells["tetra"] += len(nodes)
            nodes = np.concatenate([nodes, nodes + 2.0])
        else:
            cells.pop("tetra" if name == "hexahedra" else "hexahedron")
    meshes.write(path, nodes, **{kind: rows for kind, rows in cells.items() if len(rows)})
    return str(path)


def composed(
    name: str, formulation: str = "total-lagrangian", boundary: list[Any] | None = None, **keys: Any
) -> Composition:
    """One of the BODIES or, of cells that differ, of the IRREGULAR, FITTED or MESHED, in plane strain, uniaxial strain or
    3D."""
    run: dict[str, Any] = {"formulation": formulation}
    tables: dict[str, Any] = {"boundary": boundary or []}
    if name in MESHED:
        data = scenes.block(2 if name.startswith(("quads", "triangles")) else 3, run=run, tables=tables, **keys).data()
        body = data["bodies"][0]
        del body["shape"], body["spacing"]
        body["mesh"] = {"file": mesh_file(name)}
        return compose(wsph.Scene(**data))
    if name in FITTED or name in BODIES:
        form, spacing = (FITTED if name in FITTED else BODIES)[name]
        keys = {"surface": "fitted" if name in FITTED else "stairs", **keys}
        return compose(scenes.scene(scenes.body(form, spacing, **keys), run=run, **tables))
    form, how = IRREGULAR[name]
    run |= {"seed": how["seed"]} if "seed" in how else {}
    own = {key: value for key, value in how.items() if key != "seed"}
    made = scenes.body(form, 0.1 if "cube" not in name else 0.2, **own, **keys)
    return compose(scenes.scene(made, run=run, **tables))


def due(composition: Composition) -> np.ndarray:
    """Integrals of N_j n over the faces, nondimensional, (n, dim): what faces are due."""
    system = composition.bodies[0].system
    faces, dim = system.geometry.faces, system.space.dim
    found = np.zeros((system.count, dim))
    np.add.at(found, faces.nodes.ravel(), faces.vector.reshape(-1, dim))
    return found / system.scales.length ** (dim - 1)


def forces(composition: Composition, displacement: np.ndarray) -> np.ndarray:
    """Forces of a displacement, nondimensional, (n, dim)."""
    system = composition.bodies[0].system
    system.state.write("displacement", displacement)
    out = system.new()
    system.impose(system.state, 0.0)
    system.rate(system.state, out)
    return out.read("velocity") * (system.density * system.volume)[:, None]
