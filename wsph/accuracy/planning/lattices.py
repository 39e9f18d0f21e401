"""The lattices of a scene that rows of a ladder may have: those that divide every edge of every body, and that put probes
and cracks where the scene's own lattice has them, on its lines or in the middle between two.

A lattice is named by a whole number, its `cells`: those across the longest edge of the first body. All bodies are refined
alike. Of staircases, whose error goes with the volume that they miss, those are taken that miss less of it than their
neighbours, by |V/V_exact - 1| x cells.
"""

# pyright: strict

import math
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from wsph.accuracy.planning.staircases import Staircase, across, extent, met, shape_of, steps_of
from wsph.errors import Refused
from wsph.scene.geometries import is_fitted
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composing.setting import method_of

ACROSS = {1: 8, 2: 2, 3: 2}
"""Cells across the thinnest body of the coarsest lattice, by the dimension."""

ACROSS_PAIRS = 4
"""The same in 2D and 3D for particles that are their own points: thinner ones bend as something else."""

FARTHEST = 64
"""Lattices beyond the last one that are looked at for one that fits, beside those that all fit as the scene's own does."""

ON = 1e-6
"""A point is on a line of a lattice if it is this near, in cells."""


class Lattices:
    """The lattices of a scene, whose own has `own` cells; `first` is the coarsest that a ladder may begin with."""

    def __init__(self, scene: Scene):
        """Raises Refused for bodies that have one spacing only."""
        self.scene = scene
        formulation = method_of(scene).formulation
        fixed = [body.name for body in scene.bodies if body.shape is None or body.spacing is None]
        if fixed:
            raise Refused(
                f"body {fixed[0]!r} comes from a file, whose cells are as they are: accuracy is found by rows of other"
                " spacings: give it a shape and a spacing, or run a study of mesh files"
            )
        self._fitted = {body.name for body in scene.bodies if is_fitted(scene, body, formulation)}
        counts = [count for body in scene.bodies for count in self._intervals(body)]
        self._own_across = across(scene.bodies[0])
        divisor = math.gcd(*counts) if counts else round(self._own_across)
        # `cells` = a multiple of `_unit` where edges ask for it; without edges any number.
        self._unit = self._own_across / divisor
        self._divisor = divisor
        self._lines = [line for body in scene.bodies for line in self._places(body)]
        curved = [body for body in scene.bodies if body.name not in self._fitted and not body.map and not met(body)]
        self._stairs = [Staircase(body, divisor) for body in curved if scene.dim > 1]
        self.own = round(self._own_across)
        pairs = formulation.traits.one_set and formulation.traits.pairwise and scene.dim > 1
        thinnest = min(float((extent(body) / steps_of(body)).min()) for body in scene.bodies)
        least = (ACROSS_PAIRS if pairs else ACROSS[scene.dim]) / thinnest * divisor
        self.first = self._next(max(math.ceil(least - ON), 1))

    def scene_at(self, cells: int) -> Scene:
        """The scene with a lattice of so many cells; a fixed time step in proportion."""
        number = round(cells / self._unit)
        factor = self._divisor / number
        changes: dict[str, object] = {}
        for k, body in enumerate(self.scene.bodies):
            steps = np.asarray(body.spacing, float) * factor
            changes[f"bodies.{k}.spacing"] = steps.tolist() if steps.ndim else float(steps)
        if self.scene.run.dt is not None:
            changes["run.dt"] = self.scene.run.dt * factor
        return self.scene.with_(**changes)

    def spacing(self, cells: int) -> float:
        """The smallest spacing of a lattice [m]."""
        own = min(float(steps_of(body).min()) for body in self.scene.bodies)
        return own * self._own_across / cells

    def next(self, cells: float) -> int:
        """The coarsest lattice of at least so many cells. Raises Refused where none is found."""
        return self._next(max(math.ceil(cells / self._unit - 1e-9), round(self.first / self._unit)))

    def below(self, cells: float) -> int:
        """The finest lattice of at most so many cells, not coarser than the first."""
        number, first = math.floor(cells / self._unit + 1e-9), round(self.first / self._unit)
        while number > first and not self._fits(number):
            number -= 1
        return round(max(number, first) * self._unit)

    def misfit(self, cells: int) -> float:
        """The part of its volume that the worst staircase of a lattice misses or has too much."""
        return max((each.missed(round(cells / self._unit)) for each in self._stairs), default=0.0)

    def _next(self, number: int) -> int:
        found = next((n for n in range(number, number + 2 * self._divisor + FARTHEST) if self._fits(n)), None)
        if found is None:
            raise Refused(
                "no other spacing puts probes and edges where this one has them: move the probes onto particles, or choose a"
                " spacing that divides the edges into more cells"
            )
        return round(found * self._unit)

    def _fits(self, number: int) -> bool:
        if any(_class(line) != _class(line * number / self._divisor) for line in self._lines):
            return False
        return all(each.better(number) for each in self._stairs)

    def _intervals(self, body: Body) -> Iterator[int]:
        """Cells between the edges of a body that a lattice has to meet, at its own spacing."""
        if body.name in self._fitted or body.lattice_rotate != 0.0:
            return
        for edges, step in zip(shape_of(body).edges(), steps_of(body), strict=True):
            yield from (round(float(edge - edges[0]) / float(step)) for edge in edges[1:])

    def _places(self, body: Body) -> Iterator[float]:
        """Coordinates of probes and cracks in cells of a body's own lattice, of those on a line of it or in the middle."""
        shape = shape_of(body)
        if body.name in self._fitted or body.lattice_rotate != 0.0 or shape.rotate != 0.0:
            return
        points = [end for crack in body.cracks for end in (crack.start, crack.end)]
        for probe in self.scene.probes:
            if probe.points is not None and (probe.body == body.name or probe.body is None):
                points += [
                    place for place in probe.points if len(place) == shape.dim and shape.contains(np.array([place]))[0]
                ]
        for edges, step, axis in zip(shape.edges(), steps_of(body), range(shape.dim), strict=True):
            if len(edges):
                places = ((point[axis] - edges[0]) / step for point in points)
                yield from (float(place) for place in places if _class(place) is not None)


def _class(place: float) -> Fraction | None:
    """Where a coordinate in cells stands: on a line (0), in the middle between two (1/2), or neither (None)."""
    twice = round(2.0 * place)
    return Fraction(twice % 2, 2) if abs(place - 0.5 * twice) < ON * max(abs(place), 1.0) else None
