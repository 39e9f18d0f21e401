"""Where the probes of fields of bodies that processes share read, and which process has all that is read there."""

# pyright: strict

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wsph.backend.domain import Domain, any_of
from wsph.errors import Fault, SceneError
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import on_grid
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
    lattice, domain = on_grid(body), body.split.domain
    if probe.points is not None:
        along = lattice.frame.coordinates(np.array(probe.points, float))[:, 0]
    else:
        places = own_places(body)
        along = lattice.frame.coordinates(places[select(probe.where or "", places, body.spacing)])[:, 0]
    low, high = along.min(initial=np.inf), along.max(initial=-np.inf)
    low, high = float(domain.min(np.array(low))), float(domain.max(np.array(high)))
    return (int(np.floor(low)), int(np.floor(high))) if low <= high else None


def _owner(layers: tuple[int, int], body: Geometry) -> int:
    """The process that owns the layer in the middle of some."""
    lattice = on_grid(body)
    share = body.split.nodes
    node, middle = np.rint(lattice.index[share.own, 0]), sum(layers) // 2
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
    most = max(int(on_grid(bare.geometry).frame.count[0]) // 2, LEAST)
    for k, probe in enumerate(scene.probes):
        layers = _layers(probe, bare.geometry) if read[k] else None
        if layers is None:
            continue
        if layers[1] - layers[0] > most:
            text = (
                f"reads {layers[1] - layers[0] + 1} layers of cells across the first axis, which one process has to hold: read at"
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
