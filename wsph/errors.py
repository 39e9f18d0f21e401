"""Errors, by whose fault they are. Nothing here exits the process: the command line maps these to exit codes."""

# pyright: strict

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any


class WsphError(Exception):
    """Base of every error that wsph raises on purpose."""


@dataclass(frozen=True, order=True)
class Fault:
    """One fault of a scene: where it stands and what would be right."""

    line: int
    key: str
    message: str

    def __str__(self) -> str:
        place = f"line {self.line}: " if self.line else ""
        return f"{place}{self.key}: {self.message}" if self.key else f"{place}{self.message}"


class SceneError(WsphError):
    """Every fault of a scene at once. `faults` holds them in the order of the file."""

    def __init__(self, source: str, faults: list[Fault]):
        self.source = source
        self.faults = sorted(set(faults))
        super().__init__("\n".join(f"{source}: {fault}" for fault in self.faults))

    def __reduce__(self):
        return SceneError, (self.source, self.faults)


class Refused(WsphError):
    """A valid scene whose composition cannot be run: beyond a stability limit, a singular correction, ..."""


class PluginError(WsphError):
    """A plugin that cannot be loaded or breaks its contract; the message names it and its distribution."""


class OutputError(WsphError):
    """An output folder that cannot be used."""


class CheckpointError(WsphError):
    """A checkpoint that is not whole, or of another scene."""


class Unstable(WsphError):
    """A run that left the numbers it can vouch for.

    Attributes: `step`, `time` [s], `dt` [s], `field` (what went wrong), `particle` (id, or -1 where the whole
    body is meant), `position` [m] and `limit` (the stability limit of the time step as a Courant number, or None).
    """

    def __init__(
        self,
        message: str,
        *,
        step: int,
        time: float,
        dt: float,
        field: str,
        particle: int = -1,
        position: Iterable[float] = (),
        limit: float | None = None,
    ):
        super().__init__(message)
        self.step, self.time, self.dt = step, time, dt
        self.field, self.particle, self.position, self.limit = field, particle, tuple(position), limit

    def __reduce__(self):
        return _unstable, (str(self), dict(vars(self)))


def _unstable(message: str, values: Mapping[str, Any]) -> Unstable:
    return Unstable(message, **values)


_NO_MEMORY = ("Failed to allocate", "failed to map segment", "Cannot allocate memory")
"""What Warp says where it cannot allocate an array, and the system where it cannot load a library."""


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an error says that memory has come to its end, on the host or on a device."""
    said = f"{error} {error.__cause__}"
    kinds = (RuntimeError, ImportError, OSError)
    return isinstance(error, MemoryError) or (isinstance(error, kinds) and any(words in said for words in _NO_MEMORY))
