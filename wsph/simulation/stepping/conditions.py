"""When something is to be done in a run that Python steps: conditions on its state, as functions or in words.

"beam.von_mises > 300 MPa"     the largest (with <: the smallest) of a field over a body, any component or scalar of it
"tip.displacement_y < -1 mm"   the last record of a probe's column
"contact_ball-plate_z > 5 kN"  a column of history.csv: energies, reactions, forces of contacts and tools, time, step
"contact", "contact NAME"      a contact, or that of a name, has a force
"crack", "crack BODY"          a particle has lost half: a phase field of a half, or every other of its links
"""

# pyright: strict

import operator
import re
from collections.abc import Callable, Sequence

import numpy as np

from wsph.errors import WsphError
from wsph.output import fields
from wsph.scene.messages import nearest
from wsph.simulation.run import Running
from wsph.simulation.stepping.state import State
from wsph.units import quantity

Condition = Callable[[State], object]
"""Whether it holds in a state: what counts is whether it is true."""

BROKEN = 0.5
"""The damage of a crack: beside a plane that has parted a particle has lost about half of its links."""

_COMPARED = re.compile(r"(\S+)\s*(>=|<=|>|<)\s*(.+)")
_COMPARE = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}


def condition(said: str | Condition, running: Running, state: State) -> Condition:
    """The condition that words say of a run; a function as it is. `state`: a state of the run. Raises WsphError for words
    that name nothing there, or another unit."""
    if not isinstance(said, str):
        return said
    word, _, name = said.strip().partition(" ")
    if word == "contact":
        return _contact(name.strip(), state)
    if word == "crack":
        return _crack(name.strip(), state)
    found = _COMPARED.fullmatch(said.strip())
    if found is None:
        raise WsphError(f'{said!r} is no condition: "WHAT > VALUE", "contact", "crack", "end", "error", or a function')
    what, compare = found[1], _COMPARE[found[2]]
    read, unit = _read(what, compare in (operator.gt, operator.ge), running, state)
    try:
        value = quantity(found[3] if re.search(r"[^\d.eE+-]", found[3]) else float(found[3]), unit)
    except ValueError as error:
        raise WsphError(f"{said!r}: {error}") from None
    return lambda now: compare(read(now), value)


def _read(what: str, most: bool, running: Running, state: State) -> tuple[Callable[[State], float], str]:
    """The number that a name stands for, and its unit."""
    owner, _, name = what.partition(".")
    units = running.units
    values = _field(state, owner, name)
    recorded = name in units["probes"].get(owner, {})
    if values is not None and recorded:
        raise WsphError(f"{what!r} is a field of a body and a column of a probe: name one of them otherwise")
    if values is not None:
        if values.ndim > 1 and values.shape[1] > 1:
            raise WsphError(f"{what!r} is no scalar field: name a component, or a scalar such as {owner}.von_mises")
        extreme = np.max if most else np.min
        return lambda now: float(extreme(now[owner][name])), state[owner].unit(name)
    if recorded:
        return lambda now: running.latest(owner, name), units["probes"][owner][name]
    if what in state.numbers:
        return lambda now: now.numbers[what], units["history"][what]
    probes = [f"{probe}.{column}" for probe, columns in units["probes"].items() for column in columns]
    there = [*(f"{body}.{field}" for body in state.bodies for field in state[body].fields), *probes, *state.numbers]
    derived = [f"{body}.{field}" for body in state.bodies for field in fields.DERIVED]
    hint = nearest(what, [*there, *derived], "there is " + ", ".join(there))
    raise WsphError(f"{what!r} is nothing in this run; {hint}")


def _field(state: State, owner: str, name: str) -> np.ndarray | None:
    """A field of a body, None where there is no such body or field."""
    try:
        return state[owner][name]
    except KeyError:
        return None


def _contact(name: str, state: State) -> Condition:
    """Whether a contact has a force."""
    found = [re.fullmatch(r"contact_(.*)_[xyz]", key) for key in state.numbers]
    columns = [each[0] for each in found if each is not None and name in ("", each[1])]
    return _any(columns, "contact", name, lambda now: any(now.numbers[key] for key in columns))


def _crack(name: str, state: State) -> Condition:
    """Whether a body has a particle that has lost half."""
    bodies = [key for key, body in state.bodies.items() if "damage" in body.fields and name in ("", key)]
    return _any(bodies, "body that can crack", name, lambda now: any(now[b]["damage"].max() > BROKEN for b in bodies))


def _any(found: Sequence[str], what: str, name: str, made: Condition) -> Condition:
    if not found:
        raise WsphError(f"this scene has no {what}{f' {name!r}' if name else ''}")
    return made
