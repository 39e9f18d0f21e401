"""Where patches meet: the edges of a body, convex or not, and its corners."""

# pyright: strict

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from wsph.geometry.fitted.outline import OFF, SAME, Outline
from wsph.geometry.fitted.projection import onto_seam, to_all

NEAR = 1.5
"""Distance, in steps of its samples, below which a patch may meet another one."""

BENT = np.cos(np.radians(45.0))
"""Cosine of the angle between the normals from which a convex edge is sharp enough to end a layer."""

BLUNT = np.cos(np.radians(30.0))
"""Cosine of the angle between the normals from which an edge of short patches is taken for a bend of one surface."""

SMOOTH = 0.2
"""Sine of the angle between the normals below which patches run into each other."""


@dataclass(frozen=True)
class Junction:
    """The patches `first` and `second` meet at an angle at `points` (m, dim) [m]. `passes`: a layer on one of them goes on
    along the other, since a cell would have no room for its corner there: the edge is concave or blunt, or they run into
    each other. A `seam` joins them in one plane: heights do not say where. `blunt`: the angle is below 30 degrees."""

    first: int
    second: int
    points: np.ndarray
    passes: bool
    seam: bool = False
    blunt: bool = False


def junctions(body: Outline) -> list[Junction]:
    """All pairs of patches that meet."""
    found: list[Junction] = []
    ends = [(points.min(0) - step, points.max(0) + step) for points, step in zip(body.points, body.steps, strict=True)]
    for a, b in combinations(range(len(body.patches)), 2):
        reach = NEAR * max(body.steps[a], body.steps[b])
        if (ends[a][0] > ends[b][1] + reach).any() or (ends[b][0] > ends[a][1] + reach).any():
            continue
        near = [_near(body, i, j, NEAR * body.steps[i]) for i, j in ((a, b), (b, a))]
        if _in_one_plane(body, a, b):
            points = _seam(body, a, b, np.concatenate(near))
            if len(points):
                found.append(Junction(a, b, points, passes=True, seam=True, blunt=True))
            continue
        points = _meeting(body, [a, b], np.concatenate(near))
        edge, passes, blunt = _sides(body, a, b, points)
        if edge.any() or passes.any():
            found.append(Junction(a, b, points[edge], bool(passes.any()), blunt=bool(blunt.any())))
    return found


def corners(body: Outline, edges: list[Junction]) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Points (m, dim) [m] where as many patches meet as there are dimensions, each once, and which patches they are."""
    dim = body.shape.dim
    if dim == 2:
        found = [(junction.points, (junction.first, junction.second)) for junction in edges]
    else:
        found: list[tuple[np.ndarray, tuple[int, ...]]] = []
        pairs = {(edge.first, edge.second) for edge in edges}
        for edge in edges:
            for c in range(edge.second + 1, len(body.patches)):
                if (edge.first, c) in pairs or (edge.second, c) in pairs:
                    ids = (edge.first, edge.second, c)
                    near = body.distance(c, edge.points, NEAR * max(body.steps[i] for i in ids))
                    reach = NEAR * max(body.steps[i] for i in ids)
                    found.append((_meeting(body, list(ids), edge.points[near <= reach]), ids))
    points, which = list[np.ndarray](), list[tuple[int, ...]]()
    for many, ids in found:
        _, first = np.unique(np.rint(many / (10.0 * SAME * body.spacing)), axis=0, return_index=True)
        points += list(many[np.sort(first)])
        which += [ids] * len(first)
    return np.reshape(points, (-1, dim)), which


def _near(body: Outline, patch: int, other: int, reach: float) -> np.ndarray:
    """Samples of a patch within `reach` [m] of another."""
    points = body.points[patch]
    height = np.linalg.norm(points - body.patches[other].surface.nearest(points), axis=1)
    points = points[height <= reach]
    return points[body.distance(other, points, reach) <= reach]


def _in_one_plane(body: Outline, a: int, b: int) -> bool:
    normals = [body.patches[i].surface.normal for i in (a, b)]
    if normals[0] is None or normals[1] is None or normals[0] @ normals[1] < 1.0 - SAME:
        return False
    return float(np.abs(body.patches[a].surface.height(body.points[b])[0]).max()) <= SAME * body.spacing


def _seam(body: Outline, a: int, b: int, points: np.ndarray) -> np.ndarray:
    """The points next to `points` (n, dim) [m] on the common border of patches in one plane. Those of shapes that reach
    into each other have none of their own: either may have what they share."""
    if not (body.whole[a] and body.whole[b]):
        return points[:0]
    points = onto_seam(body.patches[a], body.patches[b], points)
    apart = np.linalg.norm(points - body.patches[a].surface.nearest(points), axis=1)
    return points[apart <= SAME * body.spacing]


def _meeting(body: Outline, ids: list[int], points: np.ndarray) -> np.ndarray:
    """The points where patches meet that are next to `points` (n, dim) [m]."""
    patches = [body.patches[i] for i in ids]
    if not len(points):
        return points
    found, missed = to_all(points, patches, body.spacing)
    reach = 2.0 * NEAR * max(body.steps[i] for i in ids)
    good = (missed <= SAME * body.spacing) & (np.linalg.norm(found - points, axis=1) <= reach)
    for patch in patches:
        good &= np.linalg.norm(found - patch.surface.nearest(found), axis=1) <= SAME * body.spacing
    return found[good]


def _sides(body: Outline, a: int, b: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which points, on both surfaces, are on an edge of the body, where a layer has to pass from one of them to the other,
    and where the edge is blunt, (n,) bool each.

    The surfaces part the space about a point into four sectors. The body fills one of them at a convex edge and three at a
    concave one; with two, one of the surfaces has no patch there.
    """
    if not len(points):
        return np.zeros(0, bool), np.zeros(0, bool), np.zeros(0, bool)
    na, nb = (body.patches[i].surface.height(points)[1] for i in (a, b))
    cosine = (na * nb).sum(1)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    crossing = sine > SMOOTH
    square = np.where(crossing, sine, 1.0)[:, None] ** 2
    filled: list[np.ndarray] = []
    for sa, sb in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)):
        way = ((sa - sb * cosine)[:, None] * na + (sb - sa * cosine)[:, None] * nb) / square
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
        filled.append(body.shape.holds(points + 10.0 * OFF * body.spacing * way))
    under, one, other, above = filled
    convex = crossing & under & ~one & ~other & ~above
    concave = crossing & under & one & other & ~above
    blend = ~crossing & (cosine > 0.0) & under & ~above
    edge = convex | concave
    return edge, concave | blend | (convex & (cosine > BENT)), (edge | blend) & (cosine > BLUNT)
