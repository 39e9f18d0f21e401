"""The declarations of an integrator: sets and formulations, limit, and the calls that it takes beside its steps."""

# pyright: strict

import inspect
from collections.abc import Mapping, Sequence

from wsph.errors import PluginError
from wsph.protocols import Integrator

SIGNATURE = "a class with sets (1 or 2), formulations, order, __init__(self, system, **options), step(self), limit(self) -> (Courant number, reason) and state"


def check(plugin: type) -> None:
    """Raise PluginError where the declarations of an integrator's class are not what they are expected to be."""
    counts = {"sets": sets(plugin), "evaluations": getattr(plugin, "evaluations", 1)}
    for name, value in counts.items():
        if name == "evaluations" and isinstance(value, property):
            continue  # it depends on the options
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise PluginError(f"its {name} is {value!r}: a whole number from 1 on is expected")
    given: object = getattr(plugin, "formulations", ())
    if not isinstance(given, (tuple, list)):
        raise PluginError(f"its formulations are {given!r}: a tuple of names is expected")
    if not steps(plugin):
        raise PluginError("it has no step()")


def order(integrator: Integrator) -> float | None:
    """Its order in time, None where it declares none."""
    value: object = getattr(integrator, "order", None)
    return float(value) if isinstance(value, (int, float)) else None


def sets(plugin: type) -> int:
    """Number of the sets of particles that it works on."""
    return getattr(plugin, "sets", 1)


def offered(plugin: type, known: Sequence[str]) -> tuple[str, ...]:
    """The formulations that it works in, the default first: of the `known` ones the first, where it names none."""
    return tuple(getattr(plugin, "formulations", known[:1]))


def steps(plugin: type) -> bool:
    """Whether it has a step at all."""
    return callable(getattr(plugin, "step", None))


def evaluations(integrator: Integrator) -> int:
    """Right-hand sides in a step."""
    return int(getattr(integrator, "evaluations", 1))


def begin(integrator: Integrator) -> None:
    """Have it make what it keeps between steps from the state (launches): before the first step, and where the time step
    has changed."""
    if hasattr(integrator, "begin"):
        getattr(integrator, "begin")()  # noqa: B009


def publishes(integrator: Integrator | type) -> bool:
    """Whether it, or its class, keeps variables of its own, from which the state is made before it is read."""
    return hasattr(integrator, "publish")


def publish(integrator: Integrator) -> None:
    """Have the state made from the integrator's own variables (launches), where it keeps some."""
    if hasattr(integrator, "publish"):
        getattr(integrator, "publish")()  # noqa: B009


def fresh(integrator: Integrator) -> bool:
    """Whether the last evaluation of a step is of the state at its end."""
    return getattr(integrator, "fresh", False)


def once(plugin: type) -> bool:
    """Whether a step of an integrator's class evaluates the forces once, in the state at its end."""
    evaluations: object = getattr(plugin, "evaluations", None)
    return bool(getattr(plugin, "fresh", False)) and evaluations == 1


def oscillation(integrator: Integrator) -> float:
    """What the energy of a state is above that which the method keeps in stable steps, nondimensional: 0 where it says
    nothing of it."""
    return getattr(integrator, "oscillation")() if hasattr(integrator, "oscillation") else 0.0  # noqa: B009


def keeps(integrator: Integrator) -> bool:
    """Whether the method keeps the energy of undamped bodies, but for oscillations that are bounded."""
    return getattr(integrator, "symplectic", False)


def limit(integrator: Integrator) -> tuple[float | None, str]:
    """The largest stable Courant number, None where it declares none, and where it comes from. Raises PluginError where
    that is no number, or not a number."""
    if not hasattr(integrator, "limit"):
        return None, "the integrator declares none"
    value, reason = getattr(integrator, "limit")()  # noqa: B009
    if value is None:
        return None, str(reason)
    if isinstance(value, str) or not float(value) >= 0.0:
        raise PluginError(
            f"limit() gives {value!r}: a Courant number, 0 or above, is expected, or None where it is not known"
        )
    return float(value), str(reason)


def exact(integrator: Integrator) -> float | None:
    """The Courant number at which its steps are exact for waves, None where there is none."""
    return getattr(integrator, "exact")() if hasattr(integrator, "exact") else None  # noqa: B009


def automatic(plugin: type, options: Mapping[str, object]) -> list[str]:
    """The options that it is left to choose by itself: those that are "auto", as given or by default."""
    defaults = {name: each.default for name, each in inspect.signature(plugin).parameters.items()}
    return [name for name, value in {**defaults, **options}.items() if isinstance(value, str) and value == "auto"]
