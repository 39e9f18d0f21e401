"""Forces between the surfaces of bodies, and on them from outside, as one coupling."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.arrays import host, put
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Share
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.contact.between import CoupledBody
from wsph.contact.surfaces.body import SurfacedSystem
from wsph.contact.surfaces.fields import surface_fields
from wsph.contact.surfaces.laws import Ground, Law, LawMaker
from wsph.contact.surfaces.reading import LawNumbers
from wsph.contact.surfaces.surface import Surface
from wsph.protocols import Entry, Stepped
from wsph.ranks.blocks import own_mean
from wsph.reporting import Reported
from wsph.scene.scene import Scene
from wsph.sph.skin import Skin
from wsph.units import Scales

SKIN = 0.4
"""Distance, in the largest spacing, that surfaces may come nearer before candidates are found again."""

FASTER, LEAST_SPEED = 3.0, 0.03
"""Between two looks at how far particles have gone they are taken to become so many times as fast as the fastest is, and as
this part of the fastest wave at least: what a strong shock does to a body at rest."""

NEVER, BREAKING = 10**6, 16
"""Steps until a look at surfaces that nothing is searched for, and at those of bodies that can break."""


@dataclass(frozen=True)
class _Velocity:
    velocity: Array


@dataclass(frozen=True)
class _Spare:
    """Rates that nobody reads, where forces are evaluated for their work alone."""

    struct: _Velocity


class Surfaces:
    """The surfaces of bodies and the laws that act on them.

    A search lasts until a particle has gone half of the skin; vertices and faces that nothing is near are left as they are
    until the next. The ledger has what laws hold (`contact_stored`), what friction and damping have taken
    (`contact_dissipated`), the work of tools, and as `contact_numerical` what the bodies have given beyond these: contacts
    that open and close inside of steps, depths that jumped away.
    """

    def __init__(
        self,
        surfaces: Mapping[str, Surface],
        systems: Mapping[str, SurfacedSystem],
        laws: Sequence[Law],
        ground: Ground,
    ):
        """Of bodies, by their names."""
        self.surfaces, self._systems, self.laws = dict(surfaces), systems, tuple(laws)
        self._searched = dict.fromkeys(side.name for law in self.laws if law.searches for side in law.sides)
        space, clock = ground.space, ground.clock
        self._clock, self._scales, self._due = clock, ground.scales, 0
        self._due_kept: Array = wp.zeros(1, dtype=wp.int32, device=clock.device)
        self._skin = SKIN * max(surface.spacing for surface in surfaces.values())
        own = {name: systems[name] for name in surfaces}
        self._skins = {name: Skin(space, each.count, clock, each.domain, each.share.own) for name, each in own.items()}
        self._spare: dict[str, State] = {}
        for name, each in own.items():
            rate = _Spare(_Velocity(wp.zeros(each.count, dtype=space.vec, device=clock.device)))
            self._spare[name] = cast(State, rate)
        self._read = [LawNumbers(law, space, clock) for law in self.laws if not law.rigid]
        self.rigid = {each.name: each for law in self.laws for each in law.rigid}
        self.ledger: tuple[Entry, ...] = (
            Entry("contact_stored", lambda: self.stored),
            Entry("contact_dissipated", lambda: self.dissipated),
            Entry("contact_numerical", lambda: self.numerical),
            Entry("external_work", lambda: self.work),
            *(entry for each in self.rigid.values() for entry in each.ledger),
        )
        self._find()

    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that have surfaces."""
        return tuple(self.surfaces)

    def members(self) -> dict[str, Stepped]:
        """Rigid bodies, which step beside the others."""
        return {name: each.member() for name, each in self.rigid.items()}

    @property
    def reported(self) -> tuple[Reported, ...]:
        """What of it people read numbers off."""
        return (*self._read, *self.rigid.values())

    def fields(self, body: str) -> Mapping[str, Callable[[], np.ndarray]]:
        """Pressure and gap on the surface of a body."""
        if body not in self.surfaces:
            return {}
        return surface_fields(self.surfaces[body], self.laws, self._scales)

    def _find(self, *, anew: bool = True) -> None:
        """Find the candidates of all laws: `anew` where the bodies are between steps, else where they were at the last
        search."""
        places: dict[str, np.ndarray] = {}
        for name, surface in self.surfaces.items():
            if anew:
                self._skins[name].found.assign(self._systems[name].state.struct.displacement)
            places[name] = surface.places(host(self._skins[name].found))
        everywhere = np.concatenate(list(places.values()))
        for each in self.rigid.values():
            each.find(everywhere)
        for law in self.laws:
            law.find(places, self._skin)
        self._attend()

    def _attend(self) -> None:
        near = [law.near() for law in self.laws]
        nothing = np.zeros(0, np.int64), np.zeros(0, np.int64)
        for name, surface in self.surfaces.items():
            rows = [each.get(name, nothing) for each in near]
            surface.attend(*(np.concatenate(part) for part in zip(*rows, strict=True)))

    def follow(self) -> bool:
        """Before a step, on the host: take what has broken, and find the candidates again if a particle can leave its skin
        by the end of it; whether either was so."""
        left = [each.has_left(0.5 * self._skin) for each in self.rigid.values()]
        self._due -= 1
        if not any(left) and self._due > 0:
            return False
        remade = self._renew({name: surface.eroded() for name, surface in self.surfaces.items()})
        if not remade and not any(left):
            self._due = self._steps_left()
            if self._due >= 1:
                return False
        self._find()
        self._due = max(self._steps_left(), 1)
        return True

    def _steps_left(self) -> int:
        """Steps that no particle can leave its skin in."""
        most = BREAKING if any(system.breaks for system in self._systems.values()) else NEVER
        if not self._searched:
            return most
        fields = {name: self._systems[name].state.struct for name in self._searched}
        gone = [self._skins[name].gone(each.displacement, each.velocity) for name, each in fields.items()]
        furthest, fastest = (max(each) for each in zip(*gone, strict=True))
        least = LEAST_SPEED * max(surface.wave_speed for surface in self.surfaces.values())
        steps = (0.5 * self._skin - furthest) / (self._clock.dt * max(FASTER * fastest, least))
        # What is not finite the finite check tells.
        return int(min(steps, most)) if np.isfinite(steps) else most

    def _renew(self, rows: Mapping[str, np.ndarray | None]) -> bool:
        """Tell the laws of surfaces that were remade; whether any was."""
        for name, kept in rows.items():
            if kept is not None:
                for law in self.laws:
                    if any(side.name == name for side in law.sides):
                        law.renew(self.surfaces[name], kept)
        return any(kept is not None for kept in rows.values())

    def start(self, states: Mapping[str, State]) -> None:
        """Take what is there at the start of the run (launches)."""
        self._place(states)
        for law in self.laws:
            law.start()
        self.push(states, self._spare)
        for name, surface in self.surfaces.items():
            surface.start(states[name])
        for name, each in self.rigid.items():
            each.start(states[name])

    def _place(self, states: Mapping[str, State]) -> None:
        for name, surface in self.surfaces.items():
            surface.bring(states[name])
        for name, surface in self.surfaces.items():
            surface.place(states[name])
        for name, each in self.rigid.items():
            each.place(states[name])

    def push(self, states: Mapping[str, State], rates: Mapping[str, State]) -> None:
        """Add the accelerations of the forces in a state to the rates (launches)."""
        self._place(states)
        for law in self.laws:
            law.act()
        for name, surface in self.surfaces.items():
            surface.spread(rates[name])
        for name, each in self.rigid.items():
            if name in rates:
                each.spread(rates[name])

    def close(self, states: Mapping[str, State], *, fresh: bool) -> None:
        """Close a step (launches): memory, works, and where the ways of the next one begin. Not `fresh`: the last evaluation
        was not of this state."""
        if not fresh:
            self.push(states, self._spare)
        for law in self.laws:
            law.close()
        for name, surface in self.surfaces.items():
            surface.close(states[name])
        for name, each in self.rigid.items():
            each.close(states[name])

    def bound(self, body: str) -> tuple[float, float]:
        """Bounds of omega^2 and of the rate of damping that are added to a body's, nondimensional."""
        if body not in self.surfaces:
            return 0.0, 0.0
        added = [law.bound(self.surfaces[body]) for law in self.laws]
        return sum(square for square, _ in added), sum(drag for _, drag in added)

    def stiffen(self, stiffness: float) -> bool:
        """Give a stiffness to the laws that a scene leaves it open for; whether there are any."""
        takes = [law.stiffen(stiffness) for law in self.laws]  # all of them, not the first that does
        return any(takes)

    @property
    def stored(self) -> float:
        """Energy that the laws hold, nondimensional."""
        return sum(law.stored for law in self.laws)

    @property
    def dissipated(self) -> float:
        """Energy that friction and damping have taken so far, nondimensional."""
        return sum(law.dissipated for law in self.laws)

    @property
    def work(self) -> float:
        """Work done from outside so far, by tools, nondimensional."""
        return sum(law.work for law in self.laws)

    @property
    def numerical(self) -> float:
        """What the bodies and the outside have given, less what is stored and dissipated, nondimensional."""
        given = self.work - sum(surface.work for surface in self.surfaces.values())
        given += sum(each.given for each in self.rigid.values())
        return given - self.stored - self.dissipated

    def kept(self) -> dict[str, Array]:
        """What a run goes on from, by name."""
        surfaces = {
            f"surface.{name}.{key}": a for name, each in self.surfaces.items() for key, a in each.kept().items()
        }
        laws = {f"law.{law.name}.{key}": a for law in self.laws for key, a in law.kept().items()}
        rigid = {f"rigid.{name}.{key}": a for name, each in self.rigid.items() for key, a in each.kept().items()}
        skins = {f"skin.{name}": each.found for name, each in self._skins.items()}
        put(self._due_kept, np.array([self._due]))
        return surfaces | laws | rigid | skins | {"surfaces.due": self._due_kept}

    def shares(self) -> dict[str, Share]:
        """The parts that this process has of kept arrays that processes share, by their names."""
        cut = [name for name in self.surfaces if self._systems[name].domain.size > 1]
        found = {f"skin.{name}": self._systems[name].share for name in cut}
        for name in cut:
            found |= {f"surface.{name}.{key}": share for key, share in self.surfaces[name].shares().items()}
        for law in self.laws:
            found |= {f"law.{law.name}.{key}": share for key, share in law.shares().items()}
        return found

    def as_kept(self, values: Mapping[str, np.ndarray]) -> None:
        """Have the surfaces that there were when `values` were kept."""
        own = {name: f"surface.{name}." for name in self.surfaces}
        parts = {
            name: {k.removeprefix(own[name]): values[k] for k in values if k.startswith(own[name])} for name in own
        }
        self._renew({name: surface.as_kept(parts[name]) for name, surface in self.surfaces.items()})

    def restored(self) -> None:
        """Find the candidates that there were where a run goes on: contacts that have opened are forgotten at searches, so
        these have to be those of the run that was not interrupted."""
        self._due = int(host(self._due_kept)[0])
        self._find(anew=False)


def coupled(
    scene: Scene,
    bodies: Sequence[CoupledBody],
    makers: Sequence[LawMaker],
    space: Space,
    scales: Scales,
    clock: Clock,
    once: bool,
) -> Surfaces | None:
    """The coupling of a scene's surfaces by the laws that `makers` find in it, None where there are none. `once`: a step
    evaluates forces once, at its end. Raises Refused."""
    if not (scene.contact or scene.tools):
        return None
    systems = {run.body.name: cast(SurfacedSystem, run.system) for run in bodies}
    origin = np.mean([own_mean(each.position, each.share, each.domain) for each in systems.values()], axis=0)
    surfaces: dict[str, Surface] = {}

    def surface(name: str) -> Surface:
        if name not in surfaces:
            surfaces[name] = Surface(name, systems[name], origin, lagged=once)
        return surfaces[name]

    domain = next((system.domain for system in systems.values() if system.domain.size > 1), WHOLE)
    ground = Ground(space, scales, clock, once, origin, domain)
    laws = [law for make in makers for law in make(scene, surface, ground)]
    return Surfaces(surfaces, systems, laws, ground) if laws else None
