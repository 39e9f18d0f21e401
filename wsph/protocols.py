"""Small protocols by which rooms and plugins see each other, without the classes that meet them."""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Traits:
    """The abilities of a formulation, and the duties of a run towards it."""

    one_set: bool = False
    """Whether particles of one set carry the whole motion."""
    pairwise: bool = False
    """Whether those particles are their own stress points."""
    reference: bool = False
    """Whether pairs and weights are those of the reference configuration."""
    stabilisation: float = 1.0
    """Stiffness against the misfit of a linear field to the displacements, by default, in Young's moduli."""
    support: float = 2.6
    """Support by default [spacings]."""
    jittered: float = 2.6
    """That of bodies whose nodes have been moved, in two and three dimensions."""
    supports: tuple[float, float] = (0.0, 4.0)
    """Smallest and largest support that a scene may name [spacings]: beyond them a linear motion has no uniform stress
    beside the faces, or nobody has looked."""
    needs_rate: bool = False
    """Whether a material has to give a rate law."""
    small_strain: bool = False
    """Whether particles stay where they are: no deformation is followed, and nothing turns."""
    maps: bool = False
    """Whether cells may differ in size and direction."""
    edges: bool = False
    """Whether its particles can stand on the faces, with pairs along the edges of the cells."""
    corners: bool = False
    """Whether its points see the corners of their own cells alone, unless a scene asks for a kernel's pairs."""
    splits_cracks: bool = False
    """Whether cracks part the particles on them, and so have to run along lines of the grid."""
    pairs_follow: bool = False
    """Whether pairs follow the motion on the host: `System.follow` before every step."""
    courant_follows: bool = False
    """Whether a particle's own Courant number follows its deformation."""
    measures: bool = False
    """Whether its limit is found from its right-hand sides, and can be found again about a deformed state."""
    tried: bool = False
    """Whether the guard tries the step of a jittered body for modes that grow: collocation can have some."""
    clumps: bool = False
    """Whether modes of neighbouring particles can grow about a stretched state."""
    cuts: bool = False
    """Whether the forces between its particles alone can be asked for: those through a plane."""
    pushable: bool = False
    """Whether interactions between bodies may change the velocities of its particles between steps."""

    def with_(self, **changes: object) -> "Traits":
        """The same with some of them changed."""
        return replace(self, **changes)


AnyState = Any
"""A state of a system: made by its `new`, changed by its calls, never looked into by an integrator."""


class Material(Protocol):
    """A material: its `density` [kg/m3] and its `moduli`, bulk and shear [Pa]; what else it has is asked in
    `wsph.plugins.traits`."""

    @property
    def density(self) -> float: ...

    def moduli(self) -> tuple[float, float]: ...


class DeviceArray(Protocol):
    """An array on the device."""

    def numpy(self) -> np.ndarray: ...

    def assign(self, src: np.ndarray) -> None: ...


class Resettable(Protocol):
    """Device arrays, as they are put back after a trial of steps."""

    def reset(self) -> None: ...


class Fast(Protocol):
    """The units of a run, of which a `velocity` [m/s] is one."""

    @property
    def velocity(self) -> float: ...


class Waving(Protocol):
    """What waves run through, at `wave_speed` [m/s]: a material in a stress state."""

    @property
    def wave_speed(self) -> float: ...


class BodyTable(Protocol):
    """A body, as its table in a scene says it: its `name` and its `jitter` [spacings]."""

    @property
    def name(self) -> str: ...

    @property
    def jitter(self) -> float: ...


class BodySystem(Protocol):
    """The system of a body, as others see it: the name of its formulation and what that can do, its units, its number of
    particles, their density, nondimensional, its state and its device arrays."""

    @property
    def formulation(self) -> str: ...

    @property
    def traits(self) -> Traits: ...

    @property
    def scales(self) -> Fast: ...

    @property
    def count(self) -> int: ...

    @property
    def density(self) -> float: ...

    @property
    def state(self) -> AnyState: ...

    @property
    def arrays(self) -> Resettable: ...

    def start_works(self) -> None: ...


class LimitedBody(Protocol):
    """A body in a run, as the guard of its time step sees it: the Courant number of its steps (`courant`), the largest one
    that is stable, None where it is not known (`limit`), where that comes from (`limit_reason`), and the longest time steps
    that its material and its parts can take [s], by their names (`longest_steps`)."""

    @property
    def body(self) -> BodyTable: ...

    @property
    def system(self) -> BodySystem: ...

    @property
    def integrator(self) -> "Integrator": ...

    @property
    def constitutive(self) -> Waving: ...

    @property
    def courant(self) -> float: ...

    @property
    def limit(self) -> float | None: ...

    @property
    def limit_reason(self) -> str: ...

    @property
    def longest_steps(self) -> dict[str, float]: ...


class Integrator(Protocol):
    """An integrator as a run calls it; its optional members are asked for in `wsph.plugins.integrators`."""

    order: int
    """Its order in time."""

    def step(self) -> None:
        """One step of its system's state, by launches alone."""
        ...


class Limited(Protocol):
    """A system, as the limit of its time step sees it: its `evaluations` are the rates of velocities asked for so far."""

    evaluations: int

    @property
    def frequency(self) -> float:
        """The largest frequency of its small motions, nondimensional."""
        ...

    @property
    def growth(self) -> float:
        """The largest growth rate of a small motion that does not oscillate, nondimensional."""
        ...

    def forget_motions(self) -> None:
        """Forget what is known of the small motions: the next question is about the current state."""
        ...


@dataclass(frozen=True)
class Entry:
    """An entry of the energy ledger: what it has come to so far, nondimensional, and the column of history.csv that it is
    counted in. The column "external_work" is what is done on the bodies; the residual is it less all others."""

    column: str
    value: Callable[[], float]


class Dimensioned(Protocol):
    """Where a body is: in 1, 2 or 3 dimensions."""

    @property
    def dim(self) -> int: ...


class Stability(Protocol):
    """A body, as the limit of an integrator's time step sees it: its small motions about the current state,
    nondimensional. Read by `wsph.stability.regions`."""

    @property
    def space(self) -> Dimensioned:
        """Its dimensions."""
        ...

    @property
    def frequency(self) -> float:
        """The largest omega of its small motions."""
        ...

    @property
    def modes(self) -> NDArray[np.complex128]:
        """lambda of motions exp(lambda t), (k,) complex: the outermost of them and some tens of others."""
        ...

    @property
    def damped(self) -> bool:
        """Whether small motions are damped: by viscosity, or in proportion to mass."""
        ...

    @property
    def irregular(self) -> bool:
        """Whether its cells differ in size, so that modes keep to a few particles."""
        ...

    @property
    def stabilisation(self) -> float:
        """Stiffness against the misfit of a linear field to the displacements; it moves the fastest modes to where they are
        damped well."""
        ...

    def largest(self, dt: float, factor: float) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D, stiffness and damping, an upper estimate."""
        ...

    def courant(self, product: float) -> float:
        """The Courant number at which omega dt = `product` for its fastest wave."""
        ...


Terms = list[tuple[float, AnyState]]
"""Coefficients, and the states or rates that they multiply."""


class Timed(Protocol):
    """The clock of a run, as an integrator sees it."""

    @property
    def dt(self) -> float:
        """The time step, nondimensional."""
        ...


class LawForm(Protocol):
    """The form of a composition's forces, as an integrator may ask for it."""

    @property
    def total(self) -> bool:
        """Whether the law gives the stress of a deformation, so that stresses follow from the displacements."""
        ...


class Stepped(Protocol):
    """What integrators on one set of particles step: calls over flat states, which are launches alone. Between steps
    `kinetic` is sum m |v|^2/2 over the free components of a state's velocity, on the host."""

    @property
    def state(self) -> AnyState:
        """What a step advances."""
        ...

    def new(self) -> AnyState:
        """A state, zero but for the internals' initial values."""
        ...

    def rate(self, state: AnyState, out: AnyState, part: str = "all", ahead: float = 0.0) -> None:
        """`out` = the time derivative of `state`: of its "velocity", of the "rest", or of "all"."""
        ...

    def combine(
        self,
        out: AnyState,
        plain: Terms,
        timed: Terms | None = None,
        squared: Terms | None = None,
        part: str = "all",
    ) -> None:
        """`out` = sum of c x over `plain` + dt times that of c k over `timed` + dt^2 c k of `squared`."""
        ...

    def drift(self, state: AnyState, k: AnyState, c: float, ahead: float = 0.0) -> None:
        """All of `state` but its velocity goes on by c dt; what `k` holds of the rest after it is undefined."""
        ...

    def impose(self, state: AnyState, c: float | tuple[float, float]) -> None:
        """Set the prescribed values at t + c dt; (a, b) is the mean of those at t + a dt and t + b dt."""
        ...

    def constrain(self, state: AnyState, c: float | tuple[float, float]) -> None:
        """`impose` on the state that goes on from there, in the middle of a step."""
        ...

    def project(self, state: AnyState) -> None:
        """Bring the stresses back to where the law allows them."""
        ...

    def kinetic(self, state: AnyState) -> float:
        """Kinetic energy of a state, nondimensional (a copy from the device)."""
        ...

    def accept(self, state: AnyState) -> None:
        """Close the step: the last call, on a state that has not been imposed on since it was advanced."""
        ...


class OneSet(Stability, Stepped, Protocol):
    """A body as integrators on one set of particles see it."""

    @property
    def clock(self) -> Timed:
        """The clock of the run; it goes on after all bodies have stepped."""
        ...

    @property
    def bar_time(self) -> float:
        """The spacing over sqrt(E/rho), nondimensional."""
        ...

    @property
    def viscous(self) -> bool:
        """Whether there are forces that depend on velocities, beside damping in proportion to mass."""
        ...

    @property
    def moved(self) -> bool:
        """Whether a velocity other than zero is prescribed."""
        ...

    @property
    def held(self) -> bool:
        """Whether a velocity is prescribed anywhere, zero included."""
        ...

    @property
    def projects(self) -> bool:
        """Whether its law has a yield surface, so that `project` changes a state."""
        ...

    @property
    def form(self) -> LawForm:
        """How its forces are found."""
        ...


class TwoSets(Protocol):
    """A body as integrators on two sets of particles see it: "real" ones, which carry the state, and "virtual" ones."""

    @property
    def state(self) -> AnyState:
        """What a step advances, at the real particles."""

    @property
    def space(self) -> Dimensioned:
        """Its dimensions."""
        ...

    @property
    def second_moment(self) -> float:
        """Smallest second moment of the weights that interpolate to virtual particles, in spacings squared."""
        ...

    def new(self, where: str = "real") -> AnyState:
        """A state, zero but for the internals' initial values, at the "real" or at the "virtual" particles."""

    def half_step(self, source: AnyState, out: AnyState, weight: float) -> None:
        """Virtual `out` = interpolated real `source` + weight dt times the rate there."""

    def rate(self, source: AnyState, out: AnyState, *, imposed: AnyState, weight: float) -> None:
        """Real `out` += weight dt times the rate from virtual `source`, prescribed components taken from `imposed`."""

    def impose(self, state: AnyState, c: float | tuple[float, float]) -> None:
        """Set the prescribed values at t + c dt; (0, 1) is the mean of both ends of the step."""

    def project(self, state: AnyState) -> None:
        """Bring the stresses back to where the law allows them."""

    def accept(self, state: AnyState) -> None:
        """Close the step: the last call, on a state that has not been imposed on since it was advanced."""
