"""Loops over the rows of a block, side by side: the one room for what cells gather of their corners and hand back to them.

A kernel has an array of its own with `capacity` numbers for each quantity, one after the other. Loops over them read and
write neighbouring numbers, so that the compiler takes as many rows at once as a vector holds; what a point does with its own
numbers is a Warp function as everywhere. On a GPU a thread has one row, the capacity is one, and neighbouring threads read
neighbouring numbers.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product

import warp as wp

from wsph.backend.space import Space
from wsph.backend.tensors import embedded
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.runs import BEFORE, BEHIND, COMPUTED, COPY, HEAD, OWN, PLACE

ACROSS = 32
"""Rows of a block on a GPU, where a thread has one."""


def corner_signs(dim: int) -> list[tuple[int, ...]]:
    """On which side along every axis a corner of a cell is, -1 or 1, in the order in which cells have them."""
    return [tuple(2 * side - 1 for side in sides) for sides in product((0, 1), repeat=dim)]


def corner_edges(dim: int) -> list[tuple[int, int, int]]:
    """The edges of a cell: the axis that each is along, and its corners at the low and at the high end."""
    sides = corner_signs(dim)
    return [
        (axis, c, c + 2 ** (dim - 1 - axis)) for axis in range(dim) for c, side in enumerate(sides) if side[axis] < 0
    ]


@cache
def block_of(dim: int, width: int) -> wp.Function:
    """Warp function (blocks, thread) -> (block, first row, row of the block, rows to compute, rows to write) of a thread: a
    whole block or, where `width` is one, a row of it."""
    columns = HEAD + 2**dim

    @wp.func
    def whole(blocks: wp.array(dtype=wp.int32), thread: int):
        own = blocks[thread * columns + OWN]
        return thread, blocks[thread * columns], int(0), blocks[thread * columns + COMPUTED], own

    @wp.func
    def single(blocks: wp.array(dtype=wp.int32), thread: int):
        block = thread // ACROSS
        lane = thread - block * ACROSS
        many = int(0)
        if lane < blocks[block * columns + OWN]:
            many = int(1)
        return block, blocks[block * columns] + lane, lane, many, many

    return single if width == 1 else whole


def ctype_of_real(space: Space) -> str:
    """The scalar type in C++."""
    return "double" if space.precision == "f64" else "float"


def entry_of(space: Space) -> str:
    """Native code that opens a function of a `block`: the real numbers S, and its entry `at` in the `blocks`."""
    return f"""
        typedef {ctype_of_real(space)} S;
        const int32_t* at = blocks.data + {HEAD + 2**space.dim}*(int64_t)block;
    """


def _corners(space: Space, row: str) -> str:
    """Native code that opens a function of a `block` (`entry_of`), and says where the corners of the cell in a `row` have
    their numbers in the `field`, p0, p1 and on."""
    dim = space.dim
    starts = "\n".join(
        f"const S* p{c} = (const S*)field.data + {dim}*((int64_t)at[{HEAD + c}] + {row});" for c in range(2**dim)
    )
    return f"""
        {entry_of(space)}
        {starts}
    """


VECTORS = "\n#if defined(__clang__) && !defined(__CUDACC__)\n#pragma clang loop vectorize(enable)\n#endif\n"


@cache
def corner_sums(space: Space, width: int, mean: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, field, sums_out) of a field of vectors at the nodes: of every cell of a
    block the differences along every axis, summed over its edges, (dim, dim) numbers, and with `mean` the mean of its
    corners. Differences come first: what is the same everywhere leaves no rounding."""
    dim, capacity, lines = space.dim, capacity_of(width), []
    for a in range(dim):
        own = [f"const S x{c} = p{c}[{dim}*e+{a}];" for c in range(2**dim)]
        for k in range(dim):
            edges = " + ".join(f"(x{high} - x{low})" for axis, low, high in corner_edges(dim) if axis == k)
            own.append(f"o[{(a * dim + k) * capacity}+e] = {edges};")
        if mean:
            others = " + ".join(f"(x{c} - x0)" for c in range(1, 2**dim))
            own.append(f"o[{(dim * dim + a) * capacity}+e] = x0 + S({0.5**dim!r})*({others});")
        lines.append(f"{{ {' '.join(own)} }}")

    @wp.func_native(f"""
        {_corners(space, "lane")}
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


def quantities(dim: int, stabilised: bool) -> int:
    """Numbers that a cell hands to its nodes: the stress times what the forces take of it, less the stabilisation's part,
    dim dim; where there is one the mean of the corners' displacements, dim, and its stiffness."""
    return dim**2 + (dim + 1) * stabilised


def capacity_of(width: int) -> int:
    """Rows that a block in segments of `width` nodes has at most, in whole vectors: a line may end with one more."""
    return 1 if width == 1 else width + width // 2


def places_of(width: int) -> int:
    """Places of a chunk."""
    return (ACROSS if width == 1 else width) + 2


@cache
def hand_over(space: Space, width: int, numbers: int) -> wp.Function:
    """Warp function (blocks, block, lane, rows, values, chunks_out): `numbers` of every cell of a block go to its place, and
    places without a cell get zeros."""
    capacity, places = capacity_of(width), places_of(width)

    @wp.func_native(f"""
        {entry_of(space)}
        const bool ends = rows > 0 && lane + rows == at[{OWN}];
        for (int k = 0; k < {numbers}; ++k) {{
            S* to = chunks_out.data + at[{PLACE}] + lane + k*{places};
            const S* from = values.data + k*{capacity};
            {VECTORS}
            for (int e = 0; e < rows; ++e) to[e] = from[e];
            if (lane == 0) for (int e = 1; e <= at[{BEFORE}]; ++e) to[-e] = S(0);
            if (ends) for (int e = 0; e < at[{BEHIND}]; ++e) to[rows + e] = S(0);
            if (ends && at[{COPY}] >= 0) chunks_out.data[at[{COPY}] + k*{places}] = from[rows - 1];
        }}
    """)
    def hand(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        values: wp.array(dtype=space.scalar),
        chunks_out: wp.array(dtype=space.scalar),
    ): ...

    return hand


@cache
def pull_of_cells(space: Space, width: int, held: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, chunks, displacement, pull_out): the forces on every node of a block of what
    its cells have in their places: the tensors' columns by the side that the node is on, and where `held` less their share
    of what the node is off their mean. Differences come first: of a stress that is the same everywhere none is left."""
    dim, capacity, L = space.dim, capacity_of(width), places_of(width)
    lines, edges = [], corner_edges(dim)
    for a in range(dim):
        steps = [f"(q{c}[{(a * dim + k) * L}+e] - q{high}[{(a * dim + k) * L}+e])" for k, c, high in edges]
        lines.append(f"S f{a} = {' + '.join(steps)};")
        if held:
            lines.append(f"const S u{a} = own[{dim}*e+{a}];")
            lines += [
                f"f{a} -= q{c}[{(dim * dim + dim) * L}+e]*(u{a} - q{c}[{(dim * dim + a) * L}+e]);"
                for c in range(2**dim)
            ]
        lines.append(f"o[{a * capacity}+e] = f{a};")
    starts = "\n".join(f"const S* q{c} = chunks.data + at[{HEAD + c}] + lane;" for c in range(2**dim))

    @wp.func_native(f"""
        {entry_of(space)}
        {starts}
        const S* own = (const S*)displacement.data + {dim}*((int64_t)at[0] + lane);
        S* o = pull_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{ {" ".join(lines)} }}
    """)
    def pull(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        chunks: wp.array(dtype=space.scalar),
        displacement: wp.array(dtype=space.vec),
        pull_out: wp.array(dtype=space.scalar),
    ): ...

    return pull


@cache
def lane(
    space: Space, width: int, dtype: type, first: int = 0, count: int | None = None
) -> tuple[wp.Function, wp.Function]:
    """Warp functions (values, row) -> the numbers of a row, from the `first` quantity on, as a vector or a matrix, and
    (values_out, row, that) that sets them. `count`: how many there are, where the type has room for more."""
    capacity, places = capacity_of(width), range(dtype._length_ if count is None else count)
    S = ctype_of_real(space)
    stores = " ".join(f"a_out.data[{(first + k) * capacity}+e] = ((const {S}*)&v)[{k}];" for k in places)
    loads = " ".join(f"(({S}*)&v)[{k}] = a.data[{(first + k) * capacity}+e];" for k in places)

    @wp.func_native(f"{ctype_of(space, dtype)} v; {loads} return v;")
    def get(a: wp.array(dtype=space.scalar), e: int) -> dtype: ...

    @wp.func_native(stores)
    def put(a_out: wp.array(dtype=space.scalar), e: int, v: dtype): ...

    return get, put


@dataclass(frozen=True)
class Beside:
    """The laws of rows side by side, and how rows get and put what these take and give, from and to the numbers of a block.

    matrix, stress, memory  # (values, row) -> matrix, packed stress, internals; and (values_out, row, that)
    widened                 # matrix of the space -> matrix of the laws
    """

    laws: Laws
    matrix: tuple[wp.Function, wp.Function]
    stress: tuple[wp.Function, wp.Function]
    memory: tuple[wp.Function, wp.Function]
    widened: wp.Function


@cache
def beside(space: Space, laws: Laws, width: int) -> Beside:
    """What rows use of a material's `laws` whose fields they read, `width` rows a thread."""
    own = laws if width == 1 else laws.beside
    stress, memory = (
        lane(space, width, wide, 0, narrow._length_)
        for wide, narrow in ((own.stress, laws.stress), (own.internal, laws.internal))
    )
    if own.space.dim == space.dim:
        return Beside(own, lane(space, width, space.mat), stress, memory, _itself(space.mat))
    return Beside(own, plane_lane(space, width), stress, memory, embedded(space))


@cache
def _itself(dtype: type) -> wp.Function:
    """Warp function that gives what it takes."""

    @wp.func
    def itself(a: dtype) -> dtype:
        return a

    return itself


@cache
def plane_lane(space: Space, width: int) -> tuple[wp.Function, wp.Function]:
    """Warp functions as those of `lane`, of tensors with a plane block that is the row's matrix and nothing else."""
    capacity, dim, S = capacity_of(width), space.dim, ctype_of_real(space)
    places = [(a, b, (a * dim + b) * capacity) for a in range(dim) for b in range(dim)]
    loads = " ".join(f"v.data[{a}][{b}] = a.data[{at}+e];" for a, b, at in places)
    stores = " ".join(f"a_out.data[{at}+e] = ((const {S}*)&v)[{3 * a + b}];" for a, b, at in places)

    @wp.func_native(f"{ctype_of(space, space.tensor)} v(0); {loads} return v;")
    def get(a: wp.array(dtype=space.scalar), e: int) -> space.tensor: ...

    @wp.func_native(stores)
    def put(a_out: wp.array(dtype=space.scalar), e: int, v: space.tensor): ...

    return get, put


def ctype_of(space: Space, dtype: type) -> str:
    """A vector or matrix type in C++."""
    shape, kind = dtype._shape_, "vec_t" if len(dtype._shape_) == 1 else "mat_t"
    return f"wp::{kind}<{','.join(str(n) for n in shape)},wp::float{space.precision[1:]}>"


@cache
def field_lanes(space: Space, width: int, dtype: type) -> tuple[wp.Function, wp.Function]:
    """Warp functions (field, first, rows, values_out): neighbouring elements of a field side by side; and (values, first,
    rows, field_out), back."""
    S, capacity, count = ctype_of_real(space), capacity_of(width), dtype._length_
    loads = " ".join(f"values_out.data[{k * capacity}+e] = x[{count}*e+{k}];" for k in range(count))
    stores = " ".join(f"x[{count}*e+{k}] = values.data[{k * capacity}+e];" for k in range(count))
    loop = f"{VECTORS} for (int e = 0; e < rows; ++e)"

    @wp.func_native(f"const {S}* x = (const {S}*)field.data + {count}*(int64_t)first; {loop} {{ {loads} }}")
    def read(field: wp.array(dtype=dtype), first: int, rows: int, values_out: wp.array(dtype=space.scalar)): ...

    @wp.func_native(f"{S}* x = ({S}*)field_out.data + {count}*(int64_t)first; {loop} {{ {stores} }}")
    def write(values: wp.array(dtype=space.scalar), first: int, rows: int, field_out: wp.array(dtype=dtype)): ...

    return read, write


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
    dim, signs, lines = space.dim, corner_signs(space.dim), []
    for a in range(dim):
        own = [f"const S x{c} = p{c}[{a}];" for c in range(2**dim)]
        others = " + ".join(f"(x{c} - x0)" for c in range(1, 2**dim))
        own.append(f"const S m = x0 + S({0.5**dim!r})*({others});")
        for k in range(dim):
            edges = " + ".join(f"(x{high} - x{low})" for axis, low, high in corner_edges(dim) if axis == k)
            own.append(f"const S h{k} = S({0.5**dim!r})*({edges});")
        for c, sign in enumerate(signs):
            linear = " ".join(f"{'-' if sign[k] > 0 else '+'} h{k}" for k in range(dim))
            own.append(f"{{ const S left = x{c} - m {linear}; square += left*left; }}")
        lines.append(f"{{ {' '.join(own)} }}")

    @wp.func_native(f"""
        {_corners(space, "row")}
        S square = S(0);
        {" ".join(lines)}
        return square;
    """)
    def square(
        blocks: wp.array(dtype=wp.int32), block: int, row: int, field: wp.array(dtype=space.vec)
    ) -> space.scalar: ...

    return square
