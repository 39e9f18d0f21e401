"""What a body begins with beside its velocity: an initial stress, or the state that it had in a checkpoint."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Iterator, Mapping

import numpy as np

from wsph.backend.domain import any_of
from wsph.constitutive.initial import INITIAL, stored_by
from wsph.constitutive.kept import STORED
from wsph.errors import Refused
from wsph.expressions import Expression
from wsph.formulations.reading import Reading
from wsph.formulations.system import System
from wsph.scene.scene import Scene
from wsph.scene.tables import Body

OUTSIDE = 1e-9
"""Part of the largest stress by which a return to the yield surface may change an initial one: roundings of values on it."""


def refuse_initial(body: Body) -> None:
    """Refuse to begin a body with a stress or a state that cannot be told to all its parts."""
    breaking = [key for key, part in body.parts.items() if part.acts and part.breaks]
    if body.initial is not None and breaking:
        raise Refused(
            f"body {body.name!r}: initial goes with no {breaking[0]}: what breaks measures energies and strains from a body"
            f" without stress; bring the load on in the run, or leave bodies.{breaking[0]} out"
        )


def put_stress(scene: Scene, body: Body, system: System) -> None:
    """Give a system its initial stress, at the points where stresses stand. Raises Refused for one that is not finite, or
    that its law does not allow."""
    asked: Mapping[str, float | str] = body.initial.stress if body.initial is not None else {}
    if not asked:
        return
    state, constitutive = system.state, system.constitutive
    places = Reading(system).where("stress")
    stress = np.zeros((len(places), constitutive.width))
    for component, value in asked.items():
        made = scene.value(value, "Pa")
        assert isinstance(made, Expression)
        stress[:, constitutive.state.labels.index(component)] = made(places) / system.scales.stress
    if any_of(system.domain, not np.isfinite(stress).all()):
        raise Refused(f"body {body.name!r}: its initial stress is not finite")
    if INITIAL in state.layout:
        state.write(INITIAL, stress)
        return
    state.write("stress", stress)
    names = list(constitutive.internals)
    if STORED in names:
        internals = state.read("internals")
        internals[:, names.index(STORED)] = stored_by(constitutive, stress)
        state.write("internals", internals)
    _refuse_outside(body, system, places)


def _refuse_outside(body: Body, system: System, places: np.ndarray) -> None:
    """Refuse an initial stress that the law brings back to its yield surface."""
    state = system.state
    before: np.ndarray = state.buffer.numpy().copy()
    stress = state.read("stress")
    system.project(state)
    moved = np.abs(state.read("stress") - stress).max(1)
    state.buffer.assign(before)
    largest = float(system.domain.max(np.abs(stress).max(keepdims=True)).max())
    outside = np.flatnonzero(moved > OUTSIDE * largest)
    if len(outside):
        place = ", ".join(f"{x:.4g}" for x in places[outside[0]])
        raise Refused(
            f"body {body.name!r}: its initial stress at ({place}) m is beyond the yield surface of {body.material.model}: give"
            " one that the law allows"
        )


def initial_in_words(body: Body, system: System) -> Iterator[str]:
    """What a body begins with beside its velocity."""
    if body.initial is None:
        return
    if body.initial.file is not None:
        yield f"the state of {system.name!r} in {body.initial.file}"
    state, labels = system.state, system.constitutive.state.labels
    about = INITIAL in state.layout
    values = state.read(INITIAL if about else "stress") * system.scales.stress
    for component in body.initial.stress if about or body.initial.file is None else ():
        low, high = (float(f(values[:, labels.index(component)])) for f in (np.min, np.max))
        yield f"stress {component} " + (f"{low:.4g} Pa" if low == high else f"{low:.4g} to {high:.4g} Pa")
