"""What a law between surfaces, or of one with something outside, offers to the coupling that owns the surfaces."""

# pyright: strict

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.contact.surfaces.surface import Surface
from wsph.protocols import Entry, Stepped
from wsph.reporting import Term
from wsph.scene.scene import Scene
from wsph.units import Scales

Rows = NDArray[np.int64]
Near = Mapping[str, tuple[Rows, Rows]]
"""By the bodies' names, rows of vertices and of faces."""

Places = Mapping[str, NDArray[np.float64]]
"""By the bodies' names, where the vertices are, (n, dim), nondimensional."""


class Named(Protocol):
    """What has the `name` of a body."""

    @property
    def name(self) -> str: ...


class Rigid(Protocol):
    """A rigid body that steps beside the bodies whose surfaces laws act on. They act on it too: they add to its load."""

    name: str
    kind: str

    @property
    def numbers(self) -> Mapping[str, Sequence[Term]]:
        """Force, torque and work, as `wsph.reporting.Reported` has them."""
        ...

    def gather(self) -> None:
        """Bring them up to date, where steps do not (launches)."""
        ...

    def member(self) -> Stepped:
        """It, as integrators step it."""
        ...

    def place(self, state: State) -> None:
        """Where it is in a state; nothing acts on it yet (launches)."""
        ...

    def spread(self, rate: State) -> None:
        """Add the accelerations by its load to the rate of its velocities (launches)."""
        ...

    def start(self, state: State) -> None:
        """Take what is there at the start of a run, its load evaluated (launches)."""
        ...

    def close(self, state: State) -> None:
        """Close a step whose last evaluation was of a state: its work, and where ways begin (launches)."""
        ...

    def find(self, places: NDArray[np.float64]) -> None:
        """Candidates are found where it is now, on the host, for all vertices at their `places` (n, dim)."""
        ...

    def has_left(self, way: float) -> bool:
        """Whether a point of it beside the vertices has gone, or can go by the end of the step, further than a way since."""
        ...

    @property
    def given(self) -> float:
        """Work that it has done on what it meets so far, nondimensional."""
        ...

    @property
    def ledger(self) -> tuple[Entry, ...]:
        """Its entries of the energy ledger."""
        ...

    def kept(self) -> Mapping[str, Array]:
        """Device arrays that a run goes on from, by name."""
        ...


class Law(Protocol):
    """Forces on surfaces. In a step they may be evaluated many times; `act` is a function of the surfaces' motion and of
    what was kept at the end of the last step alone. What a law does not have is as here, where it is of this class."""

    name: str

    @property
    def sides(self) -> Sequence[Named]:
        """The surfaces that it acts on."""
        ...

    @property
    def rigid(self) -> tuple[Rigid, ...]:
        """The rigid bodies that it acts on."""
        return ()

    @property
    def searches(self) -> bool:
        """Whether what it finds lasts for a skin alone."""
        return True

    def find(self, places: Places, skin: float) -> None:
        """Find, on the host, what may be met before two surfaces have come nearer by `skin`."""

    def near(self) -> Near:
        """The vertices that its kernels read or write, with the faces around them, and the faces whose normals they read."""
        ...

    def start(self) -> None:
        """Take what there is at the start of a run (launches)."""

    def act(self) -> None:
        """Add its forces to those of the surfaces (launches)."""
        ...

    def close(self) -> None:
        """Take the memory of the last evaluation as that of the step (launches)."""

    def bound(self, surface: Surface) -> tuple[float, float]:
        """Bounds of omega^2 and of the rate of damping that it adds to the body of a surface, nondimensional."""
        ...

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness where the scene leaves it open; whether it does."""
        return False

    def renew(self, surface: Surface, rows: Rows) -> None:
        """A surface of its was remade: `rows` (old n,) are those of its old vertices, -1 where they are gone. Candidates
        are found after it."""
        ...

    @property
    def stored(self) -> float:
        """Energy that it holds now, nondimensional."""
        ...

    @property
    def dissipated(self) -> float:
        """Energy that it has taken so far, nondimensional."""
        ...

    @property
    def work(self) -> float:
        """Work done on it from outside so far, nondimensional."""
        return 0.0

    @property
    def pushes(self) -> Sequence[tuple[Array, float]]:
        """Arrays of forces of the last evaluation, vec, each with the factor that makes their sum that on its first
        surface; none of a body with itself."""
        return ()

    @property
    def energies(self) -> Sequence[Array]:
        """Arrays of what it stores and has dissipated, float64."""
        return ()

    def surface_gaps(self, surface: Surface) -> NDArray[np.float64]:
        """Gaps of a surface's vertices at the end of the last step, nondimensional, NaN where there is nothing to meet,
        (n,)."""
        return np.full(surface.n, np.nan)

    def force(self, surface: Surface) -> NDArray[np.float64]:
        """The sum of its forces on a surface at the last evaluation, nondimensional (dim,)."""
        ...

    def kept(self) -> Mapping[str, Array]:
        """Device arrays that a run goes on from, by name."""
        ...

    def shares(self) -> Mapping[str, Share]:
        """The parts of these that this process has, by their names, of those that processes share."""
        return {}

    def gather(self) -> None:
        """Have `pushes` and `energies` of all processes (on the host)."""


@dataclass(frozen=True)
class Ground:
    """What all laws of a scene share, with the `origin` of places (dim,) [m]. `once`: a step evaluates forces once, at its
    end. `domain`: the processes that share the scene."""

    space: Space
    scales: Scales
    clock: Clock
    once: bool
    origin: NDArray[np.float64]
    domain: Domain = WHOLE


LawMaker = Callable[[Scene, Callable[[str], Surface], Ground], Sequence[Law]]
"""Makes the laws of one kind from a scene, with the surfaces of bodies by their names. Raises Refused."""
