"""Edges of one surface against edges of another, in 3D."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.space import Space, Struct
from wsph.contact.meeting.candidates import Candidates, none, rows_of_pairs
from wsph.contact.meeting.crossing import cross_kernel, crossings_struct, ends_kernel, ridges_struct
from wsph.contact.meeting.memory import Memory
from wsph.contact.meeting.ridges import Ridges
from wsph.contact.meeting.ways import DEPTH, SLACK, Met, Numbers, Places, RecordArrays
from wsph.contact.surfaces.meshing.sparse import among
from wsph.sph.pairs import find_pairs

SHARE = 0.5
"""Stiffness of two edges that cross, in that of a cell's side: the product of the spacings times that per area. Vertices on
slanting ridges leave it to the edges: with half of this, fine bars dent each other deep enough to lose a fifth of an
impact's energy."""


class Crossings:
    """The ridges of `own` against those of `other`, which may be the same surface."""

    def __init__(
        self,
        own: Met,
        other: Met,
        lines: tuple[Ridges, Ridges],
        numbers: Numbers,
        space: Space,
        clock: Clock,
        arrays: Arrays,
    ):
        self.own, self.other, self.numbers = own, other, numbers
        self._space, self._clock, self._device, self._arrays = space, clock, clock.device, arrays
        self._depth = DEPTH * max(own.spacing, other.spacing)
        self.memory = Memory(len(lines[0].line), space, clock, arrays)
        self._make(lines)

    def _make(self, lines: tuple[Ridges, Ridges]) -> None:
        self.lines = lines
        space, arrays, count = self._space, self._arrays, len(lines[0].line)
        self._met = arrays.take("other", wp.full(count, -1, dtype=wp.int32, device=self._device))
        record: Any = crossings_struct(space)()
        record.force, record.other = arrays.zeros("force", count, space.vec), self._met
        record.at, record.to = (arrays.zeros(name, count, space.scalar) for name in ("at", "to"))
        self.record: RecordArrays = record
        self._structs = [self._struct(each, arrays, k) for k, each in enumerate(lines)]
        self.rows, self._ends, self._back = (none(self._device) for _ in range(3))

    def renew(self, one: Ridges, other: Ridges) -> None:
        """A surface was remade. Edges that meet then begin anew."""
        self.memory.renew(len(one.line), np.full(len(self.lines[0].line), -1))
        self._make((one, other))

    def _struct(self, lines: Ridges, arrays: Arrays, k: int) -> Struct:
        struct: Any = ridges_struct()()
        struct.line = arrays.take(f"line{k}", wp.array(lines.line, dtype=wp.int32, device=self._device))
        struct.sides = arrays.take(f"sides{k}", wp.array(lines.sides, dtype=wp.int32, device=self._device))
        return struct

    @property
    def stiffness(self) -> float:
        """Force per depth of two edges that cross, nondimensional. Of a surface with itself, each pair is met twice."""
        half = 0.5 if self.own is self.other else 1.0
        return half * SHARE * self.numbers.stiffness * self.own.spacing * self.other.spacing

    def find(self, places: Places, skin: float) -> None:
        """Find the candidates: edges whose middles are within the halves of their lengths and the depth, and the skin."""
        (one, other), device = self.lines, self._device
        if not len(one.line) or not len(other.line):
            return
        ends = [places[s.name][lines.ends] for s, lines in ((self.own, one), (self.other, other))]
        half = [0.5 * SLACK * float(np.linalg.norm(e[:, 1] - e[:, 0], axis=1).max()) for e in ends]
        pairs = find_pairs(ends[0].mean(1), ends[1].mean(1), sum(half) + self._depth + skin, device)
        rows, cols = pairs.rows().astype(np.int64), pairs.indices.numpy().astype(np.int64)
        if self.own is self.other:
            may = self._apart(rows, cols)
            rows, cols = rows[may], cols[may]
        self.rows = rows_of_pairs(rows, cols, device)
        mine = self.rows.which
        self._ends = rows_of_pairs(one.ends[mine].ravel(), np.repeat(mine, 2), device)
        self._back = rows_of_pairs(other.ends[cols].ravel(), np.repeat(rows, 2), device)
        self.memory.release(self.rows.which)
        self.record.force.zero_()
        self._met.fill_(-1)

    def _apart(self, rows: NDArray[np.int64], cols: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which pairs of a surface's own edges may meet: those of which no end lies near a face of the other."""
        lines = self.lines[0]
        found = np.ones(len(rows), bool)
        for end in range(2):
            for side in range(2):
                found &= self.own.meets(lines.ends[rows, end], lines.sides[cols, side])
        return found

    @property
    def near(self) -> list[tuple[Met, NDArray[np.int64], NDArray[np.int64]]]:
        """Of each of the two surfaces, the vertices that kernels read or write; of faces they read what is around these."""
        one, other = self.lines
        theirs, none = among(len(other.line), self.rows.struct.indices.numpy()), np.zeros(0, np.int64)
        return [
            (self.own, among(self.own.n, one.line[self.rows.which]), none),
            (self.other, among(self.other.n, other.line[theirs]), none),
        ]

    def act(self) -> None:
        """Add the forces to those of both surfaces (launches)."""
        if not self.rows.count:
            return
        real, launch = self._space.scalar, self._clock.launch
        inputs = [self.rows.struct, self.own.struct, self._structs[0], self.other.struct, self._structs[1]]
        inputs += [self._clock.time, self.memory.kept, real(self.stiffness), real(self._depth)]
        launch(cross_kernel(self._space), self.rows.count, inputs, [self.memory.trial, self.record])
        for rows, lines, back, side in self._sides():
            launch(ends_kernel(self._space, back), rows.count, [rows.struct, lines, self.record], [side.force])

    def _sides(self) -> list[tuple[Candidates, Struct, bool, Met]]:
        return [(self._ends, self._structs[0], False, self.own), (self._back, self._structs[1], True, self.other)]

    def close(self) -> None:
        """Take the memory of the last evaluation as that of the step (a launch)."""
        self.memory.keep(self.rows)

    def gather(self) -> None:
        """Every process finds all."""
