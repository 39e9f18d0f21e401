"""The geometry that a body of a scene asks for: a mesh from a file, a shape with a fitted surface, or one in stairs."""

# pyright: strict

import math
from functools import partial
from pathlib import Path

import numpy as np

from wsph.backend.domain import WHOLE, Domain
from wsph.errors import Fault, Refused, SceneError
from wsph.expressions import compile_expression
from wsph.geometry.fitted.fit import fit
from wsph.geometry.fitted.gate import OUT
from wsph.geometry.fitted.outline import too_fine
from wsph.geometry.fitted.planning import on_grid_lines, unmet
from wsph.geometry.geometry import Geometry
from wsph.geometry.grid import plan
from wsph.geometry.lattice import Lattice, lattice, slab_of
from wsph.geometry.meshes.files import read_mesh
from wsph.geometry.meshes.inspection import doubts
from wsph.geometry.meshes.layered import shared
from wsph.geometry.meshes.meshed import Meshed, meshed
from wsph.geometry.meshes.scattered import Scattered, read_points, scattered
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.shape import Rotation
from wsph.plugins.formulations import Formulation
from wsph.ranks.cuts import Reach
from wsph.ranks.slabs import TooFew
from wsph.scene.scene import Scene
from wsph.scene.tables import Body, MeshFile, PointsFile

ALONG_EDGES = 5
"""Layers beyond its own that a particle along edges depends on: stress and gradient are averaged, four steps in all, and of
volumes that are those of blocks of two there is one more."""

ALONE = 1.31
"""The support of a point that finds a kernel's too small, at most, half as much more at a time: with a little over half of
the diagonal of a cell, .87, it sees the corners of its own."""

STEPS = 'surface = "stairs", which leaves the surface in steps of a cell'
"""What any shape can have."""


def geometry_of(
    scene: Scene,
    number: int,
    formulation: Formulation,
    listed: float,
    domain: Domain = WHOLE,
    loads: np.ndarray | None = None,
) -> Geometry:
    """The geometry of a scene's body, the `number`-th, for a formulation; of one that processes share the part that this
    one has of the `domain`, beside the `loads` (size,) of each by other bodies [visits of pairs]: all of one of several that
    has too few particles to be cut. A pair in a list counts as `listed` of those in rows of a grid. Raises SceneError where
    the shape holds no cell, a crack or a map does not fit it, a surface cannot be fitted, or a file is no mesh; Refused for
    what the formulation cannot have."""
    body = scene.bodies[number]
    why = stairs_because(scene, body, formulation) if body.shape is not None and body.surface == "fitted" else ""
    if why:
        raise Refused(
            f'body {body.name!r}: its surface cannot be fitted: {why}; leave that out, or write surface = "stairs"'
        )
    made = partial(_geometry, scene, number, formulation, listed)
    if domain.size > 1:
        try:
            return made(domain, loads)
        except TooFew:
            if len(scene.bodies) == 1:
                raise
    return made(WHOLE, None)


def _geometry(
    scene: Scene, number: int, formulation: Formulation, listed: float, domain: Domain, loads: np.ndarray | None
) -> Geometry:
    """The geometry of a body, or the part of it that a process of a domain has. Raises TooFew where there is too little."""
    body, key = scene.bodies[number], f"bodies.{number}"
    if body.mesh is not None:
        _refuse_mesh(scene, body, formulation)
        make = partial(_from_file, scene, body.mesh, key)
    elif body.points is not None:
        _refuse_points(body, formulation)
        make = partial(_of_points, scene.dim, body.points, support_of(scene, body, formulation), key)
    elif body.shape is None or body.spacing is None:
        raise TypeError("a body without a mesh has a shape and a spacing")
    elif not is_fitted(scene, body, formulation):
        return _lattice(scene, number, body.shape, body.spacing, formulation, domain, loads)
    else:
        apart = any(part.acts and part.attaches for part in body.parts.values())
        make = partial(_fitted, body.shape, body.spacing, scene.run.seed, None if apart else listed, key)
    if domain.size == 1:
        return make()
    reach, who = reach_of(scene, body, formulation), f"body {body.name!r}"
    return shared(make, domain, reach, who=who, doubts=doubts, loads=loads)


def _fitted(shape: Shape, spacing: float | tuple[float, ...], seed: int, listed: float | None, key: str) -> Meshed:
    try:
        return meshed(fit(shape, spacing, seed), shape.axes, listed=listed)
    except ValueError as error:
        said = str(error)
        way = f", or {STEPS}" if said.endswith(OUT) else f"; or choose {STEPS}"
        raise SceneError("scene", [Fault(0, f"{key}.surface", said + way)]) from None


def support_of(scene: Scene, body: Body, formulation: Formulation) -> float:
    """The support of a kernel's pairs [spacings]: the scene's, that of a part that needs one, or by default."""
    traits, own = formulation.traits, [part.support for part in body.parts.values() if part.support is not None]
    moved = body.jitter and scene.dim > 1 and not traits.one_set
    usual = traits.jittered if moved else traits.support
    return scene.run.support or (own[0] if own else usual)


def reach_of(scene: Scene, body: Body, formulation: Formulation) -> Reach:
    """How many layers of cells away the acceleration of a particle depends on where others are. Points see the corners of
    their cells; of a kernel there are two steps as long as its support, from a particle to points and from these to
    particles, and along edges more. Where pairs follow the motion it is what particles see that counts: one layer is what
    loads on faces take, and twice what particles see of each other, with the skin and a layer more, is held of the others,
    until more comes near. Of two sets, both of which are particles, a process finds what it has to hold beyond one layer
    (`wsph.formulations.taylor.set_up`): it steps its own of the one and what these see of the other, those at edges a little
    more where they have to span all directions."""
    traits, support = formulation.traits, support_of(scene, body, formulation)
    if traits.pairs_follow:
        return Reach(1, traits.pairwise, math.floor(support), 2 * math.ceil(support) + 1)
    if traits.corners and not scene.run.kernel_by:
        return Reach(1, joined=False)
    # Nodes, and so cells, have been moved towards each other.
    moved = 2.0 * body.jitter
    if not traits.one_set:
        widened = 1.0 if traits.small_strain or scene.dim == 1 else 1.5
        return Reach(1, joined=True, seen=_steps(widened * support + moved + 0.5))
    if not traits.pairwise:
        # Damage spreads from points to points, of which its own may be a layer beyond its own particles.
        seen = max(support, ALONE) + moved
        return Reach(_steps(seen + 0.5) + _steps(seen - 0.5) + 1, joined=False)
    # Of points of a file two that are a step apart may be in layers that are one more.
    apart = 2 * (_steps(support + moved) + (body.points is not None))
    return Reach(apart if scene.run.kernel_by else max(apart, ALONG_EDGES), joined=True)


def _steps(length: float) -> int:
    """Whole steps that are shorter than a length in all [cells]."""
    return math.ceil(length) - 1


def refuse_misfits(scene: Scene, formulation: Formulation) -> None:
    """Raise SceneError for bodies in cells of a grid whose spacing does not fit their edges."""
    faults: list[Fault] = []
    for k, body in enumerate(scene.bodies):
        if body.shape is None or body.spacing is None or is_fitted(scene, body, formulation):
            continue
        if why := _misfit(body.shape, body.spacing, body.lattice_rotate):
            stairs = stairs_in_words(scene, body, formulation)
            faults.append(Fault(0, f"bodies.{k}.spacing", why + (f"; its surface is {stairs}" if stairs else "")))
    if faults:
        raise SceneError("scene", faults)


def is_fitted(scene: Scene, body: Body, formulation: Formulation) -> bool:
    """Whether the surface of a body is fitted: of one with a shape that no grid meets, by default; where it is asked for,
    of one whose edges the spacing does not divide, too."""
    if body.shape is None or body.surface == "stairs" or stairs_because(scene, body, formulation):
        return False
    if not on_grid_lines(body.shape):
        return True
    return body.surface == "fitted" and bool(_misfit(body.shape, body.spacing, body.lattice_rotate))


def _misfit(shape: Shape, spacing: float | tuple[float, ...] | None, lattice_rotate: Rotation) -> str:
    """Why the edges of a shape do not lie on the lines of a grid; "" where they do."""
    try:
        plan(shape, spacing or 0.0, lattice_rotate)
    except ValueError as error:
        return str(error)
    return ""


def stairs_because(scene: Scene, body: Body, formulation: Formulation) -> str:
    """The reason for which a body with a shape has cells of a grid alone, however its surface lies; "" where it has none."""
    given = [key for key in ("jitter", "lattice_rotate", "map", "cracks") if getattr(body, key)]
    if given:
        return f"the body has {' and '.join(given)}"
    if not formulation.traits.corners:
        return f'the {formulation.name} form has no points in cells of every kind, as "stress-points" has'
    if scene.run.kernel_by:
        return f"{scene.run.kernel_by} asks for the pairs of a kernel"
    if body.name in scene.balls:
        return "contact between balls needs particles of equal size"
    if scene.dim == 1 or np.ptp(np.ravel(body.spacing or 0.0)) > 0.0:
        return "it needs two or three dimensions and one spacing for all axes"
    return ""


def stairs_in_words(scene: Scene, body: Body, formulation: Formulation) -> str:
    """Where the surface of a body with a shape is in steps of a cell, and why; "" where it is not."""
    if body.shape is None or body.spacing is None or scene.dim == 1 or is_fitted(scene, body, formulation):
        return ""
    if on_grid_lines(body.shape) and not body.lattice_rotate:
        return ""
    why = (
        'the body asks for surface = "stairs"' if body.surface == "stairs" else stairs_because(scene, body, formulation)
    )
    spacing = float(np.min(body.spacing))
    names = () if too_fine(body.shape, spacing) else unmet(body.shape, spacing)
    there = f" at {', '.join(names)}" if names else ""
    return f"in steps of a cell{there}: {why}"


def _refuse_mesh(scene: Scene, body: Body, formulation: Formulation) -> None:
    if not formulation.traits.corners:
        raise Refused(
            f'body {body.name!r}: cells of a mesh are for run.formulation = "stress-points", not for {formulation.name!r};'
            " give the body a shape and a spacing"
        )
    if scene.run.kernel_by:
        raise Refused(
            f"body {body.name!r}: points of a mesh see the corners of their own cells: leave out {scene.run.kernel_by}"
        )
    if body.name in scene.balls:
        raise Refused(
            f"body {body.name!r}: contact between balls needs particles of equal size, which a mesh has not: use contact.law ="
            ' "surface"'
        )


def _from_file(scene: Scene, table: MeshFile, key: str) -> Meshed:
    try:
        return meshed(read_mesh(Path(table.file), scene.dim, table.scale, table.part))
    except OSError as error:
        raise SceneError("scene", [Fault(0, f"{key}.mesh.file", str(error))]) from None
    except ValueError as error:
        raise SceneError("scene", [Fault(0, f"{key}.mesh", str(error))]) from None


def _refuse_points(body: Body, formulation: Formulation) -> None:
    if not (formulation.traits.one_set and formulation.traits.pairwise):
        raise Refused(
            f'body {body.name!r}: particles without cells are for run.formulation = "total-lagrangian" and'
            f' "updated-lagrangian" of one set, not for {formulation.name!r}'
        )


def _of_points(dim: int, table: PointsFile, support: float, key: str) -> Scattered:
    try:
        return scattered(*read_points(Path(table.file), dim, table.scale), support)
    except OSError as error:
        raise SceneError("scene", [Fault(0, f"{key}.points.file", str(error))]) from None
    except ValueError as error:
        raise SceneError("scene", [Fault(0, f"{key}.points", str(error))]) from None


def _lattice(
    scene: Scene,
    number: int,
    shape: Shape,
    spacing: float | tuple[float, ...],
    formulation: Formulation,
    domain: Domain,
    loads: np.ndarray | None,
) -> Lattice:
    """The lattice of a scene's body, the `number`-th, with a shape, or the part of it that a process has."""
    body, seed, split = scene.bodies[number], scene.run.seed, formulation.traits.splits_cracks
    cracks = tuple((crack.start, crack.end) for crack in body.cracks)
    expressions = [compile_expression(text) for text in body.map or ()]

    def mapped(points: np.ndarray) -> np.ndarray:
        return np.stack([expression(points) for expression in expressions], 1)

    moved, turn = mapped if expressions else None, body.lattice_rotate
    made = partial(lattice, lattice_rotate=turn, cracks=cracks, split=split, map=moved)
    if domain.size > 1:
        reach, who = reach_of(scene, body, formulation), f"body {body.name!r}"
        slab = partial(slab_of, domain=domain, reach=reach, who=who, loads=loads)
        made = partial(slab, lattice_rotate=turn, cracks=cracks, split=split, map=moved)
    try:
        return made(shape, spacing, body.jitter, seed)
    except ValueError as error:
        key = "spacing" if "no cell" in str(error) else "map" if "the map" in str(error) else "cracks"
        raise SceneError("scene", [Fault(0, f"bodies.{number}.{key}", str(error))]) from None
