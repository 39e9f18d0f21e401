"""Cells cleaned until their surface is one sheet about every node: what hangs on by a corner or an edge goes."""

# pyright: strict

from functools import cache
from itertools import product

import numpy as np

from wsph.geometry.connected import connected
from wsph.geometry.fitted.core import on_met
from wsph.geometry.fitted.outline import Outline
from wsph.geometry.fitted.planning import Plan

CRUMB = 0.02
"""Part of the cells below which a piece that hangs on nothing is dropped."""


def cleaned(kept: np.ndarray, body: Outline, plan: Plan) -> np.ndarray:
    """The cells (count) bool without those that have no neighbour along some axis, and without the fewest that make the
    cells about every node, and what is outside about it, hang together by faces; pieces of a few cells go too."""
    while True:
        bad = _lonely(kept, body, plan) | _pinched(kept)
        if not bad.any():
            return _without_crumbs(kept)
        kept = kept & ~bad


def _lonely(kept: np.ndarray, body: Outline, plan: Plan) -> np.ndarray:
    """Cells with no neighbour along some axis, and no surface that the grid meets either."""
    bad = np.zeros_like(kept)
    for axis in range(kept.ndim):
        wide = np.moveaxis(np.pad(kept, [(1, 1) if k == axis else (0, 0) for k in range(kept.ndim)]), axis, 0)
        alone = np.argwhere(kept & ~np.moveaxis(wide[:-2] | wide[2:], 0, axis))
        held = on_met(body, plan, alone, axis, -1) | on_met(body, plan, alone, axis, 1)
        bad[tuple(alone[~held].T)] = True
    return bad


def _pinched(kept: np.ndarray) -> np.ndarray:
    """Cells that have to go for the surface to be one sheet about every node: of equal choices all."""
    dim = kept.ndim
    wide = np.pad(kept, 1)
    parts = [tuple(slice(o, n - 1 + o) for o, n in zip(offset, wide.shape, strict=True)) for offset in _corners(dim)]
    pattern = np.zeros(tuple(n - 1 for n in wide.shape), int)
    for bit, part in enumerate(parts):
        pattern |= wide[part].astype(int) << bit
    drop = _drops(dim)[pattern]
    bad = np.zeros_like(wide)
    for bit, part in enumerate(parts):
        bad[part] |= (drop >> bit & 1).astype(bool)
    return bad[(slice(1, -1),) * dim]


def _corners(dim: int) -> np.ndarray:
    return np.array(list(product((0, 1), repeat=dim)))


@cache
def _drops(dim: int) -> np.ndarray:
    """For every pattern of filled cells about a node, a bit each, those to drop, (2^2^dim,) int."""
    cells = _corners(dim)
    first, second = np.nonzero(np.triu(np.abs(cells[:, None] - cells).sum(2) == 1))
    patterns = range(2 ** len(cells))
    sheet: list[int] = []
    for pattern in patterns:
        filled = np.array([pattern >> bit & 1 for bit in range(len(cells))])
        same = filled[first] == filled[second]
        if connected(first[same], second[same], len(cells)).max() <= 1:
            sheet.append(pattern)
    drops = np.zeros(len(patterns), int)
    for pattern in set(patterns).difference(sheet):
        left = [kept for kept in sheet if not kept & ~pattern]
        most = max(kept.bit_count() for kept in left)
        for kept in left:
            if kept.bit_count() == most:
                drops[pattern] |= pattern & ~kept
    return drops


def _without_crumbs(kept: np.ndarray) -> np.ndarray:
    number = np.cumsum(kept.ravel()).reshape(kept.shape) - 1
    first, second = list[np.ndarray](), list[np.ndarray]()
    for axis in range(kept.ndim):
        along, ids = np.moveaxis(kept, axis, 0), np.moveaxis(number, axis, 0)
        both = along[:-1] & along[1:]
        first.append(ids[:-1][both])
        second.append(ids[1:][both])
    if not kept.any():
        return kept
    part = connected(np.concatenate(first), np.concatenate(second), int(kept.sum()))
    large = np.bincount(part) >= CRUMB * len(part)
    result = kept.copy()
    result[kept] = large[part]
    return result
