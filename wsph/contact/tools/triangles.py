"""Gap and normal of a point at a closed surface of triangles.

The tree that names the triangle is of single precision: a gap from it would be noise of 1e-7 of the size of the tool. So it
names the triangle alone; the nearest of that and of its neighbours, the gap and the normal are found in the precision of the
run (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
"""

from dataclasses import dataclass
from functools import cache
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.space import Space

ALONG = 1.0e-9
"""The least 1 - cosine of the angle to a triangle's normal at which a point is beside it, not over it."""


@cache
def triangles_struct(space: Space) -> type:
    """Struct of f triangles, nondimensional.

    tree    # of the mesh that Warp searches
    corner  # (3 f,) point
    normal  # outward, of length one, (f,) point
    starts  # (f + 1,) int32, where the triangles that share a corner with each begin in
    around  # int32, ascending, with the triangle itself
    far     # how far the tree looks
    """
    annotations: dict[str, object] = {"tree": wp.uint64, "far": wp.float32}
    annotations |= dict.fromkeys(("corner", "normal"), wp.array(dtype=space.point))
    annotations |= dict.fromkeys(("starts", "around"), wp.array(dtype=wp.int32))
    return cast(type, wp.struct(type("Triangles", (), {"__annotations__": annotations, "__module__": __name__})))


@dataclass(frozen=True)
class Mesh:
    """Triangles on the device, and the tree that they are found by, which has to live as long."""

    struct: object
    tree: wp.Mesh


def triangles_of(corners: np.ndarray, space: Space, device: str, far: float) -> Mesh:
    """Triangles (f, 3, 3) of a closed surface, counter-clockwise as seen from outside, nondimensional."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    order = np.argsort(index.ravel(), kind="stable") // 3
    begin = np.concatenate([[0], np.cumsum(np.bincount(index.ravel()))])
    around = [np.unique(np.concatenate([order[begin[v] : begin[v + 1]] for v in face])) for face in index]
    starts = np.concatenate([[0], np.cumsum([len(each) for each in around])])
    tree = wp.Mesh(
        wp.array(points.astype(np.float32), dtype=wp.vec3, device=device),
        wp.array(index.ravel().astype(np.int32), dtype=wp.int32, device=device),
    )
    made = triangles_struct(space)()
    made.tree, made.far = tree.id, wp.float32(far)
    made.corner = wp.array(corners.reshape(-1, 3), dtype=space.point, device=device)
    made.normal = wp.array(normal, dtype=space.point, device=device)
    made.starts = wp.array(starts, dtype=wp.int32, device=device)
    made.around = wp.array(np.concatenate(around), dtype=wp.int32, device=device)
    return Mesh(made, tree)


@cache
def _foot(space: Space) -> wp.Function:
    """Warp function (point, corners of a triangle) -> its nearest point."""
    real, point = space.scalar, space.point

    @wp.func
    def foot(p: point, a: point, b: point, c: point) -> point:
        zero = real(0.0)
        ab, ac = b - a, c - a
        d1, d2 = wp.dot(ab, p - a), wp.dot(ac, p - a)
        if d1 <= zero and d2 <= zero:
            return a
        d3, d4 = wp.dot(ab, p - b), wp.dot(ac, p - b)
        if d3 >= zero and d4 <= d3:
            return b
        d5, d6 = wp.dot(ab, p - c), wp.dot(ac, p - c)
        if d6 >= zero and d5 <= d6:
            return c
        vc = d1 * d4 - d3 * d2
        if vc <= zero and d1 >= zero and d3 <= zero:
            return a + (d1 / (d1 - d3)) * ab
        vb = d5 * d2 - d1 * d6
        if vb <= zero and d2 >= zero and d6 <= zero:
            return a + (d2 / (d2 - d6)) * ac
        va = d3 * d6 - d5 * d4
        if va <= zero and d4 >= d3 and d5 >= d6:
            return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b)
        whole = va + vb + vc
        return a + (vb / whole) * ab + (vc / whole) * ac

    return foot


@cache
def closest(space: Space) -> wp.Function:
    """Warp function (triangles, place in their frame) -> gap and normal; a gap of 1e30 beyond what the tree looks at."""
    real, vec, point, Triangles, foot = space.scalar, space.vec, space.point, triangles_struct(space), _foot(space)

    @wp.func
    def nearest(mesh: Triangles, r: vec):
        p = point(r[0], r[1], r[2])
        gap = real(1.0e30)
        n = point()
        found = wp.mesh_query_point_sign_normal(mesh.tree, wp.vec3(float(p[0]), float(p[1]), float(p[2])), mesh.far)
        if found.result:
            least = real(1.0e30)
            over = real(-1.0e30)
            for k in range(mesh.starts[found.face], mesh.starts[found.face + 1]):
                f = mesh.around[k]
                way = p - foot(p, mesh.corner[3 * f], mesh.corner[3 * f + 1], mesh.corner[3 * f + 2])
                apart = wp.length(way)
                height = wp.dot(way, mesh.normal[f])
                # Of triangles that share the nearest point, the one that looks at the point.
                close = real(1.0e-9) * least
                if apart < least - close or (apart <= least + close and wp.abs(height) > over):
                    least = apart
                    over = wp.abs(height)
                    if over >= real(wp.static(1.0 - ALONG)) * apart:
                        n = mesh.normal[f]
                        gap = wp.dot(p - mesh.corner[3 * f], n)
                    else:
                        gap = real(found.sign) * apart
                        n = way / gap
        return gap, vec(n[0], n[1], n[2])

    return nearest
