"""Pairs: which sources each target sees, as compressed sparse rows."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space

FEW = 250_000
"""Targets times sources that are looked at all with all in some milliseconds."""


@dataclass(frozen=True)
class Pairs:
    """Sources within the support of each target.

    Row i of `indices` is `indices[offsets[i]:offsets[i + 1]]`, ascending: sums over a row do not depend on how the row
    was found. offsets (targets + 1,) int32, indices (count,) int32, reach (targets,) float64, the support radius of each.
    """

    offsets: Array
    indices: Array
    targets: int
    sources: int
    reach: Array

    @property
    def count(self) -> int:
        """Number of directed pairs."""
        return self.indices.shape[0]

    def rows(self) -> np.ndarray:
        """The target of every pair, (count,) int32."""
        return np.repeat(np.arange(self.targets, dtype=np.int32), np.diff(self.offsets.numpy()))

    def within(self, targets: slice) -> int:
        """Number of the pairs of some targets."""
        offsets = self.offsets.numpy()
        return int(offsets[targets.stop] - offsets[targets.start])

    def keys(self) -> np.ndarray:
        """One number for every pair, target and source, ascending, (count,) int64."""
        return self.rows().astype(np.int64) * self.sources + self.indices.numpy()

    def transposed(self) -> tuple["Pairs", np.ndarray]:
        """The same pairs by source, and where each stands in `indices`: targets of a row ascend."""
        indices, device = self.indices.numpy(), self.offsets.device
        order = np.argsort(indices, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(indices, minlength=self.sources))])
        reach = wp.zeros(self.sources, dtype=wp.float64, device=device)
        back = (
            wp.array(starts, dtype=wp.int32, device=device),
            wp.array(self.rows()[order], dtype=wp.int32, device=device),
        )
        return Pairs(*back, self.sources, self.targets, reach), order

    def where(self, kept: np.ndarray) -> "Pairs":
        """The pairs for which `kept` (count,) bool holds."""
        if kept.all():
            return self
        offsets, device = self.offsets.numpy(), self.offsets.device
        before = np.concatenate([[0], np.cumsum(kept)])
        indices = wp.array(self.indices.numpy()[kept], dtype=wp.int32, device=device)
        return replace(self, offsets=wp.array(before[offsets], dtype=wp.int32, device=device), indices=indices)

    def only(self, targets: np.ndarray) -> tuple["Pairs", np.ndarray]:
        """The rows of some `targets` (k,) alone, and where their pairs stand in `indices`."""
        offsets, device = self.offsets.numpy(), self.offsets.device
        many = np.diff(offsets)[targets]
        ends = np.concatenate([[0], np.cumsum(many)])
        where = np.arange(ends[-1]) + np.repeat(offsets[targets] - ends[:-1], many)
        starts, indices = (
            wp.array(each, dtype=wp.int32, device=device) for each in (ends, self.indices.numpy()[where])
        )
        reach = wp.array(self.reach.numpy()[targets], dtype=wp.float64, device=device)
        return Pairs(starts, indices, len(targets), self.sources, reach), where

    def between(self, targets: slice, sources: slice) -> tuple["Pairs", np.ndarray]:
        """The pairs of some targets with some sources, both from one up to another, and where they stand in `indices`."""
        found, where = self.only(np.arange(targets.start, targets.stop))
        indices: np.ndarray = found.indices.numpy()
        kept = (indices >= sources.start) & (indices < sources.stop)
        found = found.where(kept)
        shifted = wp.array(found.indices.numpy() - sources.start, dtype=wp.int32, device=self.offsets.device)
        return replace(found, indices=shifted, sources=sources.stop - sources.start), where[kept]

    def seen(self, targets: slice) -> slice:
        """The sources of some targets, from the first up to the last."""
        offsets = self.offsets.numpy()
        indices = self.indices.numpy()[offsets[targets.start] : offsets[targets.stop]]
        return slice(int(indices.min()), int(indices.max()) + 1)

    @property
    def nbytes(self) -> int:
        """Device memory of the rows [bytes]."""
        return 4 * (self.targets + 1 + self.count)


@cache
def _kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel]:
    point, real = space.point, space.scalar
    module = space.module("pairs")

    @kernel(module=module)
    def count_row(
        grid: wp.uint64,
        targets: wp.array(dtype=point),
        sources: wp.array(dtype=point),
        reach: wp.array(dtype=real),
        same: int,
        count_out: wp.array(dtype=wp.int32),
    ):
        i = wp.tid()
        radius = reach[i]
        n = int(0)
        if radius > real(0.0):
            for j in wp.hash_grid_query(grid, targets[i], radius):
                r = sources[j] - targets[i]
                if wp.dot(r, r) < radius * radius and (same == 0 or i != j):
                    n += 1
        count_out[i] = n

    @kernel(module=module)
    def fill_row(
        grid: wp.uint64,
        targets: wp.array(dtype=point),
        sources: wp.array(dtype=point),
        reach: wp.array(dtype=real),
        offsets: wp.array(dtype=wp.int32),
        same: int,
        indices_out: wp.array(dtype=wp.int32),
    ):
        i = wp.tid()
        radius = reach[i]
        start = offsets[i]
        n = int(0)
        if offsets[i + 1] == start:
            return
        for j in wp.hash_grid_query(grid, targets[i], radius):
            r = sources[j] - targets[i]
            if wp.dot(r, r) < radius * radius and (same == 0 or i != j):
                # Insertion keeps the row ascending; rows are short and the grid returns them nearly in order.
                k = start + n
                while k > start and indices_out[k - 1] > j:
                    indices_out[k] = indices_out[k - 1]
                    k -= 1
                indices_out[k] = j
                n += 1

    return count_row, fill_row


def find_pairs(
    targets: np.ndarray,
    sources: np.ndarray,
    radius: float | np.ndarray,
    device: str = "cpu",
    same: bool = False,
    wanted: np.ndarray | None = None,
) -> Pairs:
    """All pairs with |target - source| < `radius`, one number or one for each target (n,).

    `targets` (n, dim), `sources` (m, dim) and `radius` in one unit.

    `same`: targets are the sources, and a particle is not its own neighbour (one that coincides with it is); `wanted` (n,)
    bool: the rows of other targets stay empty. Raises
    ValueError for positions that are not finite (a hash grid would lose their pairs silently), for a radius that is not
    above zero, and where the pairs outnumber a 32-bit index.
    """
    radii, dim, n, m = _radii(targets, sources, radius), targets.shape[1], len(targets), len(sources)
    every = radii if wanted is None else np.where(wanted, radii, 0.0)
    reach = wp.array(np.ascontiguousarray(every), dtype=wp.float64, device=device)
    if n == 0 or m == 0:
        empty = wp.zeros(0, dtype=wp.int32, device=device)
        return Pairs(wp.zeros(n + 1, dtype=wp.int32, device=device), empty, n, m, reach)
    space = Space(dim)
    origin = sources.min(0)
    padded = [np.zeros((len(points), 3)) for points in (targets, sources)]
    for array, points in zip(padded, (targets, sources), strict=True):
        array[:, :dim] = points - origin
    x, y = (wp.array(a, dtype=space.point, device=device) for a in padded)
    extent = np.ones(3, int)
    extent[:dim] = np.clip(np.ceil((sources.max(0) - origin) / radii.min()) + 1, 1, 512)
    grid = wp.HashGrid(*(int(e) for e in extent), device=device, dtype=space.scalar)
    grid.build(points=y, radius=float(radii.min()))
    count_row, fill_row = _kernels(space)
    counts = wp.zeros(n + 1, dtype=wp.int32, device=device)
    seen = [grid.id, x, y, reach]
    wp.launch(count_row, n, inputs=[*seen, int(same)], outputs=[counts], device=device)
    total = int(counts.numpy().sum(dtype=np.int64))
    if total >= 2**31:
        raise ValueError(
            f"{total} pairs outnumber a 32-bit index (at most {2**31 - 1}); use a smaller support or fewer particles"
        )
    offsets = wp.zeros(n + 1, dtype=wp.int32, device=device)
    wp.utils.array_scan(counts, offsets, inclusive=False)
    indices = wp.zeros(total, dtype=wp.int32, device=device)
    wp.launch(fill_row, n, inputs=[*seen, offsets, int(same)], outputs=[indices], device=device)
    return Pairs(offsets, indices, n, m, reach)


def _radii(targets: np.ndarray, sources: np.ndarray, radius: float | np.ndarray) -> np.ndarray:
    """The radius of each target. Raises ValueError as `find_pairs` does."""
    radii = np.broadcast_to(np.asarray(radius, float), len(targets))
    if not (radii > 0.0).all() or not np.all(np.asarray(radius) > 0.0):
        raise ValueError(f"the support radius {radius!r} is not above zero")
    for points in (targets, sources):
        if not np.isfinite(points).all():
            raise ValueError(
                f"particle {int(np.flatnonzero(~np.isfinite(points).all(1))[0])} has a position that is not finite"
            )
    return radii


def find_pairs_once(targets: np.ndarray, sources: np.ndarray, radius: float | np.ndarray, device: str = "cpu") -> Pairs:
    """As `find_pairs`, of what is found once: FEW are looked at all with all on the host, and nothing is compiled for
    that."""
    n, m = len(targets), len(sources)
    if n * m > FEW or n * m == 0:
        return find_pairs(targets, sources, radius, device)
    radii, origin, square = _radii(targets, sources, radius), sources.min(0), np.zeros((n, m))
    for k in range(targets.shape[1]):
        square += ((sources[:, k] - origin[k]) - (targets[:, k] - origin[k])[:, None]) ** 2
    row, indices = np.nonzero(square < (radii**2)[:, None])
    offsets = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
    ends, others = (wp.array(each, dtype=wp.int32, device=device) for each in (offsets, indices))
    return Pairs(ends, others, n, m, wp.array(radii, dtype=wp.float64, device=device))
