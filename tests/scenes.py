"""The pieces that the tests' scenes are made of, and the cubes and bars that most of them are.

    scene(body(box(1.0, 0.5), 0.1, state="stress"), boundary=[held("-x", 2)])
    block(dim=3, cells=8, model="jaumann", run={"cfl": 0.2})
    bar(50, velocity=["1e-3*cos(pi*x)"])

Materials, shapes, bodies and conditions are plain data, as a scene takes them: what a test changes of one is a keyword, and
what it leaves out is of unit size, so that results can be written down. Length, density and Young's modulus are 1.
"""

from typing import Any

from pydantic import TypeAdapter

import wsph
from wsph.geometry.shapes.combined import Shape

Data = dict[str, Any]

FORMS = ("stress-points", "total-lagrangian")
"""The Lagrangian forms of one set."""


def material(model: str = "elastic", **changes: Any) -> Data:
    """E = rho = 1, nu = 0.3; keys of the model's own among the changes."""
    return {"model": model, "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3, **changes}


def box(*sides: float | tuple[float, float]) -> Data:
    """A box with a corner at the origin; a side is its length, or from where to where it goes."""
    ends = [side if isinstance(side, tuple) else (0.0, side) for side in sides]
    return {"type": "box", "min": [low for low, _ in ends], "max": [high for _, high in ends]}


def cube(dim: int, centred: bool = False) -> Data:
    """A box of side 1 from the origin, or about it."""
    return box(*[(-0.5, 0.5) if centred else (0.0, 1.0)] * dim)


def shape(**data: Any) -> Any:
    """The shape that a scene makes of its data."""
    return TypeAdapter(Shape).validate_python(data)


def dimensions(data: Data) -> int:
    """Of the space that a shape lies in."""
    while "shapes" in data:
        data = data["shapes"][0]
    if "points" in data:
        return 2
    return len(next(data[key] for key in ("min", "center", "from") if key in data))


def body(shape: Data, spacing: float | list[float], name: str = "b", **keys: Any) -> Data:
    """A body: elastic and, but in 3D, at plane strain, where `keys` say nothing else."""
    state = {"state": "strain"} if dimensions(shape) < 3 else {}
    return {"name": name, "shape": shape, "spacing": spacing, "material": material(), **state, **keys}


def held(face: str, dim: int, name: str = "b") -> Data:
    """A face that stays where it is."""
    return {"body": name, "face": face, "fixed": list("xyz"[:dim])}


def driven(face: str, name: str = "b", **velocity: Any) -> Data:
    """A face whose velocity is prescribed."""
    return {"body": name, "face": face, "velocity": velocity}


def scene(*bodies: Data, run: Data | None = None, **tables: Any) -> wsph.Scene:
    """Leapfrog for one unit of time at a Courant number of 0.3, where `run` says nothing else."""
    step = {} if run and "dt" in run else {"cfl": 0.3}
    keys = {"integrator": "leapfrog", "end": 1.0, **step, **(run or {})}
    dim = dimensions(bodies[0]["shape"])
    return wsph.Scene(schema=1, dim=dim, run=keys, bodies=list(bodies), **tables)


def block(dim: int = 2, cells: int = 10, *, model: str = "elastic", centred: bool = False, run: Data | None = None,
          tables: Data | None = None, **keys: Any) -> wsph.Scene:  # fmt: skip
    """A cube of side 1 with as many cells along every edge; `keys` are those of the body, `tables` the scene's others."""
    made = body(cube(dim, centred), **{"spacing": 1.0 / cells, "material": material(model), **keys})
    return scene(made, run=run, **(tables or {}))


def bar(cells: int, *, run: Data | None = None, tables: Data | None = None, **keys: Any) -> wsph.Scene:
    """A bar of length 1 in uniaxial stress."""
    return block(1, cells, run=run, tables=tables, **{"state": "stress", **keys})


def spinning(**keys: Any) -> wsph.Scene:
    """A free square of particles that turns and stretches."""
    run = {"formulation": "total-lagrangian", "end": 4.0, "cfl": 0.5}
    return block(centred=True, run=run, **{"velocity": ["-0.1*y + 0.05*x", "0.1*x"], **keys})


def turning(dim: int, run: Data, **keys: Any) -> wsph.Scene:
    """A free block of few cells that turns, stretches and shears, for thousands of steps."""
    velocity = ["-0.1*y + 0.02*x", "0.1*x", "0.01*z"][:dim]
    return block(dim, 6 if dim == 2 else 4, centred=True, run=run, **{"velocity": velocity, **keys})
