"""What a fitted body is refused for: cells turned inside out, nodes off their surfaces, corners, areas or volume missed."""

# pyright: strict

from itertools import product

import numpy as np

from wsph.geometry.cells import cell_volumes
from wsph.geometry.fitted.junctions import Junction, corners
from wsph.geometry.fitted.layer import Cells
from wsph.geometry.fitted.nearby import nearest_distance
from wsph.geometry.fitted.outline import SAME, Outline
from wsph.geometry.gradients import face_shares

AREA = 0.10
"""Part of the area of a patch that may be missed."""

VOLUME = 0.05
"""Part of the volume that may be missed."""

OUT = "choose a smaller spacing"


def check(body: Outline, edges: list[Junction], cells: Cells, nodes: np.ndarray, missed: np.ndarray) -> None:
    """Raise ValueError where the cells with their `nodes` (n, dim) [m] are not the body. `missed` (n,) [m]: how far nodes
    are from the patches that they are to lie on."""
    dim, names = nodes.shape[1], [patch.name for patch in body.patches]
    far = int(missed.argmax())
    if not missed[far] <= SAME * body.spacing:
        on = ", ".join(name for name, held in zip(names, cells.on(len(names))[far], strict=True) if held)
        raise ValueError(f"{on} do not meet near {body.place(nodes[far])} as the cells there need it: {OUT}")
    volume = cell_volumes(nodes[cells.corners], np.array(list(product((0, 1), repeat=dim))))
    worst = int(volume.argmin())
    if not volume[worst] > 0.0:
        where = body.place(nodes[cells.corners[worst]].mean(0))
        raise ValueError(f"the cell at {where} would be inside out where the surface is fitted: {OUT}")
    _check_corners(body, edges, nodes)
    share, _ = face_shares(nodes[cells.sides], nodes[cells.corners[cells.owner]].mean(1))
    areas = np.bincount(cells.label, share.sum(1), len(names))
    for k, (area, own) in enumerate(zip(areas, body.areas, strict=True)):
        if abs(area - own) > AREA * own:
            where = body.place(_farthest(body.points[k], nodes[np.unique(cells.sides[cells.label == k])]))
            raise ValueError(f"{names[k]} would have {area / own:.3g} of its area, with less near {where}: {OUT}")
    if abs(volume.sum() - body.volume) > VOLUME * body.volume:
        points = np.concatenate(body.points)
        where = body.place(_farthest(points, nodes[np.unique(cells.sides)]))
        raise ValueError(f"{volume.sum() / body.volume:.3g} of the volume would be left, with less near {where}: {OUT}")


def _check_corners(body: Outline, edges: list[Junction], nodes: np.ndarray) -> None:
    points, which = corners(body, edges)
    apart = nearest_distance(nodes, points, body.spacing)
    for point, ids, distance in zip(points, which, apart, strict=True):
        if distance > 10.0 * SAME * body.spacing:
            names = ", ".join(body.patches[k].name for k in ids)
            raise ValueError(f"the corner of {names} at {body.place(point)} has no node: {OUT}")


def _farthest(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """The point (dim,) of `points` (m, dim) that is farthest from all `nodes` (n, dim)."""
    if not len(nodes):
        return points[0]
    apart = [float(((nodes - point) ** 2).sum(1).min()) for point in points]
    return points[int(np.argmax(apart))]
