"""The surface of a body: where it is, what it feels, and how its particles feel that.

Vertices move as B u, u the displacements of the particles, B (vertices, particles) constant, exact for linear fields; forces
on vertices reach the particles by the transpose. So power, resultant and moment are kept, to rounding.
"""

# pyright: strict

import numpy as np

from wsph.backend.domain import WHOLE, Domain
from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.contact.surfaces.body import SurfacedSystem
from wsph.contact.surfaces.struct import SurfaceArrays


class Surface:
    """The surface of a body on the device, nondimensional: n vertices, m faces. `struct` goes to the kernels
    (`wsph.contact.surfaces.struct`); laws add their forces to `force` (n,) vec, which `place` makes zero.

    name                        # of the body
    n, m                        # vertices, faces
    spacing, wave_speed         # h of the body, c
    modulus, impedance          # rho c^2, rho c
    mesh                        # on the host, in metres (`wsph.contact.surfaces.mesh`)
    B                           # rows, vertices by particles (`wsph.contact.surfaces.sparse`)
    mass, free                  # of the particles, (count,), (count, dim): 1 where a component of the velocity is free
    """

    n: int
    m: int
    struct: SurfaceArrays
    force: Array

    def __init__(
        self, name: str, system: SurfacedSystem, origin: np.ndarray, *, lagged: bool, domain: Domain = WHOLE
    ) -> None:
        """About `origin` (dim,) [m], which all bodies share. `lagged`: velocities are the ways of the last step over its
        length, for methods with one evaluation at the end of the step; otherwise those of the state that is evaluated.
        Raises Refused for a body without cells."""
        raise NotImplementedError

    def attend(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        """From now on bring up to date what laws read or write of some `vertices` and `faces`, rows: after every search, with
        those that are near anything. Not a launch of a step; between steps."""
        raise NotImplementedError

    def start(self, state: State) -> None:
        """Take a state as that at the start of the run: there is no work yet (launches)."""
        raise NotImplementedError

    def place(self, state: State) -> None:
        """Places, ways, velocities, areas and normals in a state; no forces yet (launches)."""
        raise NotImplementedError

    def spread(self, rate: State) -> None:
        """Add the accelerations of the forces to the rate of the particles' velocities (a launch)."""
        raise NotImplementedError

    def close(self, state: State) -> None:
        """Close a step that ends with the state that was last evaluated: its work, and where ways begin (launches)."""
        raise NotImplementedError

    def places(self) -> np.ndarray:
        """Where all vertices are now, on the host, about the origin, (n, dim)."""
        raise NotImplementedError

    def square(self, stiffness: np.ndarray) -> float:
        """A bound of omega^2 of springs at the vertices, `stiffness` (n,): the largest over the particles that are free of
        (1/m) sum_v |B_vj| k_v sum_l |B_vl|."""
        raise NotImplementedError

    def meets(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Which pairs of its own `vertices` and `faces` (k,) rows may meet, (k,) bool: not faces within two rings of the
        vertex, nor the other side of a thin wall."""
        raise NotImplementedError

    def resultant(self, force: Array | None = None) -> np.ndarray:
        """The sum of forces on the vertices, all of them or one law's `force` (n,) vec, on the host, (dim,)."""
        raise NotImplementedError

    @property
    def work(self) -> float:
        """Work of the forces on the particles so far."""
        raise NotImplementedError

    def eroded(self) -> np.ndarray | None:
        """Between steps: find out whether cells have died or parted; if so remake the surface, and return the row of every
        old vertex, -1 where it is gone, (old n,). None where nothing has changed. The caller attends again."""
        raise NotImplementedError

    def remesh(self, live: np.ndarray, parted: np.ndarray | None = None) -> np.ndarray:
        """Remake the surface: of the cells that are `live` (c,) bool, without those joins of cells that are `parted`
        (k, 2), pairs of cells. Returns the row of every old vertex, -1 where it is gone, (old n,)."""
        raise NotImplementedError

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        raise NotImplementedError

    def restored(self) -> None:
        """After these have been put back: what follows from them. The caller attends again."""
        raise NotImplementedError
