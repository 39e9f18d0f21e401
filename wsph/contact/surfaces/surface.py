"""The surface of a body: where it is, what it feels, and how its particles feel that.

Vertices move as B u, u the displacements of the particles, B (vertices, particles) constant, exact for linear fields; forces
on vertices reach the particles by the transpose. So power, resultant and moment are kept, to rounding.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays, host, put
from wsph.backend.domain import Share, any_of
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.contact.surfaces.attention import Rows, attention
from wsph.contact.surfaces.body import SurfacedSystem
from wsph.contact.surfaces.breaking import Breaking
from wsph.contact.surfaces.carriers import carriers_of
from wsph.contact.surfaces.kernels import area_kernel, normal_kernel, note_kernel, place_kernel, spread_kernel
from wsph.contact.surfaces.meshing.boundary import successors
from wsph.contact.surfaces.meshing.embedding import embedding
from wsph.contact.surfaces.meshing.mesh import SurfaceMesh, area_vectors, surface_mesh
from wsph.contact.surfaces.meshing.own import OwnCells
from wsph.contact.surfaces.meshing.shell import shell_of
from wsph.contact.surfaces.meshing.sparse import SparseRows
from wsph.contact.surfaces.struct import SurfaceArrays, surface_struct
from wsph.contact.surfaces.work import SurfaceWork
from wsph.errors import Refused
from wsph.ranks.blocks import own_sum
from wsph.sph.rows import rows_struct

THIN = (0.1, 1.5, 2.0)
"""A wall is thin, so that its sides do not meet each other, between the first two of these thicknesses, as far aside as the
third [spacings]."""


AVERAGED = 0.52
"""Stiffness of a contact, in a cell's, beyond which its own motion is faster than all waves of a body whose gradients are
averaged over edges: of two rods of 50 cells that bounce .980 of the speed comes back with it, .973 with 1."""


class Surface:
    """The surface of a body on the device, nondimensional: n vertices, m faces. `struct` goes to the kernels
    (`wsph.contact.surfaces.struct`); laws add their forces to `force` (n,) vec, which `place` makes zero.

    name                        # of the body
    n, m                        # vertices, faces
    spacing, wave_speed         # h of the body, c
    least_side                  # of a box about the body
    carries                     # stiffness of a contact, in a cell's, that the body has waves for
    modulus, impedance          # rho c^2, rho c
    mesh                        # on the host, in metres (`wsph.contact.surfaces.meshing.mesh`)
    B                           # rows, vertices by particles (`wsph.contact.surfaces.meshing.sparse`)
    exact                       # whether B carries every linear field: sources span all directions everywhere
    mass, free                  # of the particles of B, (k,), (k, dim): 1 where a component of the velocity is free
    here                        # which vertices hang on particles that are here, (n,) bool
    """

    mesh: SurfaceMesh
    B: SparseRows
    _live: np.ndarray
    _torn: np.ndarray
    struct: SurfaceArrays
    force: Array

    def __init__(self, name: str, system: SurfacedSystem, origin: np.ndarray, *, lagged: bool) -> None:
        """About `origin` (dim,) [m], which all bodies share. `lagged`: velocities are the ways of the last step over its
        length, for methods with one evaluation at the end of the step; otherwise those of the state that is evaluated. All
        processes that share the body make it together. Raises Refused for a body without cells."""
        geometry, scales, domain = system.geometry, system.scales, system.domain
        if not any_of(domain, len(geometry.faces.cell) > 0):
            raise Refused(
                f"body {name!r}: its particles have no cells between them, and so no surface: use pinball contact"
            )
        self.name, self._system, self._origin, self._lagged = name, system, origin, lagged
        self._space: Space = system.space
        self._clock, self._last, self._carriers = system.clock, system.state, carriers_of(system, lagged=lagged)
        self._at_nodes = system.position is system.geometry.nodes
        self.wave_speed = system.constitutive.wave_speed / scales.velocity
        self.carries = AVERAGED if system.form.averaged else 1.0
        self.modulus, self.impedance = system.density * self.wave_speed**2, system.density * self.wave_speed
        self.spacing = (self._mean_edge() if geometry.mapped else system.spacing) / scales.length
        low, high = domain.min(geometry.nodes.min(0)), domain.max(geometry.nodes.max(0))
        self.least_side = float((high - low).min()) / scales.length
        self.arrays = Arrays(self._clock.device)
        self._own = OwnCells.of(geometry)
        self._breaking = Breaking(system, self._own, at_nodes=self._at_nodes)
        self._live, self._torn = self._breaking.live(), self._breaking.torn()
        self._make()
        # Which particles forces can reach changes where cells can die.
        support, share = self._carriers.support(self.B, every=system.breaks)
        self._work = SurfaceWork(support, share, self._space, self.arrays.part("work"), domain)
        each = (1.0 / (system.density * system.volume)[support]).astype(self._space.numpy)
        self._share: Array = self.arrays.of("share", each, self._space.scalar)
        self._back = self._rows_of("back", self._to_support())
        if system.breaks:
            self._flags = [
                self.arrays.changes(name, wp.array(flags, dtype=wp.int32, device=self._clock.device))
                for name, flags in self._flagged().items()
            ]
        every = np.arange(self.n), np.arange(self.m)
        self.attend(*every)

    def _mean_edge(self) -> float:
        """The edge of a cube of the mean volume of the particles [m]."""
        geometry, split = self._system.geometry, self._system.geometry.split
        volume = geometry.node_volume if self._at_nodes else geometry.cell_volume
        share = split.particles(at_nodes=self._at_nodes)
        return (own_sum(volume, share, split.domain) / share.whole) ** (1.0 / self._space.dim)

    def _flagged(self) -> dict[str, np.ndarray]:
        """What is alive of its own cells, and which of its own joins are torn, as numbers that are kept, by their names."""
        found = {"alive": self._live[self._own.order].astype(np.int32)}
        return found | ({"torn": self._torn.astype(np.int32)} if self._breaking.joins.whole else {})

    def _to_support(self) -> SparseRows:
        """From vertices to the particles of the support, as rows of these."""
        B, support = self.B, self._work.support
        there = np.flatnonzero(self._stands[B.indices] >= 0)
        entries = np.searchsorted(support, self._stands[B.indices[there]]), B.rows[there], B.values[there]
        return SparseRows.of(entries, (len(support), B.shape[0]))

    def _make(self) -> None:
        """The mesh of the live cells, and its arrays."""
        space, of, geometry, deep = self._space, self.arrays.of, self._system.geometry, not self._at_nodes
        length = self._system.scales.length
        shell = shell_of(geometry, self._own, self._live, self._breaking.parted(self._torn), deep=deep)
        self.mesh = mesh = surface_mesh(shell, deep=deep)
        made = embedding(shell, mesh, at_nodes=self._at_nodes)
        self.B = self._carriers.hang(made.B)  # pyright: ignore[reportConstantRedefinition]
        self._stands = self._carriers.stands(self.B.columns)
        self.mass: np.ndarray = self._carriers.rows(self._system.density * self._system.volume)
        self.free: np.ndarray = self._carriers.rows(self._system.free_components.reshape(-1, space.dim))
        self.here = np.bincount(self.B.rows, self._stands[self.B.indices] >= 0, len(mesh.X)) > 0.0
        self.exact, self._identity = made.exact, made.identity
        self._sizes = abs(self.B), abs(self.B).T
        self.n, self.m = len(mesh.X), len(mesh.faces)
        self.struct = cast(SurfaceArrays, surface_struct(space)())
        places = ((mesh.X - self._origin) / length).astype(space.numpy)
        self._X = of("X", places, space.vec)
        self.struct.x = of("x", places, space.vec)
        for field in ("moved", "speed"):
            setattr(self.struct, field, self.arrays.zeros(field, self.n, space.vec))
        self.force = self.arrays.zeros("force", self.n, space.vec)
        self._way = self.arrays.zeros("way", self.n, space.vec)
        self._before = self.arrays.zeros("before", self.n, space.vec)
        unit = length ** (space.dim - 1)
        self.struct.faces = of("faces", mesh.faces.astype(np.int32), wp.int32)
        self.struct.area = of("area", area_vectors(mesh.X, mesh.faces, mesh.N) / unit, space.vec)
        self.struct.size = of("size", mesh.A / unit, space.scalar)
        self.struct.normal = of("normal", np.repeat(mesh.N, space.dim, axis=0), space.vec)
        self.struct.starts = of("starts", mesh.starts.astype(np.int32), wp.int32)
        self.struct.around = of("around", mesh.around.astype(np.int32), wp.int32)
        *groups, sharp = mesh.groups()
        self.struct.sharp = of("sharp", sharp.astype(np.int32), wp.int32)
        self._groups = tuple(of(f"groups{k}", each.astype(np.int32), wp.int32) for k, each in enumerate(groups))
        self._forth = self._rows_of("forth", self.B)

    def _rows_of(self, name: str, matrix: SparseRows) -> object:
        """A matrix as kernels take it."""
        rows, of = rows_struct(self._space)(), self.arrays.part(name).of
        rows.offsets = of("offsets", matrix.offsets.astype(np.int32), wp.int32)
        rows.indices = of("indices", matrix.indices.astype(np.int32), wp.int32)
        rows.weight = of("weight", matrix.values, self._space.scalar)
        return rows

    def attend(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        """From now on bring up to date what laws read or write of some `vertices` and `faces`, rows: after every search,
        with those that are near anything. Between steps."""
        support = self._work.support
        arrays = self.arrays.part("seen")
        self._seen = attention(self.mesh, self.B, support, self._stands, (vertices, faces), arrays)
        self._carriers.attend(self._seen.columns)
        self.force.zero_()
        self.bring(self._last)
        self.place(self._last)
        self._note()
        self._work.attend(self._seen, host(self._last.struct.displacement))

    def start(self, state: State) -> None:
        """Take a state, and the forces that were spread in it, as those at the start of the run: there is no work yet
        (launches)."""
        self._last = state
        self._note()
        self._work.start(state, self._clock)

    def bring(self, state: State) -> None:
        """Have of other processes what the surface takes of a state (a message, where they share the body)."""
        self._carriers.bring(state)

    def place(self, state: State) -> None:
        """Places, ways, velocities, areas and normals in a state that was brought last; no forces yet (launches)."""
        space, seen, carriers = self._space, self._seen, self._carriers
        moves = [carriers.displacement(state), carriers.velocity(state)]
        inputs = [self._forth, self._X, *moves, self._before, self._clock.time]
        place = place_kernel(space, self._identity, self._lagged)
        self._over(place, seen.placed, inputs, [self.struct, self._way, self.force])
        if space.dim > 1:
            self._over(area_kernel(space), seen.turned, [], [self.struct])
        self._over(normal_kernel(space), seen.smooth, [*self._groups], [self.struct])

    def spread(self, rate: State) -> None:
        """Add the accelerations of the forces to the rate of the particles' velocities (a launch)."""
        inputs = [self._work.particle, self._back, self._share, self.force]
        outputs = [rate.struct.velocity, self._work.load]
        self._over(spread_kernel(self._space), self._seen.pushed, inputs, outputs)

    def close(self, state: State) -> None:
        """Close a step that ends with the state that was last evaluated: its work, and where ways begin (launches)."""
        self._last = state
        self._note()
        self._work.add(state, self._clock)

    def _note(self) -> None:
        self._over(note_kernel(self._space), self._seen.placed, [self._way], [self._before])

    def _over(self, kernel: wp.Kernel, rows: Rows, inputs: Sequence[object], outputs: Sequence[object]) -> None:
        """Launch a kernel over some rows, where there are any."""
        if rows.count:
            self._clock.launch(kernel, rows.count, [rows.device, *inputs], outputs)

    def places(self, displacement: np.ndarray | None = None) -> np.ndarray:
        """Where all vertices are now, on the host, about the origin, (n, dim); or with another `displacement` of the
        particles, (count, dim). All processes that share the body ask together."""
        u = self._carriers.rows(host(self._last.struct.displacement) if displacement is None else displacement)
        return (self.mesh.X - self._origin) / self._system.scales.length + self.B @ u.astype(float)

    def square(self, stiffness: np.ndarray) -> float:
        """A bound of omega^2 of springs at the vertices, `stiffness` (n,): the largest over the particles that are free of
        (1/m) sum_v |B_vj| k_v sum_l |B_vl|, by Gershgorin's circles."""
        forth, back = self._sizes
        row = forth @ np.ones(len(self.mass))
        return float((back @ (stiffness * row) / self.mass)[self.free.any(1)].max(initial=0.0))

    def meets(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Which pairs of its own `vertices` and `faces` (k,) rows may meet, (k,) bool: not faces within two rings of the
        vertex, nor the other side of a thin wall."""
        mesh, near = self.mesh, self.mesh.near
        keys = vertices.astype(np.int64) * self.m + faces
        beside = near[np.minimum(np.searchsorted(near, keys), len(near) - 1)] == keys
        least, most, aside = (part * self.spacing * self._system.scales.length for part in THIN)
        off = mesh.X[vertices] - mesh.X[mesh.faces[faces]].mean(1)
        depth = -(off * mesh.N[faces]).sum(1)
        across = np.linalg.norm(off + depth[:, None] * mesh.N[faces], axis=1)
        return ~beside & ~((depth > least) & (depth < most) & (across < aside))

    def of_particles(self, values: np.ndarray, otherwise: float) -> np.ndarray:
        """Numbers of the columns of B as those of the particles of the body, (count,), `otherwise` of others."""
        return self._carriers.back(values, otherwise)

    def resultant(self, force: Array | None = None) -> np.ndarray:
        """The sum of forces on the vertices, all of them or one law's `force` (n,) vec, on the host, (dim,)."""
        return host(self.force if force is None else force).sum(0, dtype=np.float64)

    @property
    def work(self) -> float:
        """Work of the forces on the particles so far."""
        return self._work.total

    def eroded(self) -> np.ndarray | None:
        """Between steps: find out whether cells have died or parted; if so remake the surface, and return the row of every
        old vertex, -1 where it is gone, (old n,). None where nothing has changed. The caller attends again."""
        if not self._system.breaks:
            return None
        return self.remesh(self._breaking.live(), self._breaking.torn())

    def remesh(self, live: np.ndarray, torn: np.ndarray | None = None) -> np.ndarray | None:
        """The same where of its own cells those are left that are `live` (own,) bool, and of its own joins of cells those
        are `torn` (j,) bool; by default those that are so far."""
        if not self._system.breaks:
            raise RuntimeError(f"body {self.name!r} cannot break")
        torn = self._torn if torn is None else torn
        changed = bool((live != self._live).any() or (torn != self._torn).any())
        if not any_of(self._system.domain, changed):
            return None
        old = self.mesh.boundary
        self._live, self._torn = live, torn
        self._make()
        for array, flags in zip(self._flags, self._flagged().values(), strict=True):
            put(array, flags)
        self._back = self._rows_of("back", self._to_support())
        self.attend(np.arange(self.n), np.arange(self.m))
        return successors(old, self.mesh.boundary)

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        return self.arrays.kept

    def shares(self) -> dict[str, Share]:
        """The parts of these that this process has."""
        found = {f"work.{name}": share for name, share in self._work.shares().items()}
        own = {"alive": self._own.share, "torn": self._breaking.joins}
        return found | {name: share for name, share in own.items() if name in self.arrays.kept}

    def as_kept(self, values: Mapping[str, np.ndarray]) -> np.ndarray | None:
        """Be the surface that a run had when it kept `values` of all processes, before these are put back. As `eroded`."""
        if not self._system.breaks or any(values.get(name) is None for name in self._flagged()):
            return None
        live, torn = np.zeros(len(self._live), bool), self._torn
        live[self._own.order] = values["alive"][self._own.share.window] != 0
        if "torn" in values:
            torn = values["torn"][self._breaking.joins.window] != 0
        return self.remesh(live, torn)
