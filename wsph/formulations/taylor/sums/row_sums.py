"""What rows of the lattice gather of the corners of their cells, or of the cells around a node: sums of 2^dim that stand
side by side (`wsph.formulations.lattice.lanes`)."""

from collections.abc import Callable
from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.lanes import VECTORS, capacity_of, corner_edges, entry_of
from wsph.formulations.lattice.runs import HEAD


def _lines(space: Space, width: int, count: int) -> tuple[str, Callable[[int, int], str]]:
    """Native code that opens a function of a `block`, whose rows gather of a `field` of `count` numbers; and that of a
    number of what is at the corner of the row e, by both their numbers. What is behind a row along the last axis is before
    the next one: of rows side by side the lines that they gather of stand beside each other, one number after the other,
    and loops read them once, as vectors: a row of stresses in 3D takes 19 ns in place of 35."""
    dim, long = space.dim, capacity_of(width) + 1
    entry = [
        entry_of(space),
        *(f"const S* p{c} = (const S*)field.data + {count}*((int64_t)at[{HEAD + c}] + lane);" for c in range(2**dim)),
    ]
    if width == 1:
        return "\n".join(entry), lambda c, a: f"p{c}[{count}*e+{a}]"
    for c in range(0, 2**dim, 2):
        loads = " ".join(f"t{c}[{a * long}+e] = p{c}[{count}*e+{a}];" for a in range(count))
        entry.append(f"S t{c}[{count * long}]; {VECTORS} for (int e = 0; e <= rows; ++e) {{ {loads} }}")
    return "\n".join(entry), lambda c, a: f"t{c - c % 2}[{a * long}+e+{c % 2}]"


@cache
def means(space: Space, width: int, dtype: type) -> wp.Function:
    """Warp function (blocks, block, lane, rows, field, means_out): of every row of a block the mean of what it gathers of,
    number by number. Of what is nowhere negative it is not, so that what grows everywhere around shrinks nowhere."""
    corners, capacity, count = range(2**space.dim), capacity_of(width), dtype._length_
    entry, number = _lines(space, width, count)
    lines = "\n".join(
        f"o[{a * capacity}+e] = S({0.5**space.dim!r})*({' + '.join(number(c, a) for c in corners)});"
        for a in range(count)
    )

    @wp.func_native(f"""
        {entry}
        S* o = means_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{ {lines} }}
    """)
    def mean(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        field: wp.array(dtype=dtype),
        means_out: wp.array(dtype=space.scalar),
    ): ...

    return mean


@cache
def stress_sums(space: Space, laws: Laws, width: int, rotated: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, field, gradient, sums_out): of every row of a block the mean of the packed
    stresses that it gathers of, and behind it their divergence, dim numbers. The sums of the differences along the axes of
    the grid times `gradient` are the gradient; without `rotated` axes it is diagonal. A loop for every component, so that
    what is unrolled stays small; differences come first: of a stress that is the same everywhere none is left."""
    dim, capacity, components = space.dim, capacity_of(width), laws.state.components
    count, begun, loops = len(components), set[int](), list[str]()
    entry, number = _lines(space, width, count)
    for a, pair in enumerate(components):
        own = [f"const S x{c} = {number(c, a)};" for c in range(2**dim)]
        others = " + ".join(f"(x{c} - x0)" for c in range(1, 2**dim))
        own.append(f"o[{a * capacity}+e] = x0 + S({0.5**dim!r})*({others});")
        acts = dict.fromkeys((pair, pair[::-1])) if max(pair) < dim else {}
        for k in range(dim) if acts else ():
            edges = " + ".join(f"(x{high} - x{low})" for axis, low, high in corner_edges(dim) if axis == k)
            own.append(f"const S d{k} = {edges};")
        for i, j in acts:
            terms = " + ".join(f"g[{k * dim + j}]*d{k}" for k in (range(dim) if rotated else (j,)))
            own.append(f"o[{(count + i) * capacity}+e] {'+=' if i in begun else '='} {terms};")
            begun.add(i)
        loops.append(f"{VECTORS} for (int e = 0; e < rows; ++e) {{ {' '.join(own)} }}")

    @wp.func_native("\n".join([entry, "const S* g = (const S*)&gradient;", "S* o = sums_out.data;", *loops]))
    def sums(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        field: wp.array(dtype=laws.stress),
        gradient: space.mat,
        sums_out: wp.array(dtype=space.scalar),
    ): ...

    return sums
