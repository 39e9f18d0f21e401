"""What every system of a body has: where its particles are, its states, its prescribed values."""

from typing import Any

import numpy as np
import warp as wp

from wsph.backend.state import Layout, State
from wsph.boundary.values import BoundaryValues
from wsph.constitutive.constitutive import project_kernel
from wsph.formulations.setup import Setup, Traits
from wsph.parts.body_force import BodyForce
from wsph.protocols import Entry


class System:
    """A body as integrators see it; the systems of one and of two sets add their rates.

    `position` (n, dim) [m] of the particles that carry the state in the reference configuration, `spacing` [m], `volume`
    (n,) and `density` nondimensional, `state`, `boundary` and `work` (external work so far).
    """

    formulation = ""
    traits = Traits()
    damage_model = ""
    """How the body breaks (`wsph.scene.damage_model`): where it can, its state carries a damage."""
    position: np.ndarray
    volume: np.ndarray
    state: State
    boundary: BoundaryValues
    work: Any
    force: BodyForce

    def __init__(self, setup: Setup):
        self.space, self.lattice, self.constitutive = setup.space, setup.lattice, setup.constitutive
        self.scales, self.clock, self.device = setup.scales, setup.clock, setup.device
        self.spacing, self.density = setup.lattice.spacing, setup.constitutive.density
        self._states: list[State] = []

    def follow(self) -> bool:
        """Before a step: bring up to date what follows the motion; whether that changed what launches take."""
        return False

    def start_works(self) -> None:
        """Take the powers of the state as it is: those at the start of the run."""
        self.work.start(self.state, self.clock)
        self.force.start(self.state, self.clock)

    def hold(self, state: State, c: float | tuple[float, float]) -> None:
        """The same in a state that is to go on from there: where faces have axes of their own, in those."""
        self.impose(state, c)

    @property
    def point_volume(self) -> np.ndarray:
        """Volumes of the points that carry the stress, (m,), nondimensional: the particles, unless it has places of its
        own."""
        return self.volume

    def refresh(self, state: State) -> None:
        """Make up to date what is derived from a state, where anything is (launches)."""

    def hourglass_energy(self) -> float:
        """Energy of what holds spurious modes, nondimensional."""
        return 0.0

    @property
    def fracture_energy(self) -> float:
        """Energy that fracture has taken so far, nondimensional."""
        return 0.0

    def fracture(self) -> dict[str, float]:
        """What has broken, where a body can."""
        return {}

    @property
    def drag_energy(self) -> float:
        """Energy that viscosity has taken so far, nondimensional."""
        return 0.0

    @property
    def ledger(self) -> tuple[Entry, ...]:
        """What the body brings to the energy ledger, beside the energies that its state has."""
        return (
            Entry("dissipated", lambda: self.force.damped),
            Entry("dissipated", lambda: self.drag_energy),
            Entry("dissipated", lambda: self.fracture_energy),
            Entry("hourglass", self.hourglass_energy),
            Entry("external_work", lambda: self.work.total),
            Entry("external_work", lambda: self.force.gravity_work),
        )

    @property
    def count(self) -> int:
        """Particles that carry the state."""
        return len(self.position)

    def _make(self, n: int, layout: Layout, counts: dict[str, int] | None = None) -> State:
        """A state of `n` points, zero but for the internals' initial values."""
        state = State(self.space, n, layout, self.device, counts)
        self._initial_internals(state)
        self._states.append(state)
        return state

    def kept(self) -> dict[str, wp.array]:
        """The arrays that a run goes on from: states, the integrator's too, and works."""
        found = {f"state{k}": state.buffer for k, state in enumerate(self._states)}
        for name, works in (("work", self.work), ("force", self.force)):
            found |= {f"{name}.{part}": array for part, array in works.kept().items()}
        return found

    def restored(self) -> None:
        """Make what follows from the kept arrays, after they have been put back."""

    def clear_scratch(self) -> None:
        """Every state but the body's own as it was made."""
        for state in self._states:
            for buffer in (state.buffer, *([state.source.buffer] if state.source is not None else [])):
                if state is not self.state:
                    buffer.zero_()
            if state is not self.state:
                self._initial_internals(state)

    def _initial_internals(self, state: State) -> None:
        if self.constitutive.internals:
            values = list(self.constitutive.internals.values())
            state.write("internals", np.tile(values, (state.counts["internals"], 1)))

    def impose(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed values in a state at t + c dt; c = (0., 1.) means the mean of both ends of the step."""
        self.boundary.impose(state, self.clock, c)

    def project(self, state: State) -> None:
        """Bring the stresses of a state back to where the law allows them (a launch, where the law has a yield surface)."""
        laws = self.constitutive.laws
        if laws.project is not None:
            kernel = project_kernel(self.space, laws, state.type)
            self.clock.launch(kernel, state.counts["stress"], [self.constitutive.params], [state.struct])

    def current_position(self) -> np.ndarray:
        """Where the particles are, (n, dim) [m]: the reference configuration where nothing follows their displacement."""
        if "displacement" not in self.state.widths:
            return self.position
        return self.position + self.filtered("displacement") * self.scales.length

    def filtered(self, name: str) -> np.ndarray:
        """A field as frames carry it, (n, width), nondimensional."""
        return self.state.read(name)

    def current_density(self) -> np.ndarray:
        """rho_0/J of every particle, (n,), nondimensional; rho_0 where the formulation evolves no deformation."""
        if "deformation" not in self.state.widths:
            return np.full(self.count, self.density)
        F = np.eye(self.space.dim) + self.state.read("deformation").reshape(-1, self.space.dim, self.space.dim)
        return self.density / np.linalg.det(F)

    @property
    def host_bytes(self) -> int:
        """Memory of the lattice and of what else stays on the host as arrays [bytes]; each once, however many see it."""
        owners = {}
        for holder in (self, self.lattice, self.lattice.faces):
            for array in (value for value in vars(holder).values() if isinstance(value, np.ndarray)):
                owner = array if array.base is None or not isinstance(array.base, np.ndarray) else array.base
                owners[id(owner)] = owner.nbytes
        return sum(owners.values())

    @property
    def state_bytes(self) -> int:
        """Device memory of all states, the integrator's too [bytes]."""
        derived = self.state.derived.buffer.capacity if self.state.derived is not None else 0
        return derived + sum(state.nbytes for state in self._states)
