"""Where the probes of fields of bodies that processes share read, and which process has all that is read there."""

# pyright: strict

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wsph.backend.domain import Domain, any_of
from wsph.errors import Fault, SceneError
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice
from wsph.geometry.selection import select
from wsph.scene.probes import Probe
from wsph.scene.scene import Scene
from wsph.simulation.composing.setting import BareBody
from wsph.simulation.probing.read_in import own_places, read_by

AROUND = 7
"""Layers around a place that what is read there may be made of."""

LEAST = 32
"""Layers that a probe may always read over; of a longer body, half of them."""


def _layers(probe: Probe, body: Geometry) -> tuple[int, int] | None:
    """The first and the last layer of cells that a probe reads in; None where it selects nothing."""
    domain, places = body.split.domain, own_places(body)
    bent = body if isinstance(body, Lattice) and body.mapped else None
    if probe.points is None:
        chosen = select(probe.where or "", places, body.spacing)
        along = body.across(places[chosen]) if bent is None else _along(bent)[chosen]
    elif bent is not None:
        along = _nearest(np.array(probe.points, float), places, _along(bent), domain)
    else:
        along = body.across(np.array(probe.points, float))
    low, high = along.min(initial=np.inf), along.max(initial=-np.inf)
    low, high = float(domain.min(np.array(low))), float(domain.max(np.array(high)))
    return (int(np.floor(low)), int(np.floor(high))) if low <= high else None


def _along(lattice: Lattice) -> np.ndarray:
    """Where its own nodes and cells are across the first axis of the grid [cells]."""
    cells = lattice.index[lattice.corners, 0].mean(1)
    return np.concatenate([lattice.index[lattice.split.nodes.own, 0], cells[lattice.split.points.own]])


def _nearest(points: np.ndarray, places: np.ndarray, along: np.ndarray, domain: Domain) -> np.ndarray:
    """Of each point (k, dim) where the nearest of all processes' `places` (n, dim) is `along` (n,) the grid, (k,)."""
    found = np.zeros((len(points), 2))
    for k, point in enumerate(points):
        away = np.linalg.norm(places - point, axis=1)
        found[k] = away.min(), along[away.argmin()]
    whole = domain.joined(found[None])
    return whole[whole[:, :, 0].argmin(0), np.arange(len(points)), 1]


def _owner(layers: tuple[int, int], body: Geometry) -> int:
    """The process that owns the layer in the middle of some."""
    node, middle = body.node_layer[body.split.nodes.own], sum(layers) // 2
    nearest = np.abs(node - middle).min(initial=np.inf)
    return int(body.split.domain.joined(np.array([nearest])).argmin())


def reach_probes(scene: Scene, bare: Sequence[BareBody], domain: Domain) -> list[BareBody]:
    """Bodies whose parts here have around the places of probes whatever is read for them. Raises SceneError for a probe that
    reads all along a body that processes share."""
    if domain.size == 1:
        return list(bare)
    geometries = [each.geometry for each in bare]
    of = [read_by(probe, f"probes.{k}", bare, geometries) for k, probe in enumerate(scene.probes)]
    return [_reaching(scene, each, [each in some for some in of]) for each in bare]


def _reaching(scene: Scene, bare: BareBody, read: Sequence[bool]) -> BareBody:
    """A body with what is around the places of those of the probes that it is `read` by."""
    domain = bare.geometry.split.domain
    if domain.size == 1:
        return bare
    wanted = [bare.geometry.split.layers]
    most = max(bare.geometry.layer_count // 2, LEAST)
    for k, probe in enumerate(scene.probes):
        layers = _layers(probe, bare.geometry) if read[k] else None
        if layers is None:
            continue
        if layers[1] - layers[0] > most:
            text = (
                f"reads {layers[1] - layers[0] + 1} layers of cells across the axis that it is cut along, which one process has to hold: read at"
                " most half of the body, or start the run without mpiexec"
            )
            raise SceneError("scene", [Fault(0, f"probes.{k}", text)])
        if _owner(layers, bare.geometry) == domain.rank:
            wanted.append((layers[0] - AROUND, layers[1] + 1 + AROUND))
    low, high = (of(each) for of, each in zip((min, max), zip(*wanted, strict=True), strict=True))
    if not any_of(domain, (low, high) != bare.geometry.split.layers):
        return bare
    return replace(bare, geometry=bare.geometry.wider((low, high)))


def keeper(probe: Probe, geometries: Sequence[Geometry]) -> int:
    """The process that records a probe of one of some bodies: the first where none has its places, which says so."""
    for geometry in geometries:
        if geometry.split.domain.size > 1:
            layers = _layers(probe, geometry)
            if layers is not None:
                return _owner(layers, geometry)
    return 0
