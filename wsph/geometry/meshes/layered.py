"""Bodies that no grid has cut, in layers, and how processes share them: the first makes all of one and deals out the parts.

To fit a surface or to read a file takes as long for a part as for all. What is of the whole body, such as its middle and
what there is to doubt about it, goes with every part.
"""

# pyright: strict

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeVar, cast

import numpy as np

from wsph.backend.domain import Domain, Split
from wsph.geometry.geometry import Geometry
from wsph.geometry.meshes.layers import Layers
from wsph.ranks.cuts import Counts, Reach
from wsph.ranks.slabs import Slab, TooFew, slabs, work_of


@dataclass(frozen=True)
class Whole:
    """What a part knows of the whole body: the mean of its nodes, `middle` (dim,) [m], the mean volume of its points [m^dim]
    and what there is to doubt about its cells, in words."""

    middle: np.ndarray
    mean_volume: float
    doubts: tuple[str, ...]


@dataclass(frozen=True)
class Layered(Geometry):
    """A body whose nodes and points stand layer by layer; of one that processes share `of` which it is a part, `part` which
    part it is, and `widened` how it is made with more around it."""

    layers: Layers = field(kw_only=True)
    of: Whole | None = field(default=None, kw_only=True)
    part: Split | None = field(default=None, kw_only=True)
    widened: "Callable[[tuple[int, int]], Layered] | None" = field(default=None, kw_only=True)

    @property
    def split(self) -> Split:
        return super().split if self.part is None else self.part

    def wider(self, layers: tuple[int, int]) -> "Layered":
        return self if self.widened is None else self.widened(layers)

    @property
    def mean_volume(self) -> float:
        return super().mean_volume if self.of is None else self.of.mean_volume

    @property
    def middle(self) -> np.ndarray:
        return super().middle if self.of is None else self.of.middle

    def across(self, places: np.ndarray) -> np.ndarray:
        return self.layers.across(places)

    @property
    def counts(self) -> Counts:
        return self.layers

    @property
    def layer_count(self) -> int:
        return len(self.layers.points)

    def needed(self, slab: Slab) -> tuple[int, int]:
        """The layers that a process has to have of a slab, from one up to another: those that it has, and more."""
        return slab.layers

    def cut(self, slab: Slab, of: Whole) -> "Layered":
        """The part of it that a process holds of a slab."""
        raise NotImplementedError


L = TypeVar("L", bound=Layered)

NOTHING = (2**31, 0)
"""Layers that take nothing beyond what a slab has."""


@dataclass(frozen=True)
class _Slabs:
    """The slabs that `size` processes have of bodies, as `wsph.ranks.slabs.slabs` takes them. Particles that are their own
    points are shared as nodes: there are none behind the last layer."""

    size: int
    reach: Reach
    who: str
    loads: np.ndarray | None

    def of(self, body: Layered, windows: np.ndarray) -> list[Slab]:
        """Those of a body, each with at least the layers that a process asks for in `windows` (size, 2), and with whatever
        it cannot do without."""
        found = slabs(body.layers, self.size, self.reach, who=self.who, loads=self.loads)
        return [
            self._fitting(body, each, (int(low), int(high))) for each, (low, high) in zip(found, windows, strict=True)
        ]

    def _fitting(self, body: Layered, slab: Slab, window: tuple[int, int]) -> Slab:
        for wanted in (window, body.needed(slab)):
            slab = slab.over(wanted, body.layers.nodes, body.layers.points)
        return replace(slab, cells=slab.nodes) if self.reach.joined else slab


def shared(
    make: Callable[[], L],
    domain: Domain,
    reach: Reach,
    *,
    who: str,
    doubts: Callable[[Geometry], Iterator[str]],
    entire: bool = False,
    loads: np.ndarray | None = None,
) -> L:
    """The part of a body that a process has, or the `entire` body, of which it owns its part; `reach`, `who` and `loads` as
    of `wsph.ranks.slabs.slabs`. The first process makes all of the body, once, and keeps it for those that ask for more of
    it. Raises TooFew, and in all processes what the first one meets."""
    known: list[tuple[L, Whole]] = []
    cutting = _Slabs(domain.size, reach, who, loads)

    def parts(windows: np.ndarray) -> list[tuple[Layered, Slab, list[Slab]] | str]:
        if not known:
            body = make()
            known.append((body, Whole(body.middle, body.mean_volume, tuple(doubts(body)))))
        body, of = known[0]
        try:
            found = cutting.of(body, windows)
            every = np.tile([0, body.layer_count], (domain.size, 1))
            held = cutting.of(body, every) if entire else found
            return [(body.cut(mine, of), mine, found) for mine in held]
        except TooFew as error:  # in all processes, which go on without sharing
            return [str(error)] * domain.size

    def made(window: tuple[int, int]) -> L:
        windows = domain.joined(np.array([window]))
        found = domain.dealt(lambda: parts(windows))
        if isinstance(found, str):
            raise TooFew(found)
        part, held, every = found
        slab = every[domain.rank]
        right = (slab.nodes.window, slab.cells.window) if entire else None
        split = Split(domain, held.nodes, held.cells, layers=slab.layers, right=right, work=work_of(every))
        return cast(L, replace(part, part=split, widened=made))

    return made(NOTHING)
