"""Questions to a mesh of triangles that Warp answers: the nearest triangle, and whether a point is inside."""

import numpy as np
import warp as wp

from wsph.backend.device import start_warp
from wsph.backend.kernels import kernel

FAR = wp.constant(wp.float32(1.0e6))
ACCURACY = wp.constant(wp.float32(2.0))
"""Of the winding number of far triangles that are taken together."""
HALF = wp.constant(wp.float32(0.5))


class Queries:
    """A mesh with `vertices` (v, 3) [m] and `faces` (f, 3), asked on the host's cores in single precision: about its middle
    and of unit size, so that neither place nor size costs digits."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, winding: bool) -> None:
        start_warp()
        low, high = vertices.min(0), vertices.max(0)
        self._middle, self._size = 0.5 * (low + high), float((high - low).max())
        points = wp.array(self._local(vertices), dtype=wp.vec3, device="cpu")
        indices = wp.array(faces.ravel().astype(np.int32), dtype=wp.int32, device="cpu")
        self._mesh = wp.Mesh(points, indices, support_winding_number=winding)

    def _local(self, points: np.ndarray) -> np.ndarray:
        return ((points - self._middle) / self._size).astype(np.float32)

    def _ask(self, question: wp.Kernel, points: np.ndarray, dtype: type) -> np.ndarray:
        answer = wp.zeros(len(points), dtype=dtype, device="cpu")
        at = wp.array(self._local(points), dtype=wp.vec3, device="cpu")
        wp.launch(question, len(points), inputs=[self._mesh.id, at], outputs=[answer], device="cpu")
        return answer.numpy()

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """The triangles nearest to `points` (n, 3) [m], (n,) int."""
        return self._ask(_nearest, points, wp.int32)

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Which of `points` (n, 3) [m] are inside: the triangles wind round them more than half, (n,) bool."""
        return self._ask(_side, points, wp.float32) < 0.0


@kernel(module="wsph.geometry.queries")
def _nearest(mesh: wp.uint64, point: wp.array(dtype=wp.vec3), face_out: wp.array(dtype=wp.int32)):
    i = wp.tid()
    found = wp.mesh_query_point_no_sign(mesh, point[i], FAR)
    face_out[i] = found.face


@kernel(module="wsph.geometry.queries")
def _side(mesh: wp.uint64, point: wp.array(dtype=wp.vec3), sign_out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    found = wp.mesh_query_point_sign_winding_number(mesh, point[i], FAR, ACCURACY, HALF)
    sign_out[i] = found.sign
