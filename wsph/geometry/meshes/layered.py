"""Bodies that no grid has cut, in layers, and how processes share them: the first makes all of one and deals out the parts.

To fit a surface or to read a file takes as long for a part as for all. What is of the whole body, such as its middle and
what there is to doubt about it, goes with every part.
"""

# pyright: strict

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar, cast

import numpy as np

from wsph.backend.domain import Domain, Split
from wsph.geometry.geometry import Geometry
from wsph.geometry.meshes.layers import Layers
from wsph.ranks.cuts import Counts, Reach
from wsph.ranks.slabs import NOTHING, Cutting, Slab, TooFew, work_of


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
    part it is, `widened` how it is made with more around it, and `recut` how it was cut and how it is by other visits of
    pairs."""

    layers: Layers = field(kw_only=True)
    of: Whole | None = field(default=None, kw_only=True)
    part: Split | None = field(default=None, kw_only=True)
    widened: "Callable[[tuple[int, int], tuple[int, int]], Layered] | None" = field(default=None, kw_only=True)
    recut: "tuple[Cutting, Callable[[np.ndarray], Layered]] | None" = field(default=None, kw_only=True)

    @property
    def split(self) -> Split:
        return super().split if self.part is None else self.part

    def wider(self, layers: tuple[int, int]) -> "Layered":
        return self if self.widened is None else self.widened(layers, self.split.around)

    def seeing(self, layers: tuple[int, int]) -> "Layered":
        return self if self.widened is None else self.widened(self.split.layers, layers)

    @property
    def cutting(self) -> Cutting | None:
        return None if self.recut is None else self.recut[0]

    def cut_by(self, visits: np.ndarray) -> "Layered":
        return self if self.recut is None else self.recut[1](visits)

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


@dataclass(frozen=True)
class _Slabs:
    """The slabs that processes have of a body. Particles that are their own points are shared as nodes: there are none
    behind the last layer."""

    cutting: Cutting
    visits: np.ndarray | None

    @property
    def reach(self) -> Reach:
        """What a process needs around what it owns."""
        return self.cutting.reach

    def of(self, body: Layered, windows: np.ndarray) -> tuple[list[Slab], list[Slab]]:
        """Those of a body, with at least the layers that processes ask for in `windows` (size, 2, 2) and what they cannot
        do without: with those whose state is to be right, and with all."""
        found = self.cutting.slabs(self.visits)
        asked = [[(int(low), int(high)) for low, high in row] for row in windows]
        right = [self._fitting(body, each, (row[0],)) for each, row in zip(found, asked, strict=True)]
        wide = ((self.reach.around(each.layers), row[1]) for each, row in zip(right, asked, strict=True))
        return right, [self._fitting(body, each, more) for each, more in zip(right, wide, strict=True)]

    def _fitting(self, body: Layered, slab: Slab, windows: tuple[tuple[int, int], ...]) -> Slab:
        for wanted in (*windows, body.needed(slab)):
            slab = slab.over(wanted, body.layers.nodes, body.layers.points)
        return replace(slab, cells=slab.nodes) if self.reach.joined else slab


def shared(
    make: Callable[[], L],
    domain: Domain,
    reach: Reach,
    *,
    who: str,
    doubts: Callable[[Geometry], Iterator[str]],
    loads: np.ndarray | None = None,
) -> L:
    """The part of a body that a process has; `reach`, `who` and `loads` as of `wsph.ranks.slabs.slabs`. The first process
    makes all of the body, once, and keeps it for those that ask for more of it. Raises TooFew, and in all processes what the
    first one meets."""
    known: list[tuple[L, Whole]] = []

    def cutting(layers: Layers) -> Cutting:
        return Cutting(layers, domain.size, reach, who, loads)

    def parts(windows: np.ndarray, visits: np.ndarray | None) -> list[tuple[Layered, Slab, list[Slab]] | str]:
        if not known:
            body = make()
            known.append((body, Whole(body.middle, body.mean_volume, tuple(doubts(body)))))
        body, of = known[0]
        try:
            right, held = _Slabs(cutting(body.layers), visits).of(body, windows)
            return [(body.cut(mine, of), mine, right) for mine in held]
        except TooFew as error:  # in all processes, which go on without sharing
            return [str(error)] * domain.size

    def made(visits: np.ndarray | None, window: tuple[int, int], around: tuple[int, int]) -> L:
        windows = domain.joined(np.array([[window, around]]))
        found = domain.dealt(lambda: parts(windows, visits))
        if isinstance(found, str):
            raise TooFew(found)
        part, held, every = found
        slab = every[domain.rank]
        split = Split(
            domain,
            held.nodes,
            held.cells,
            layers=slab.layers,
            around=held.layers,
            right=slab.within(held),
            work=work_of(every),
        )
        again = cutting(part.layers), cut
        return cast(L, replace(part, part=split, widened=partial(made, visits), recut=again))

    def cut(visits: np.ndarray | None = None) -> L:
        return made(visits, NOTHING, NOTHING)

    return cut()
