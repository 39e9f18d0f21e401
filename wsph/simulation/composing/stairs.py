"""What steps of a cell make of a shape: volume, parts of the surface and resultants that are off, said before a run."""

# pyright: strict

from collections.abc import Iterator, Sequence

import numpy as np

from wsph.boundary.selections import chosen
from wsph.boundary.tables import Boundary
from wsph.geometry.fitted.gate import AREA, VOLUME
from wsph.geometry.fitted.outline import outline, too_fine
from wsph.geometry.fitted.planning import on_grid_lines
from wsph.geometry.lattice import Lattice
from wsph.geometry.shapes.stair_patches import StairPatches
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import BodyRun


def stepped(scene: Scene, bodies: Sequence[BodyRun]) -> Iterator[str]:
    """What of the bodies in stairs differs from their shapes by more than a fitted surface may."""
    for k, run in enumerate(bodies):
        geometry, shape = run.system.geometry, run.body.shape
        if shape is None or not isinstance(geometry, Lattice) or geometry.mapped or scene.dim == 1:
            continue
        patches = geometry.faces.patches
        if not isinstance(patches, StairPatches) or (on_grid_lines(shape) and not run.body.lattice_rotate):
            continue
        facing = _facing(geometry, patches)
        named = {each.patch for each in scene.boundary if each.body == run.body.name}
        if not too_fine(shape, geometry.spacing):
            yield from _of_shape(run, geometry, patches, facing, named, f"bodies.{k}")
        yield from _of_loads(scene, run, geometry, facing)


def _facing(geometry: Lattice, patches: StairPatches) -> np.ndarray:
    """The parts of the areas of the faces that look along the normals of their patches (m,) [m^(dim-1)], of those that other
    processes own none: in all the area of the surface that the stairs follow."""
    normal = patches.projected(geometry.faces.outer, geometry.split.domain)[0]
    return np.maximum((geometry.faces.vector.sum(1) * normal).sum(1), 0.0) * geometry.own_faces


def _whole(geometry: Lattice, parts: Sequence[float]) -> list[float]:
    """The sums of what the processes have of some numbers of a body."""
    return geometry.split.domain.joined(np.array([parts])).sum(0).tolist()


def _of_shape(
    run: BodyRun, geometry: Lattice, patches: StairPatches, facing: np.ndarray, named: set[str | None], key: str
) -> Iterator[str]:
    """The volume, and the patches that are gone, or curved or `named` and of another area."""
    body = outline(patches.shape, geometry.spacing)
    way = "choose a smaller spacing, or a fitted surface"
    (volume,) = _whole(geometry, [geometry.cell_volume[geometry.split.points.own].sum() / body.volume])
    if abs(volume - 1.0) > VOLUME:
        yield f"{key}.spacing: in steps of a cell body {run.body.name!r} has {volume:.3g} of its volume: {way}"
    areas, watched = dict[str, float](), dict[str, bool]()
    for patch, area in zip(body.patches, body.areas.tolist(), strict=True):
        areas[patch.name] = areas.get(patch.name, 0.0) + area
        watched[patch.name] = patch.surface.normal is None or patch.name in named
    rows = [patches.get(name, np.zeros(0, int)) for name in areas]
    gone = [name for name, count in zip(areas, _whole(geometry, [*map(len, rows)]), strict=True) if not count]
    if gone:
        yield (
            f"{key}.spacing: {', '.join(map(repr, gone))} of body {run.body.name!r} {'is' if len(gone) == 1 else 'are'} gone: no"
            f" cell side stands for it in steps of {geometry.spacing:g} m: {way}"
        )
    found = dict(zip(areas, _whole(geometry, [facing[each].sum() for each in rows]), strict=True))
    parts = {name: found[name] / areas[name] for name in areas if name not in gone and watched[name]}
    off = [f"{name!r} has {part:.3g} of its area" for name, part in parts.items() if abs(part - 1.0) > AREA]
    if off:
        yield f"{key}.spacing: in steps of a cell {', '.join(off)}: {way}"


def _of_loads(scene: Scene, run: BodyRun, geometry: Lattice, facing: np.ndarray) -> Iterator[str]:
    """Loads per area on steps, whose area is larger than that of the surface that they follow."""
    for k, condition, _, rows in chosen(scene, run.body.name, geometry, run.system.position):
        true, steps = _whole(geometry, [facing[rows].sum(), geometry.sides.area[rows & geometry.own_faces].sum()])
        if not true > 0.0 or steps < (1.0 + AREA) * true:
            continue
        for key in _per_area(condition):
            force = "; force = { ... } gives a resultant that is exact" if key == "traction" else ""
            yield (
                f"boundary.{k}.{key}: the steps of a cell that it acts on have {steps / true:.3g} times the area of the surface of"
                f" body {run.body.name!r} that they follow, and its resultant is as much too large: take a fitted surface{force}"
            )


def _per_area(condition: Boundary) -> Iterator[str]:
    """Loads that go by areas; a pressure goes by normals, which add up on steps too."""
    if condition.traction:
        yield "traction"
    yield from (key for key in condition.acting if key != "pressure")
