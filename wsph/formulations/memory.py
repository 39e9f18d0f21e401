"""Memory that bodies will take, before anything of their size is allocated.

Small blocks of the same form, material, parts and loads are set up for it, some tens of milliseconds each: what the
register of their arrays counts, and what numpy takes on the way, are sums of the counts of `wsph.geometry.counts`, with
coefficients that hold for a body of any size. So an array that somebody adds to a form is in the estimate. Blocks with
jitter or a map have pairs by chance, and staircases pairs that a block has not: within 5 %, 7 % of forms that have lists at
faces alone. The block of a fitted body has jitter, for its vectors. Not in it: meshes, whose files are in memory before
their cells; what acts between bodies, and what a run records.
"""

# pyright: strict

import gc
import math
import tracemalloc
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wsph.backend.device import free_memory
from wsph.boundary.tables import Boundary
from wsph.doubts import keeping
from wsph.errors import Fault, Refused, SceneError
from wsph.formulations.system import Segmented
from wsph.geometry.counts import (
    block_counts,
    block_inner,
    block_segments,
    inner_rows,
    lattice_counts,
    line_segments,
)
from wsph.geometry.grid import plan
from wsph.geometry.shapes.box import Box
from wsph.geometry.shapes.combined import Shape
from wsph.scene.messages import size_in_words
from wsph.scene.scene import Scene
from wsph.scene.tables import Body, CrackLine

MOST = 1e5
"""Bytes that a cell of any form takes at most: a body that fits at this rate is not looked at any closer."""

SPARE = 1.15
"""Part of the estimate that has to be free: arrays of the device that no register knows, because they are gone after
the set-up, take 7 to 13 % of all."""

FEWEST, APART = {1: 1100, 2: 20, 3: 8}, {1: 1000, 2: 40, 3: 6}
"""Cells along an edge of the smallest block, which is no body that has lists for being small, and how many more the largest
has, by the dimension."""

CLEAR = 1.05
"""The estimate of the spacing that is offered leaves this much of what is free."""


class Small(Protocol):
    """The system of a block, of which this is asked."""

    @property
    def count(self) -> int: ...

    @property
    def nbytes(self) -> int: ...

    @property
    def segmented(self) -> Segmented | None: ...


Fitted = Callable[[Body], bool]
"""Whether the surface of a body will be fitted."""

FITTED = 1.25
"""What a fitted body takes of what its lattice would: its layer of cells is more than that, by up to a quarter where most
cells are near the surface."""

JITTER = 0.1
"""Of the block of a fitted body [spacings]."""


@dataclass(frozen=True)
class _Cut:
    """A body that is cut from a shape, and whether its surface is fitted."""

    body: Body
    shape: Shape
    spacing: float | tuple[float, ...]
    fitted: bool


SetUp = Callable[[Scene, bool], Small]
"""Gives the system of a scene's first body by itself; whether the limit of its time step is found too."""


@dataclass(frozen=True)
class Need:
    """Memory of a scene's bodies [bytes]: `arrays` on the device, and on the host the most at once while they are set
    up, `host`; with the `particles` that take it. `free_device` and `free_host`: what there is, None where it is not
    known."""

    device: str
    particles: float
    arrays: float
    host: float
    free_device: float | None
    free_host: float | None

    @property
    def share(self) -> float:
        """The need as a part of what is free: above 1 the bodies do not fit."""
        parts = [(self.arrays + self.host, self.free_host)]
        if self.device != "cpu":
            parts = [(self.arrays, self.free_device), (self.host, self.free_host)]
        return max((SPARE * need / max(free, 1.0) for need, free in parts if free is not None), default=0.0)

    def __str__(self) -> str:
        free = [(self.free_host, "free")]
        if self.device != "cpu":
            free = [(self.free_device, f"free on {self.device}"), (self.free_host, "free on the host")]
        left = [f"{_size(much)} {where}" for much, where in free if much is not None]
        while_set_up = f"{_size(self.host)} on the host while they are set up"
        return f"{_size(self.arrays)} of arrays and {while_set_up}; {' and '.join(left) or 'what is free is not known'}"


def refuse_too_large(scene: Scene, device: str, set_up: SetUp, fitted: Fitted) -> None:
    """Refuse bodies that do not fit into the memory that is free, with a spacing that would. Raises SceneError."""
    cuts = _cuts(scene, fitted)
    cells = sum(math.prod(_count(cut)) for cut in cuts)
    if all(free is None or MOST * cells < free for free in free_memory(device)):
        return
    try:
        needs = _needs(scene, device, set_up, cuts)
    except (SceneError, Refused):
        return  # that was said of a block: the body is refused in its own words, or takes what it takes
    whole = _whole(needs)
    if whole.share <= 1.0:
        return
    largest = int(np.argmax([need.arrays + need.host for need in needs]))
    cut = cuts[largest]
    text = f"{_spacing(cut.spacing)} m gives about {needs[largest].particles:.3g} particles"
    if len(needs) > 1:
        text += f", and all bodies have about {whole.particles:.3g}"
    raise SceneError(
        "scene",
        [
            Fault(
                0,
                f"bodies.{scene.bodies.index(cut.body)}.spacing",
                f"{text}, which take {whole}; {_way_out(scene, cuts, whole.share)}; {_size_of(cut)}",
            )
        ],
    )


def _size_of(cut: _Cut) -> str:
    low, high = cut.shape.bounds()
    return size_in_words(cut.body.name, (high - low).tolist(), unscaled=bool(cut.body.unscaled))


def estimate(scene: Scene, device: str, set_up: SetUp, fitted: Fitted) -> Need:
    """What the bodies of a scene will take. Raises what `set_up` raises of a block that cannot be set up."""
    cuts = _cuts(scene, fitted)
    if not cuts:
        return Need(device, 0.0, 0.0, 0.0, *free_memory(device))
    return _whole(_needs(scene, device, set_up, cuts))


def _cuts(scene: Scene, fitted: Fitted) -> list[_Cut]:
    """The bodies that are cut from a shape."""
    return [
        _Cut(body, body.shape, body.spacing, fitted(body))
        for body in scene.bodies
        if body.shape is not None and body.spacing is not None
    ]


def _whole(needs: list[Need]) -> Need:
    first = needs[0]
    sums = (sum(need.particles for need in needs), sum(need.arrays for need in needs), sum(need.host for need in needs))
    return Need(first.device, *sums, first.free_device, first.free_host)


def _needs(scene: Scene, device: str, set_up: SetUp, cuts: list[_Cut]) -> list[Need]:
    """The need of every body by itself; on the host the last of them is set up beside what the others leave there."""
    free, found, known = free_memory(device), list[np.ndarray](), dict[str, tuple[np.ndarray, Segmented | None]]()
    for cut in cuts:
        alike = _likeness(scene, cut)
        if alike not in known:
            known[alike] = _learned(scene, cut, set_up)
        learned, segmented = known[alike]
        counts = lattice_counts(cut.shape, cut.spacing, cut.body.lattice_rotate, fitted=cut.fitted)
        sums = np.maximum(counts @ learned, 0.0)
        if segmented is not None:
            where, width = (cut.shape, cut.spacing, cut.body.lattice_rotate), segmented.width
            rows = inner_rows(*where, fitted=cut.fitted, width=width) if segmented.inner else None
            rows = rows or (0, line_segments(*where, fitted=cut.fitted, width=width))
            sums[1] += segmented.bytes(counts[1], *rows)
        found.append((FITTED if cut.fitted else 1.0) * sums)
    passing = [peak - kept for _, _, kept, peak in found]
    largest = int(np.argmax(passing))
    return [
        Need(device, particles, arrays, kept + (passing[k] if k == largest else 0.0), *free)
        for k, (particles, arrays, kept, _) in enumerate(found)
    ]


def _likeness(scene: Scene, cut: _Cut) -> str:
    """What makes the block of a body what it is: bodies that have it in common are measured once."""
    keys = cut.body.model_dump(exclude={"name", "shape", "velocity"})
    conditions = [each.model_dump(exclude={"body"}) for each in scene.boundary if each.body == cut.body.name]
    touches = cut.body.name in scene.balls
    placed = cut.body.map is not None or any(part.selections for part in cut.body.parts.values())
    place = cut.shape.middle.tolist() if placed else None
    return repr((keys, conditions, touches, place, cut.shape.rotate, cut.fitted))


def _learned(scene: Scene, cut: _Cut, set_up: SetUp) -> tuple[np.ndarray, Segmented | None]:
    """Particles, bytes of arrays, and bytes of the host that stay and that are there at once, per count of
    `lattice_counts`, (dim + 2, 4), and what of the arrays goes by segments of lines. What is on the host is in proportion
    to the particles: the largest block is measured."""
    # All even: forms that join particles to blocks of two have other numbers of these at odd ones.
    first = max(FEWEST[scene.dim], 2 * math.ceil(0.5 * (scene.run.support or 0.0)) + 2)
    sizes = [*(first + 2 * k for k in range(scene.dim)), first + APART[scene.dim]]
    with warnings.catch_warnings(), keeping([]):
        warnings.simplefilter("ignore")
        # The first has its limit found too: what is imported and compiled for that is no body's.
        small = [set_up(_block(scene, cut, size), size == first) for size in sizes[:-1]]
        large, kept, peak = _measured(_block(scene, cut, sizes[-1]), set_up)
    counts = [block_counts((size,) * scene.dim) for size in sizes]
    sums = np.array([(each.count, each.nbytes) for each in (*small, large)], float)
    segmented = large.segmented
    if segmented is not None:
        for size, each in zip(sizes, sums, strict=True):
            cells, width = (size,) * scene.dim, segmented.width
            rows = block_inner(cells, width) if segmented.inner else (0, block_segments(cells, width))
            each[1] -= segmented.bytes(float(size**scene.dim), *rows)
    # Of the coefficients that give those of the blocks the smallest: with others staircases are up to 15 % off.
    found = np.linalg.lstsq(np.array(counts), sums, rcond=1e-12)[0]
    on_host = [found[:, 0] * much / large.count for much in (kept, peak)]
    return np.column_stack([found, *on_host]), segmented


def _measured(scene: Scene, set_up: SetUp) -> tuple[Small, int, int]:
    """The system of a scene's first body, and the bytes on the host that it leaves there and that were there at
    once."""
    gc.collect()
    traced = tracemalloc.is_tracing()
    if not traced:
        tracemalloc.start()
    try:
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        system = set_up(scene, True)
        after, peak = tracemalloc.get_traced_memory()
        return system, after - before, peak - before
    finally:
        if not traced:
            tracemalloc.stop()


def _block(scene: Scene, cut: _Cut, size: int) -> Scene:
    """A scene of one block of so many cells along every axis, in the middle of a body, that is set up as the body
    is."""
    steps = np.broadcast_to(np.asarray(cut.spacing, float), (scene.dim,))
    middle = cut.shape.middle
    rotate = cut.shape.rotate or cut.body.lattice_rotate
    low, high = (tuple((middle + sign * 0.5 * size * steps).tolist()) for sign in (-1.0, 1.0))
    block = Box(type="box", min=low, max=high, rotate=rotate)
    cracks: tuple[CrackLine, ...] = ()
    if cut.body.cracks:
        ends = np.array([[0.0] * scene.dim, [1.0] * scene.dim])
        ends[:, -1] = size // 2
        start, end = plan(block, cut.spacing).points(ends).tolist()
        cracks = (CrackLine.model_validate({"from": start, "to": end}),)
    changes = {"shape": block, "lattice_rotate": 0.0, "cracks": cracks, "velocity": None}
    if cut.fitted:
        changes |= {"surface": "stairs", "jitter": JITTER}
    return scene.model_copy(
        update={
            "bodies": (cut.body.model_copy(update=changes),),
            "boundary": tuple(_conditions(scene, cut.body)),
            "run": scene.run.model_copy(update={"guard": "off"}),
        }
    )


def _conditions(scene: Scene, body: Body) -> Iterator[Boundary]:
    """The conditions of a body as its block has them: on faces. What `where` selects is on one that is free, or left
    out."""
    given = [condition for condition in scene.boundary if condition.body == body.name]
    free = [sign + axis for axis in "xyz"[: scene.dim] for sign in "+-"]
    free = [face for face in free if all(condition.face != face for condition in given)]
    for condition in given:
        across = {label[0] for label in condition.stress}
        face = condition.face or next((face for face in free if across <= {face[1]}), None)
        if face is None:
            continue
        free = [each for each in free if each != face]
        yield condition.model_copy(update={"where": None, "face": face})


def _count(cut: _Cut) -> tuple[int, ...]:
    return tuple(plan(cut.shape, cut.spacing, cut.body.lattice_rotate, fitted=cut.fitted).count.tolist())


def _way_out(scene: Scene, cuts: list[_Cut], share: float) -> str:
    """The spacings that would fit, in words."""
    factor = (CLEAR * share) ** (1.0 / scene.dim)
    coarser = [(cut.body.name, _coarser(cut, factor)) for cut in cuts]
    if any(spacing is None for _, spacing in coarser):
        return f"spacings {factor:.3g} times as large would fit, if they divide the edges"
    if len(coarser) == 1:
        return f"a spacing of {coarser[0][1]} m would fit"
    return "spacings of " + ", ".join(f"{spacing} m for {name!r}" for name, spacing in coarser) + " would fit"


def _coarser(cut: _Cut, factor: float) -> str | None:
    """The smallest spacing, at least `factor` times a body's, that divides the edges of its shape; None where there is
    none."""
    divisor = math.gcd(*_count(cut))
    bound = any(len(edges) for edges in cut.shape.edges()) and cut.body.lattice_rotate == 0.0 and not cut.fitted
    ratios = [divisor / cells for cells in range(int(divisor / factor), 0, -1)] if bound else []
    for ratio in [*([] if bound else [factor]), *ratios]:
        spacing = np.asarray(cut.spacing, float) * ratio
        try:
            coarser = tuple(spacing.tolist()) if spacing.ndim else float(spacing)
            plan(cut.shape, coarser, cut.body.lattice_rotate, fitted=cut.fitted)
        except ValueError:
            continue
        return _spacing(tuple(spacing.tolist()) if spacing.ndim else float(spacing))
    return None


def _spacing(spacing: float | tuple[float, ...]) -> str:
    if isinstance(spacing, tuple):
        return "[" + ", ".join(f"{each:.12g}" for each in spacing) + "]"
    return f"{spacing:.12g}"


def _size(much: float) -> str:
    """Bytes in words."""
    power = min(int(math.log(max(much, 1.0), 1000.0)), 4)
    return f"{much / 1000.0**power:.3g} {('B', 'kB', 'MB', 'GB', 'TB')[power]}"
