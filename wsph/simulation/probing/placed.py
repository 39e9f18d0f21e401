"""Probes of a scene that processes share: each of fields is recorded by the process that has its places."""

# pyright: strict

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import Domain
from wsph.errors import Fault, SceneError
from wsph.geometry.lattice import on_grid
from wsph.geometry.selection import select
from wsph.reporting import Reported
from wsph.scene.probes import Probe
from wsph.scene.scene import Scene
from wsph.simulation.composing.setting import BareBody
from wsph.simulation.probing.numbers import WORK, Numbers, column, components, scale
from wsph.simulation.probing.points import Probed
from wsph.simulation.probing.recorder import Recorder
from wsph.units import Scales

AROUND = 7
"""Layers around a place that what is read there may be made of."""

LEAST = 32
"""Layers that a probe may always read over; of a longer body, half of them."""


def _layers(probe: Probe, lattice: object, domain: Domain) -> tuple[int, int] | None:
    """The first and the last layer of cells that a probe reads in; None where it selects nothing."""
    body = on_grid(lattice)  # pyright: ignore[reportArgumentType]
    if probe.points is not None:
        along = body.frame.coordinates(np.array(probe.points, float))[:, 0]
    else:
        split, text = body.split, probe.where or ""
        places = np.concatenate([body.nodes[split.nodes.own], body.cells[split.points.own]])
        along = body.frame.coordinates(places[select(text, places, body.spacing)])[:, 0]
    low, high = along.min(initial=np.inf), along.max(initial=-np.inf)
    low, high = float(domain.min(np.array(low))), float(domain.max(np.array(high)))
    return (int(np.floor(low)), int(np.floor(high))) if low <= high else None


def _owner(layers: tuple[int, int], lattice: object, domain: Domain) -> int:
    """The process that owns the layer in the middle of some."""
    body = on_grid(lattice)  # pyright: ignore[reportArgumentType]
    share = body.split.nodes
    node, middle = np.rint(body.index[:, 0]).astype(int)[share.own], sum(layers) // 2
    nearest = float(np.abs(node - middle).min(initial=np.iinfo(np.int64).max // 2))
    distances = domain.joined(np.array([nearest]))
    return int(distances.argmin())


def reach_probes(scene: Scene, bare: BareBody, domain: Domain) -> BareBody:
    """A body whose part here has around the places of probes whatever is read for them. Raises SceneError for a probe that
    reads all along a body that processes share."""
    if domain.size == 1:
        return bare
    wanted = [bare.geometry.split.layers]
    most = max(int(on_grid(bare.geometry).frame.count[0]) // 2, LEAST)
    for k, probe in enumerate(scene.probes):
        if probe.of is not None or probe.body not in (None, bare.body.name):
            continue
        layers = _layers(probe, bare.geometry, domain)
        if layers is None:
            continue
        if layers[1] - layers[0] > most:
            text = (
                f"reads {layers[1] - layers[0] + 1} layers of cells across the first axis, which one process has to hold: read at"
                " most half of the body, or start the run without mpiexec"
            )
            raise SceneError("scene", [Fault(0, f"probes.{k}", text)])
        if _owner(layers, bare.geometry, domain) == domain.rank:
            wanted.append((layers[0] - AROUND, layers[1] + 1 + AROUND))
    low, high = (of(each) for of, each in zip((min, max), zip(*wanted, strict=True), strict=True))
    windows = domain.joined(np.array([(low, high) != bare.geometry.split.layers]))
    return replace(bare, geometry=bare.geometry.wider((low, high))) if windows.any() else bare


def keeper(probe: Probe, key: str, bodies: Sequence[Probed], domain: Domain) -> int:
    """The process that records a probe: the first where none has its places, which says so."""
    for run in bodies:
        if probe.body in (None, run.body.name):
            layers = _layers(probe, run.system.geometry, domain)
            if layers is not None:
                return _owner(layers, run.system.geometry, domain)
    return 0


class PlacedRecorder(Recorder):
    """A probe that one process records. All ask it for what it has together."""

    def __init__(
        self, probe: Probe, clock: Clock, often: bool, domain: Domain, keeper: int, make: Callable[[], Recorder]
    ):
        super().__init__(probe, clock, 1, wp.float64, every_step=often)
        self._domain, self._keeper = domain, keeper
        self._own = make() if domain.rank == keeper else None

    def record(self) -> None:
        if self._own is not None:
            self._own.record()

    def flush(self, steps: list[int]) -> None:
        self.steps += steps
        if self._own is not None:
            self._own.flush(steps)

    def begin(self, stood: Mapping[str, float]) -> None:
        if self._own is not None:
            self._own.begin(stood)

    def columns(self) -> dict[str, np.ndarray]:
        return self._domain.told(lambda: self._kept_here.columns(), self._keeper)

    def kept(self) -> tuple[np.ndarray, list[int]]:
        return self._domain.told(lambda: self._kept_here.kept(), self._keeper)

    def go_on(self, rows: np.ndarray, steps: list[int]) -> None:
        self.steps = list(steps)
        if self._own is not None:
            self._own.go_on(rows, steps)

    @property
    def units(self) -> dict[str, str]:
        return self._domain.told(lambda: self._kept_here.units, self._keeper)

    @property
    def _kept_here(self) -> Recorder:
        assert self._own is not None
        return self._own


class SharedNumbers(Recorder):
    """A probe of the numbers of one thing that processes share: they put them together on the host."""

    def __init__(
        self,
        probe: Probe,
        key: str,
        reported: Sequence[Reported],
        scales: Scales,
        clock: Clock,
        dim: int,
        often: bool,
        domain: Domain,
    ):
        of = [each for each in reported if each.name == probe.of]
        if often or not of:
            text = (
                "numbers of every step are for one process" if of else f"nothing that has numbers is named {probe.of!r}"
            )
            raise SceneError("scene", [Fault(0, f"{key}.every" if of else f"{key}.of", text)])
        self._numbers = Numbers(of, scales, dim, domain)
        names = [number for name in probe.fields for number in components(name, dim)]
        self._columns = {name: column(of[0], name) for name in names}
        self._scale, self._stood = {name: scale(name, scales, dim) for name in names}, 0.0
        super().__init__(probe, clock, len(names), wp.float64, every_step=False)

    def record(self) -> None:
        """What there is is put together when it is read."""

    def flush(self, steps: list[int]) -> None:
        found = self._numbers.present()
        self._rows.append(np.array([[found[each] for each in self._columns.values()]] * len(steps)))
        self.steps += steps

    def begin(self, stood: Mapping[str, float]) -> None:
        self._stood = stood.get(self._columns.get(WORK, ""), 0.0)

    def columns(self) -> dict[str, np.ndarray]:
        rows, _ = self.kept()
        stood = {WORK: self._stood}
        return {name: (rows[:, k] - stood.get(name, 0.0)) * self._scale[name] for k, name in enumerate(self._columns)}

    @property
    def units(self) -> dict[str, str]:
        return {name: self._numbers.units[column] for name, column in self._columns.items()}
