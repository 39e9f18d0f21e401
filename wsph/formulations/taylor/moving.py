"""The two-set system that moves: updated-Lagrangian Taylor-SPH.

Operators are those of the current configuration. The kernel is carried by the material: the weights keep their reference
values, and a gradient is the reference gradient pushed forward with the local deformation, grad_x f = F^-T grad_X f, with
F from the displacements through the same operator. Where the deformation is locally affine this is the corrected gradient
built on current distances, the smoothing length follows the stretch in every direction (a fixed one loses neighbours beyond
a stretch of 2.4), and virtual particles are the centroids of their cells. Density is rho_0/J.

Faces turn with the body: a face prescribes stresses in the frame of its current normal n and its material tangents, from
the places of the face's own particles. Under 1 % of strain along a face modes grow by 0.03 % a step in tension and 0.4 % in
compression at ten cells, and by less in proportion to the stress. (Frames from the deformation half a cell below the face,
F^-T N, see a shear that the face does not have, and modes grow by 2 % a step.)
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable

import numpy as np
import warp as wp

from wsph.backend.space import Array
from wsph.backend.state import Field, Layout, State
from wsph.boundary.conditions import Conditions
from wsph.formulations.layout import deformation_field, displacement_field, matter_fields, velocity_field
from wsph.formulations.setup import Setup
from wsph.formulations.taylor.face_frames import PASSES, frame_kernel
from wsph.formulations.taylor.faces import turning_faces_struct
from wsph.formulations.taylor.kernels import TaylorKernels
from wsph.formulations.taylor.moving_kernels import kernels, places_struct
from wsph.formulations.taylor.system import TwoSetSystem
from wsph.geometry.lattice import Lattice
from wsph.sph.rows import rows_struct


class MovingTwoSetSystem(TwoSetSystem):
    """A body as updated-Lagrangian Taylor-SPH sees it: the calls of `TwoSetSystem`, in the current configuration. Of f
    particles on faces:

    _across  # axes of the grid across which the faces lie whose frame each takes, (f,) int32, a bit each
    _slopes  # rows with weights of slopes along the axes of the grid
    _frames  # current axes of each particle's faces, in rows, (f,) mat
    """

    by_rows = False
    along = max(TwoSetSystem.along, PASSES + 1)

    def __init__(self, setup: Setup):
        super().__init__(setup)
        lattice, space, scales, device = self.lattice, setup.space, setup.scales, setup.device
        on = self._on_faces
        slot = np.full(self.count, -1, np.int32)
        slot[on] = np.arange(len(on))
        self._across: Array = wp.array(self.conditions.across[on], dtype=wp.int32, device=device)
        self._slopes = self._face_slopes(on)
        self._frames: Array = wp.zeros(len(on), dtype=space.mat, device=device)
        faces = turning_faces_struct(space)()
        faces.held, faces.free, faces.frames = self._faces.held, self._faces.free, self._frames
        faces.slot = wp.array(slot, dtype=wp.int32, device=device)
        # About the body's middle: single precision has no digits for how far away it stands.
        middle, places = lattice.middle, places_struct(space)()
        places.nodes = wp.array((lattice.nodes - middle) / scales.length, dtype=space.vec, device=device)
        places.cells = wp.array((lattice.cells - middle) / scales.length, dtype=space.vec, device=device)
        self._at_targets = [faces, places]
        self.arrays.part("faces").adopt(self)

    def _turn_faces(self, state: State, share: float) -> None:
        """The frames of the faces at the displacement + share dt velocity of `state` (a launch)."""
        inputs = [self._axes, self._slopes, state.struct, self.clock.time, self._across, self.space.scalar(share)]
        frames = frame_kernel(self.space, state.layout)
        self.clock.launch(frames, self._framed.shape[0], inputs, [self._frames])

    def _face_slopes(self, on: np.ndarray) -> object:
        """Rows of the particles `on` faces, with weights whose k-th component gives the slope along the k-th axis of the
        grid.

        A slope is that of values averaged PASSES times over the cells beside a particle: an odd-even displacement is
        invisible to the virtual particles, nothing restores it, and frames that saw it would feed it.
        """
        beside, x = self.lattice.neighbours, self.lattice.index
        keys: list[np.ndarray] = []
        values: list[np.ndarray] = []
        for k in range(self.space.dim):
            before, after = beside[on, k, 0], beside[on, k, 1]
            row = np.concatenate([np.arange(len(on))] * 2)
            node, weight = np.concatenate([after, before]), np.repeat([1.0, -1.0], len(on))
            # Of a single cell across, the averages at both ends are the same.
            alone = (before == on) & (beside[after, k, 1] == after) | (after == on) & (beside[before, k, 0] == before)
            for _ in range(PASSES):
                sides = beside[node, k]
                there = sides != node[:, None]
                share = weight[:, None] * there / (2.0 * np.maximum(there.sum(1), 1))[:, None]
                share = np.where((there.any(1) & ~alone[row])[:, None], share, 0.5 * weight[:, None])
                sides = np.where(alone[row, None], node[:, None], sides)
                row = np.concatenate([row, row, row])
                node, weight = (
                    np.concatenate([node, sides[:, 0], sides[:, 1]]),
                    np.concatenate([share.sum(1), *share.T]),
                )
            length = np.bincount(row, weight * x[node, k], len(on)) * (self.lattice.frame.step[k] / self.scales.length)
            keys.append(row.astype(np.int64) * self.count + node)
            values.append(np.where(length > 0.0, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)[row] * weight)
        kept, place = np.unique(np.concatenate(keys), return_inverse=True)
        axis = np.repeat(np.arange(self.space.dim), [len(v) for v in values])
        weights = np.zeros((len(kept), self.space.dim))
        np.add.at(weights, (place, axis), np.concatenate(values))
        offsets = np.searchsorted(kept, np.arange(len(on) + 1, dtype=np.int64) * self.count)
        rows = rows_struct(self.space, vectors=True)()
        rows.offsets = wp.array(offsets, dtype=wp.int32, device=self.device)
        rows.indices = wp.array(kept % self.count, dtype=wp.int32, device=self.device)
        rows.weight = wp.array(weights, dtype=self.space.vec, device=self.device)
        return rows

    def _spanning(self, name: str, lattice: Lattice, conditions: Conditions, held: np.ndarray) -> np.ndarray:
        """All: each axis by itself is no gradient under shear and rotation: corners would find strain in a rigid turn."""
        return np.ones(len(lattice.nodes if name == "real" else lattice.cells), bool)

    def _listed_for(self) -> str:
        return "its gradients follow the motion"

    def _layout(self, where: str) -> Layout:
        spins = self.space.dim * (self.space.dim - 1) // 2 * (where == "virtual")
        return Layout.of(
            (
                velocity_field(self.space),
                *matter_fields(self.constitutive),
                deformation_field(self.space),
                Field("spin", spins, "1/s", hidden=True),
                displacement_field(self.space),
            )
        )

    def _make_kernels(self) -> TaylorKernels:
        layouts = self._layout("virtual"), self._layout("real")
        return kernels(self.space, self.constitutive.laws, *layouts, self.force.parts)

    def rate(self, source: State, out: State, *, imposed: State, weight: float) -> None:
        """As in `TwoSetSystem`; `imposed` holds stress components in the frames of the faces."""
        self._turn_faces(out, 0.5)
        super().rate(source, out, imposed=imposed, weight=weight)

    def hold(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed values, stresses in the current frames of the faces."""
        self._turn_faces(state, 0.0)
        super().hold(state, c)

    def _in_frames(self, state: State, act: Callable[[], None]) -> None:
        n = self._framed.shape[0]
        self.clock.launch(self.kernels.turn, n, [self._framed, self._frames, 1], [state.struct])
        act()
        self.clock.launch(self.kernels.turn, n, [self._framed, self._frames, 0], [state.struct])

    def accept(self, state: State) -> None:
        """Close the step: the prescribed values at t + dt."""
        # The displacement has had the first half of its step; the second half is with the velocity at the end.
        self._part.bring(state, self.clock, "velocity", "displacement")
        self._turn_faces(state, 0.5)
        super().accept(state)
