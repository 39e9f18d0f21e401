"""Small scenes of the parts that the examples and the extremes' grid have little of: to break, damp, touch, load.

In double precision: the factories that make kernels of single precision are the same.
"""

import itertools
from collections.abc import Iterator
from typing import Any

import wsph

MATERIAL = {"density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.25}
YIELDING = {"yield_stress": 1e-3, "hardening_modulus": 0.1}
FORMS = ("total-lagrangian", "stress-points", "updated-lagrangian")
ROWS = ((1, 1.0 / 100.0, 0.0), (2, 1.0 / 24.0, 30.0), (3, 0.125, 0.0))
"""Dimensions, spacings and turns of lattices that are large enough for rows of two sets to pay."""


def block(*, dim: int = 2, form: str = "total-lagrangian", material: str | dict[str, Any] = "elastic",
          body: dict[str, Any] | None = None, run: dict[str, Any] | None = None, **more: Any) -> wsph.Scene:  # fmt: skip
    """A block of side 1, with further keys of its body, of the run and of the scene."""
    own = {"model": material} if isinstance(material, str) else material
    data: dict[str, Any] = {"name": "block", "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim}, "spacing": 0.125,
                            "velocity": [1e-3] + [0.0] * (dim - 1), "material": {**MATERIAL, **own}}  # fmt: skip
    if dim < 3:
        data["state"] = "strain"
    settings = {"integrator": "leapfrog", "formulation": form, "end": 1.0, "cfl": 0.1}
    settings |= {"device": "cpu", "guard": "off"} | (run or {})
    bodies = [data | (body or {}), *more.pop("bodies", [])]
    return wsph.Scene(schema=1, dim=dim, run=settings, bodies=bodies, **more)


def _breaking() -> Iterator[tuple[str, dict[str, Any]]]:
    models = itertools.cycle(("AT1", "AT2"))
    for dim, form, material in itertools.product((1, 2, 3), FORMS[:2], ("elastic", "jaumann")):
        own = {"phase_field": {"fracture_energy": 1e-3, "length": 0.25, "model": next(models)}}
        yield f"phase field, {material}, {form}, {dim}D", {"dim": dim, "form": form, "material": material, "body": own}
        if dim == 2:
            keys = {"form": form, "material": material, "body": own | {"state": "stress"}}
            yield f"phase field, {material}, {form}, plane stress", keys
    mises = {"model": "mises", "yield_stress": 1e-3, "hardening_modulus": 0.1}
    for criterion, limit in (("stretch", 0.01), ("energy", 1e-3), ("plastic-strain", 0.01), ("principal-stress", 0.01)):
        links = {"criterion": criterion, "fracture_energy" if criterion == "energy" else "threshold": limit}
        yield f"links by {criterion}", {"material": mises, "body": {"links": links}}
    yield (
        "links, 3D",
        {"dim": 3, "material": mises, "body": {"links": {"criterion": "principal-stress", "threshold": 0.01}}},
    )


def _damped_and_stiffened() -> Iterator[tuple[str, dict[str, Any]]]:
    for dim, kind in itertools.product((1, 2, 3), ("approach", "pair")):
        viscosity = {"alpha": 1.0, "kind": kind} | ({"beta": 1.0} if kind == "approach" else {})
        yield (
            f"viscosity, {kind}, stress-points, {dim}D",
            {"dim": dim, "form": "stress-points", "body": {"viscosity": viscosity}},
        )
    for kind in ("approach", "pair"):
        yield (
            f"the paper's viscosity, {kind}",
            {"body": {"viscosity": {"alpha": 1.0, "kind": kind, "correction": "paper"}}},
        )
    yield "hourglass", {"body": {"hourglass": {"coefficient": 0.1}}}
    yield "hourglass and residual", {"body": {"hourglass": {"coefficient": 0.1}, "residual": {"coefficient": 0.1}}}
    for form in FORMS[:2]:
        yield f"no residual, {form}", {"form": form, "body": {"residual": False}}
    for form in ("total-lagrangian", "updated-lagrangian"):
        yield f"artificial stress, {form}", {"form": form, "body": {"artificial_stress": {}}}
    yield "damping", {"body": {"damping": {"rate": 1.0}}}
    for dim in (1, 2):
        run = {"correction": "paper", "integrator": "rkc"}
        yield f"the paper's correction, {dim}D", {"dim": dim, "run": run, "body": {"viscosity": {"alpha": 1.0}}}


def _placed_and_loaded() -> Iterator[tuple[str, dict[str, Any]]]:
    for form in FORMS:
        yield f"wendland-c2, {form}", {"form": form, "run": {"kernel": "wendland-c2"}}
    for integrator in ("tsph", "ul-tsph"):
        run = {"integrator": integrator, "formulation": None, "kernel": "wendland-c2"}
        yield f"wendland-c2, {integrator}", {"run": run}
    yield "wendland-c2, 1D", {"dim": 1, "run": {"kernel": "wendland-c2"}}
    yield "particles on the faces", {"body": {"placement": "nodes"}}
    yield "gravity", {"gravity": {"y": -1e-3}}
    moved = {"body": "block", "face": "-x", "velocity": {"x": "1e-3*sin(t)"}}
    loads = [moved, {"body": "block", "face": "+x", "traction": {"x": 1e-3}}]
    for dim, form in itertools.product((2, 3), FORMS[:2]):
        yield f"loads, {form}, {dim}D", {"dim": dim, "form": form, "boundary": loads}
    for dim, form in itertools.product((1, 2, 3), FORMS[:2]):
        quiet = {"body": "block", "face": "+x", "quiet": True, "spring": {"stiffness": 1e-3}}
        seam = [{"body": "block", "face": "+y", "periodic": "-y"}] if dim > 1 else []
        yield f"supports, {form}, {dim}D", {"dim": dim, "form": form, "boundary": [quiet, *seam]}
    spring = {"body": "block", "face": "+x", "spring": {"damping": {"normal": 1e-3}}}
    yield "dashpots, updated-lagrangian", {"form": "updated-lagrangian", "boundary": [spring]}
    for integrator in ("leapfrog", "tsph", "ul-tsph"):
        run = {"integrator": integrator, "formulation": None}
        driven = {"body": "block", "face": "-x", "displacement": {"x": "1e-3*t"}, "acceleration": {"y": "t"}}
        keys = {"boundary": [driven], "gravity": {"x": "1e-3*t"}, "body": {"body_force": {"y": "t*x"}}}
        yield f"motions and forces, {integrator}", {"run": run, **keys}
    for (dim, spacing, turn), law in itertools.product(ROWS, ("elastic", "perzyna")):
        material = {"model": law} | ({**YIELDING, "fluidity": 1.0, "exponent": 1.0} if law == "perzyna" else {})
        body, run = {"spacing": spacing, "lattice_rotate": turn}, {"integrator": "tsph", "formulation": None}
        yield f"rows of two sets, {law}, {dim}D", {"dim": dim, "run": run, "material": material, "body": body}
    probe = {"name": "most", "where": "x > 0.5", "reduce": "max", "fields": ["stress_xx"], "every": 1}
    yield "a probe", {"probes": [probe]}
    # Above some size the threads of a CPU share a step, and meet in a kernel of its own.
    yield "two threads", {"body": {"spacing": 1.0 / 128.0}, "run": {"threads": 2}}


def _touching() -> Iterator[tuple[str, dict[str, Any]]]:
    for dim, law, friction in ((1, "pinball", 0.0), (2, "pinball", 0.3), (2, "pinball", 0.0), (3, "pinball", 0.3)):
        far = {"type": "box", "min": [1.2] + [0.0] * (dim - 1), "max": [2.2] + [1.0] * (dim - 1)}
        other = {"name": "other", "shape": far, "spacing": 0.125, "material": {"model": "elastic", **MATERIAL}}
        contact = [{"between": ["block", "other"], "law": law, "friction": friction}]
        keys = {"dim": dim, "bodies": [other | ({"state": "strain"} if dim < 3 else {})], "contact": contact}
        words = f"contact by {law}{' with friction' if friction else ''}"
        yield f"{words}, {dim}D", keys
        yield f"{words}, stress-points, {dim}D", {**keys, "form": "stress-points"}
    yield (
        "contact with itself",
        {"contact": [{"self": "block", "law": "pinball"}], "body": {"viscosity": {"alpha": 1.0}}},
    )


def parts() -> dict[str, dict[str, Any]]:
    """What `block` makes them of, by their names."""
    return dict([*_breaking(), *_damped_and_stiffened(), *_placed_and_loaded(), *_touching()])
