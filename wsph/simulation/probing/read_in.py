"""Which of the bodies of a scene a probe of fields reads in, of those that processes share too."""

# pyright: strict

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

from wsph.backend.domain import any_of
from wsph.errors import Fault, SceneError
from wsph.geometry.geometry import Geometry
from wsph.geometry.selection import select
from wsph.scene.probes import Probe
from wsph.scene.tables import Body


class Tabled(Protocol):
    """What has the table of a body."""

    @property
    def body(self) -> Body: ...


B = TypeVar("B", bound=Tabled)


def inside(body: Body, geometry: Geometry, points: np.ndarray) -> np.ndarray:
    """Which points (n, dim) [m] lie in a body, or in the part of its cells that is here, (n,) bool."""
    if geometry.mapped or body.shape is None:
        return geometry.holds(points)
    # Steps of a cell reach beyond the shape, and a face of triangles may leave out what lies on it.
    found = body.shape.contains(points)
    found[~found] = geometry.holds(points[~found])
    return found


def own_places(geometry: Geometry) -> np.ndarray:
    """Nodes and cells that a process owns, (n, dim) [m]."""
    split = geometry.split
    return np.concatenate([geometry.nodes[split.nodes.own], geometry.cells[split.points.own]])


def _reads(probe: Probe, body: Body, geometry: Geometry) -> bool:
    """Whether a probe reads in a body: all processes that share it ask together."""
    domain = geometry.split.domain
    if probe.points is not None:
        here = inside(body, geometry, np.array(probe.points, float))
        return bool(domain.max(here.astype(np.int64)).all())
    return any_of(domain, bool(select(probe.where or "", own_places(geometry), geometry.spacing).any()))


def read_by(probe: Probe, key: str, bodies: Sequence[B], geometries: Sequence[Geometry]) -> list[B]:
    """The bodies that a probe may be of: the one that it reads in, where it names none; all of them where it reads in none,
    which its recorder says. Raises SceneError where it reads in several."""
    named = [k for k, each in enumerate(bodies) if probe.of is None and probe.body in (None, each.body.name)]
    found = [k for k in named if len(named) == 1 or _reads(probe, bodies[k].body, geometries[k])]
    if len(found) > 1:
        names = ", ".join(repr(bodies[k].body.name) for k in found)
        at = "at" if probe.points is not None else "where"
        raise SceneError("scene", [Fault(0, f"{key}.{at}", f"lies in {names}: name one with `body`")])
    return [bodies[k] for k in found or named]
