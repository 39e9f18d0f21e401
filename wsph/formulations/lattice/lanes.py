"""Loops over the rows of a block, side by side: the one room for what cells gather of their corners and hand back to them.

A kernel has an array of its own with `capacity` numbers for each quantity, one after the other. Loops over them read and
write neighbouring numbers, so that the compiler takes as many rows at once as a vector holds; what a point does with its own
numbers is a Warp function as everywhere. On a GPU a thread has one row, the capacity is one, and neighbouring threads read
neighbouring numbers.
"""

from functools import cache
from itertools import product

import warp as wp

from wsph.backend.space import Space
from wsph.formulations.lattice.runs import HEAD

ACROSS = 32
"""Rows of a block on a GPU, where a thread has one."""


def corner_signs(dim: int) -> list[tuple[int, ...]]:
    """On which side along every axis a corner of a cell is, -1 or 1, in the order in which cells have them."""
    return [tuple(2 * side - 1 for side in sides) for sides in product((0, 1), repeat=dim)]


@cache
def block_of(dim: int, width: int) -> wp.Function:
    """Warp function (blocks, thread) -> (block, first row, row of the block, rows to compute, rows to write) of a thread: a
    whole block or, where `width` is one, a row of it."""
    columns = HEAD + 2**dim

    @wp.func
    def whole(blocks: wp.array(dtype=wp.int32), thread: int):
        own = blocks[thread * columns + 1]
        return thread, blocks[thread * columns], int(0), blocks[thread * columns + 2], own

    @wp.func
    def single(blocks: wp.array(dtype=wp.int32), thread: int):
        block = thread // ACROSS
        lane = thread - block * ACROSS
        many = int(0)
        if lane < blocks[block * columns + 1]:
            many = int(1)
        return block, blocks[block * columns] + lane, lane, many, many

    return single if width == 1 else whole


def _real(space: Space) -> str:
    return "double" if space.precision == "f64" else "float"


VECTORS = "\n#if defined(__clang__) && !defined(__CUDACC__)\n#pragma clang loop vectorize(enable)\n#endif\n"


@cache
def corner_sums(space: Space, width: int, mean: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, field, sums_out) of a field of vectors at the nodes: of every cell of a block
    the differences along every axis, summed over its edges, (dim, dim) numbers, and with `mean` the mean of its corners.
    Differences come first: what is the same everywhere leaves no rounding."""
    dim, S = space.dim, _real(space)
    signs, capacity = corner_signs(dim), capacity_of(width)
    lines = []
    for a in range(dim):
        own = [f"const S x{c} = p{c}[{dim}*e+{a}];" for c in range(2**dim)]
        for k in range(dim):
            low = [c for c, sign in enumerate(signs) if sign[k] < 0]
            edges = " + ".join(f"(x{c + 2 ** (dim - 1 - k)} - x{c})" for c in low)
            own.append(f"o[{(a * dim + k) * capacity}+e] = {edges};")
        if mean:
            others = " + ".join(f"(x{c} - x0)" for c in range(1, 2**dim))
            own.append(f"o[{(dim * dim + a) * capacity}+e] = x0 + S({0.5**dim!r})*({others});")
        lines.append(f"{{ {' '.join(own)} }}")
    starts = "\n".join(
        f"const S* p{c} = (const S*)field.data + {dim}*((int64_t)at[{HEAD + c}] + lane);" for c in range(2**dim)
    )

    @wp.func_native(f"""
        typedef {S} S;
        const int32_t* at = blocks.data + {HEAD + 2**dim}*(int64_t)block;
        {starts}
        S* o = sums_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{
            {" ".join(lines)}
        }}
    """)
    def sums(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        field: wp.array(dtype=space.vec),
        sums_out: wp.array(dtype=space.scalar),
    ): ...

    return sums


def capacity_of(width: int) -> int:
    """Rows that a block of about `width` has at most, in whole vectors."""
    return 1 if width == 1 else 2 * width


@cache
def hand_over(space: Space, width: int, numbers: int) -> wp.Function:
    """Warp function (blocks, block, lane, rows, stride, pad, values, slots_out): `numbers` of every cell of a block go to its
    slot, each quantity in a row of its own, `stride` slots long."""
    dim, S, capacity = space.dim, _real(space), capacity_of(width)

    @wp.func_native(f"""
        typedef {S} S;
        const int64_t slot = (int64_t)blocks.data[{HEAD + 2**dim}*(int64_t)block + {HEAD}] + lane + pad;
        for (int k = 0; k < {numbers}; ++k) {{
            S* to = slots_out.data + k*(int64_t)stride + slot;
            const S* from = values.data + k*{capacity};
            {VECTORS}
            for (int e = 0; e < rows; ++e) to[e] = from[e];
        }}
    """)
    def hand(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        stride: int,
        pad: int,
        values: wp.array(dtype=space.scalar),
        slots_out: wp.array(dtype=space.scalar),
    ): ...

    return hand


@cache
def pull_of_cells(space: Space, width: int, held: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, stride, slots, displacement, pull_out): the forces on every node of a block of
    what its cells have in their slots: less the tensors' columns by the side that the node is on, and where `held` less
    their share of what the node is off their mean."""
    dim, S, capacity = space.dim, _real(space), capacity_of(width)
    lines = []
    for a in range(dim):
        terms = []
        for c, sign in enumerate(corner_signs(dim)):
            column = [f"{'-' if sign[k] > 0 else '+'} q{c}[{a * dim + k}*L+e]" for k in range(dim)]
            terms.append(" ".join(column))
        lines.append(f"S f{a} = {' '.join(terms)};")
        if held:
            lines.append(f"const S u{a} = own[{dim}*e+{a}];")
            lines += [
                f"f{a} -= q{c}[{dim * dim + dim}*L+e]*(u{a} - q{c}[{dim * dim + a}*L+e]);" for c in range(2**dim)
            ]
        lines.append(f"o[{a * capacity}+e] = f{a};")
    starts = "\n".join(f"const S* q{c} = slots.data + ((int64_t)at[{HEAD + c}] + lane);" for c in range(2**dim))

    @wp.func_native(f"""
        typedef {S} S;
        const int32_t* at = blocks.data + {HEAD + 2**dim}*(int64_t)block;
        const int64_t L = stride;
        {starts}
        const S* own = (const S*)displacement.data + {dim}*((int64_t)at[0] + lane);
        S* o = pull_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{
            {" ".join(lines)}
        }}
    """)
    def pull(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        stride: int,
        slots: wp.array(dtype=space.scalar),
        displacement: wp.array(dtype=space.vec),
        pull_out: wp.array(dtype=space.scalar),
    ): ...

    return pull


@cache
def lane_matrix(space: Space, width: int) -> tuple[wp.Function, wp.Function]:
    """Warp functions (values, row) -> the first (dim, dim) numbers of a row, and (values_out, row, matrix) that sets them."""
    dim, capacity, mat = space.dim, capacity_of(width), space.mat
    entries = ", ".join(f"a.data[{k * capacity}+e]" for k in range(dim * dim))
    stores = " ".join(f"a_out.data[{(i * dim + j) * capacity}+e] = m.data[{i}][{j}];" for i, j in product(range(dim), repeat=2))

    @wp.func_native(f"return {{{entries}}};")
    def get(a: wp.array(dtype=space.scalar), e: int) -> mat: ...

    @wp.func_native(stores)
    def put(a_out: wp.array(dtype=space.scalar), e: int, m: mat): ...

    return get, put


@cache
def lane_vector(space: Space, width: int, first: int = 0) -> wp.Function:
    """Warp function (values, row) -> dim numbers of a row, from the quantity `first` on."""
    capacity, vec = capacity_of(width), space.vec
    entries = ", ".join(f"a.data[{(first + k) * capacity}+e]" for k in range(space.dim))

    @wp.func_native(f"return {{{entries}}};")
    def get(a: wp.array(dtype=space.scalar), e: int) -> vec: ...

    return get


@cache
def set_lane(space: Space, width: int, quantity: int) -> wp.Function:
    """Warp function (values_out, row, number) that sets one quantity of a row."""

    @wp.func_native(f"a_out.data[{quantity * capacity_of(width)}+e] = value;")
    def put(a_out: wp.array(dtype=space.scalar), e: int, value: space.scalar): ...

    return put


@cache
def corner_misfit(space: Space) -> wp.Function:
    """Warp function (blocks, block, row, displacement) -> sum over the corners of a cell of |u - mean - H r|^2, what of the
    displacements is in no linear field."""
    dim, S, signs = space.dim, _real(space), corner_signs(space.dim)
    lines = []
    for a in range(dim):
        own = [f"const S x{c} = p{c}[{a}];" for c in range(2**dim)]
        others = " + ".join(f"(x{c} - x0)" for c in range(1, 2**dim))
        own.append(f"const S m = x0 + S({0.5**dim!r})*({others});")
        for k in range(dim):
            low = [c for c, sign in enumerate(signs) if sign[k] < 0]
            edges = " + ".join(f"(x{c + 2 ** (dim - 1 - k)} - x{c})" for c in low)
            own.append(f"const S h{k} = S({0.5**dim!r})*({edges});")
        for c, sign in enumerate(signs):
            linear = " ".join(f"{'-' if sign[k] > 0 else '+'} h{k}" for k in range(dim))
            own.append(f"{{ const S left = x{c} - m {linear}; square += left*left; }}")
        lines.append(f"{{ {' '.join(own)} }}")
    starts = "\n".join(
        f"const S* p{c} = (const S*)field.data + {dim}*((int64_t)at[{HEAD + c}] + row);" for c in range(2**dim)
    )

    @wp.func_native(f"""
        typedef {S} S;
        const int32_t* at = blocks.data + {HEAD + 2**dim}*(int64_t)block;
        {starts}
        S square = S(0);
        {" ".join(lines)}
        return square;
    """)
    def square(
        blocks: wp.array(dtype=wp.int32), block: int, row: int, field: wp.array(dtype=space.vec)
    ) -> space.scalar: ...

    return square
