"""Loops over the rows of a block, of nodes that see each other along the edges of their cells.

With n_- and n_+ of the N cells at a node behind and before it on an axis of step h, the weights, moments and volumes of
`wsph.formulations.lagrangian.edges` leave the shares c = n/N alone, c_- + c_+ = 1 on every axis k, and V = N V_c/2^dim:

    D_k = (c_+ (u_+ - u) + c_- (u - u_-))/h,  H = sum_k D_k (x) e_k          the gradient, by its columns along the axes
    avg(A) = A + 1/6 sum_k (c_+ (A_+ - A) + c_- (A_- - A))                   the average over the edges
    T_k = avg(P e)_k/2 - kappa/(2 dim) D_k                                   what forces take, kappa the stabilisation
    f/V = sum_k 2/h (c_+ (T + T_+) - c_- (T + T_-))_k + 2 kappa/(dim h^2) (c_+ (u_+ - u) + c_- (u_- - u))

Where the stabilisation fades (`wsph.parts.fading`) kappa is what is left of it, of a pair the mean of both.

Numbers of a row that go from one loop to the next stand in flat arrays, number m of row i at m `stride` + i. What is the
same everywhere leaves no rounding: differences come first.
"""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.formulations.lattice.lanes import VECTORS, capacity_of, ctype_of_real, entry_of
from wsph.formulations.lattice.runs import CLOSES, HEAD, OPENS, OWN, SHARES


def _opened(space: Space, width: int) -> str:
    """Native code that opens a function of a `block`: its entry `at` in the `blocks`, the shares before and behind a row on
    every axis, a0, b0 and on, and on the last, by row, al and bl."""
    last = space.dim - 1
    shares = "\n".join(f"const S b{k} = S((s >> {4 + 4 * k}) & 15)/S(s & 15), a{k} = S(1) - b{k};" for k in range(last))
    rows = f"""
        S al[{capacity_of(width)}], bl[{capacity_of(width)}];
        for (int e = 0; e < rows; ++e) {{ al[e] = a{last}; bl[e] = b{last}; }}
        if (rows > 0 && lane == 0 && at[{OPENS}]) {{ al[0] = S(0); bl[0] = S(1); }}
        if (rows > 0 && at[{CLOSES}] && at[{OWN}] - 1 - lane < rows) {{
            al[at[{OWN}] - 1 - lane] = S(1); bl[at[{OWN}] - 1 - lane] = S(0);
        }}
    """
    return f"""
        {entry_of(space)}
        const int32_t s = at[{SHARES}];
        {shares}
        const S b{last} = S((s >> 20) & 15)/S((s >> 16) & 15), a{last} = S(1) - b{last};
        {rows}
    """


def _side(dim: int, k: int) -> tuple[str, str]:
    """The shares before and behind a row on axis k."""
    return ("al[e]", "bl[e]") if k == dim - 1 else (f"a{k}", f"b{k}")


def _starts(space: Space, field: str, numbers: int, names: str = "xpq", start: str = "") -> str:
    """Native code of where a row and its neighbours have their numbers in a field from its `start` on: by three `names`,
    that of the row, and of those before and behind, x, p0, q0 and on."""
    row, before, behind = names
    data = f"(const S*){field}.data{start}"
    found = [f"const S* {row} = {data} + {numbers}*((int64_t)at[0] + lane);"]
    for k in range(space.dim):
        for name, side in ((before, 2 * k), (behind, 2 * k + 1)):
            found.append(f"const S* {name}{k} = {data} + {numbers}*((int64_t)at[{HEAD + side}] + lane);")
    return "\n".join(found)


@cache
def differences(space: Space, width: int) -> wp.Function:
    """Warp function (blocks, block, lane, rows, field, inverse, columns_out): the columns of the gradient of a field of
    vectors, from the `inverse` of the steps."""
    dim, capacity, lines = space.dim, capacity_of(width), []
    for a in range(dim):
        lines.append(f"const S x{a} = x[{dim}*e+{a}];")
        for k in range(dim):
            before, behind = _side(dim, k)
            steps = f"{behind}*(q{k}[{dim}*e+{a}] - x{a}) + {before}*(x{a} - p{k}[{dim}*e+{a}])"
            lines.append(f"o[{(a * dim + k) * capacity}+e] = i{k}*({steps});")
    inverses = " ".join(f"const S i{k} = inverse[{k}];" for k in range(dim))

    @wp.func_native(f"""
        {_opened(space, width)}
        {_starts(space, "field", dim)}
        {inverses}
        S* o = columns_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{ {" ".join(lines)} }}
    """)
    def columns(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        field: wp.array(dtype=space.vec),
        inverse: space.vec,
        columns_out: wp.array(dtype=space.scalar),
    ): ...

    return columns


@cache
def averages(space: Space, width: int) -> wp.Function:
    """Warp function (blocks, block, lane, rows, flat, stride, values_out): the average of a flat array over the edges."""

    @wp.func_native(_averaging(space, width, "x[e] + change"))
    def average(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        flat: wp.array(dtype=space.scalar),
        stride: int,
        values_out: wp.array(dtype=space.scalar),
    ): ...

    return average


@cache
def passed_on(space: Space, width: int, stabilised: bool, fades: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, nominal, columns, hold, left, stride, values_out): what forces take, from
    the columns of the stress and, where there is a stabilisation of strength `hold`, of the gradient; `left` of it is where
    it fades."""
    kept = "*left.data[at[0] + lane + e]" if fades else ""
    held = f" - hold*columns.data[m*(int64_t)stride + at[0] + lane + e]{kept}" if stabilised else ""

    @wp.func_native(_averaging(space, width, f"S(0.5)*(x[e] + change){held}", "nominal"))
    def passed(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        nominal: wp.array(dtype=space.scalar),
        columns: wp.array(dtype=space.scalar),
        hold: space.scalar,
        left: wp.array(dtype=space.scalar),
        stride: int,
        values_out: wp.array(dtype=space.scalar),
    ): ...

    return passed


def _averaging(space: Space, width: int, result: str, flat: str = "flat") -> str:
    """Native code of an average; `result`: of what a row has itself, x[e], and the change of it."""
    dim, S = space.dim, ctype_of_real(space)
    sides = [_side(dim, k) for k in range(dim)]
    terms = " + ".join(f"({b}*(q{k}[e] - x[e]) + {a}*(p{k}[e] - x[e]))" for k, (a, b) in enumerate(sides))
    return f"""
        {_opened(space, width)}
        for (int m = 0; m < {dim**2}; ++m) {{
            {_starts(space, flat, 1, start=" + m*(int64_t)stride")}
            S* o = values_out.data + m*{capacity_of(width)};
            {VECTORS}
            for (int e = 0; e < rows; ++e) {{
                const {S} change = S({1.0 / 6.0!r})*({terms});
                o[e] = {result};
            }}
        }}
    """


@cache
def pull_along_edges(space: Space, width: int, stabilised: bool, fades: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, passed, displacement, inverse, hold, left, stride, pull_out): forces per
    volume of the stress and of a stabilisation of strength `hold`, of which `left` is where it fades."""
    dim, capacity, lines = space.dim, capacity_of(width), []
    if fades:
        for k in range(dim):
            lines.append(f"const S z{k} = S(0.5)*(l[e] + n{k}[e]), y{k} = S(0.5)*(l[e] + m{k}[e]);")
    for a in range(dim):
        terms: list[str] = []
        for k in range(dim):
            before, behind = _side(dim, k)
            m = f"{a * dim + k}*(int64_t)stride+e"
            terms.append(f"c{k}*(({behind}*q{k}[{m}] - {before}*p{k}[{m}]) + ({behind} - {before})*x[{m}])")
            if stabilised:
                own, low, high = (f"{name}[{dim}*e+{a}]" for name in ("u", f"v{k}", f"w{k}"))
                after, ahead = (f"{behind}*z{k}", f"{before}*y{k}") if fades else (behind, before)
                terms.append(f"d{k}*({after}*({high} - {own}) + {ahead}*({low} - {own}))")
        lines.append(f"o[{a * capacity}+e] = {' + '.join(terms)};")
    constants = " ".join(
        f"const S c{k} = S(2)*inverse[{k}], d{k} = S(4)*hold*inverse[{k}]*inverse[{k}];" for k in range(dim)
    )

    @wp.func_native(f"""
        {_opened(space, width)}
        {_starts(space, "passed", 1)}
        {_starts(space, "displacement", dim, "uvw")}
        {_starts(space, "left", 1, "lmn") if fades else ""}
        {constants}
        S* o = pull_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{ {" ".join(lines)} }}
    """)
    def pull(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        passed: wp.array(dtype=space.scalar),
        displacement: wp.array(dtype=space.vec),
        inverse: space.vec,
        hold: space.scalar,
        left: wp.array(dtype=space.scalar),
        stride: int,
        pull_out: wp.array(dtype=space.scalar),
    ): ...

    return pull


@cache
def pairs_of(space: Space, width: int, fades: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, side, columns, displacement, velocity, step, left, stride, values_out): of
    every row and its neighbour on a `side`, 2 k before and 2 k + 1 behind on axis k: what their displacements differ by,
    their velocities, what both gradients say of that together, dim numbers each, the share of the row's cells between them,
    and where it fades what is left of that. Where there are none the row is its own neighbour."""
    dim, capacity = space.dim, capacity_of(width)
    mean = "S(0.5)*(left.data[from + e] + left.data[to + e])"
    faded = f"o[{(3 * dim + 1) * capacity}+e] = share[e]*({mean});" if fades else ""
    cases = " ".join(f"if (side/2 == {k}) {{ before = a{k}; behind = b{k}; }}" for k in range(dim))
    lines: list[str] = []
    for a in range(dim):
        m = f"{dim}*e+{a}"
        columns = f"h*(g[{dim * a}*(int64_t)stride+e] + d[{dim * a}*(int64_t)stride+e])"
        differences = (f"w[{m}] - u[{m}]", f"z[{m}] - v[{m}]", columns)
        for n, each in enumerate(differences):
            # Read before it is asked whether it counts: what is read under a condition is read number by number.
            lines.append(f"{{ const S c = {each}; o[{(n * dim + a) * capacity}+e] = there ? c : S(0); }}")

    @wp.func_native(f"""
        {_opened(space, width)}
        S before, behind;
        {cases}
        S share[{capacity}];
        const bool ahead = side % 2;
        for (int e = 0; e < rows; ++e) share[e] = ahead ? behind : before;
        if (side/2 == {dim - 1}) for (int e = 0; e < rows; ++e) share[e] = ahead ? bl[e] : al[e];
        const int64_t from = (int64_t)at[0] + lane, to = (int64_t)at[{HEAD} + side] + lane;
        const S *u = (const S*)displacement.data + {dim}*from, *w = (const S*)displacement.data + {dim}*to;
        const S *v = (const S*)velocity.data + {dim}*from, *z = (const S*)velocity.data + {dim}*to;
        const S *d = columns.data + (side/2)*(int64_t)stride + from, *g = columns.data + (side/2)*(int64_t)stride + to;
        const S h = ahead ? step : -step;
        S* o = values_out.data;
        {VECTORS}
        for (int e = 0; e < rows; ++e) {{
            const bool there = share[e] > S(0);
            {" ".join(lines)}
            o[{3 * dim * capacity}+e] = share[e];
            {faded}
        }}
    """)
    def pairs(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        side: int,
        columns: wp.array(dtype=space.scalar),
        displacement: wp.array(dtype=space.vec),
        velocity: wp.array(dtype=space.vec),
        step: space.scalar,
        left: wp.array(dtype=space.scalar),
        stride: int,
        values_out: wp.array(dtype=space.scalar),
    ): ...

    return pairs


@cache
def flat_lanes(space: Space, width: int, numbers: int) -> tuple[wp.Function, wp.Function]:
    """Warp functions (flat, first, rows, stride, values_out): so many numbers of neighbouring rows of a flat array; and
    (values, first, rows, stride, flat_out), back."""
    S = ctype_of_real(space)

    @wp.func_native(f"""
        for (int m = 0; m < {numbers}; ++m) {{
            const {S}* from = flat.data + m*(int64_t)stride + first;
            {S}* to = values_out.data + m*{capacity_of(width)};
            {VECTORS}
            for (int e = 0; e < rows; ++e) to[e] = from[e];
        }}
    """)
    def read(
        flat: wp.array(dtype=space.scalar),
        first: int,
        rows: int,
        stride: int,
        values_out: wp.array(dtype=space.scalar),
    ): ...

    @wp.func_native(f"""
        for (int m = 0; m < {numbers}; ++m) {{
            {S}* to = flat_out.data + m*(int64_t)stride + first;
            const {S}* from = values.data + m*{capacity_of(width)};
            {VECTORS}
            for (int e = 0; e < rows; ++e) to[e] = from[e];
        }}
    """)
    def write(
        values: wp.array(dtype=space.scalar),
        first: int,
        rows: int,
        stride: int,
        flat_out: wp.array(dtype=space.scalar),
    ): ...

    return read, write


@cache
def flat_means(space: Space, width: int) -> wp.Function:
    """Warp function (runs, run, lane, many, weights, values_out): numbers of a flat array, at every member of so many blocks
    of a run, become the mean of their block by weight (`wsph.formulations.lattice.edges.blocks`)."""
    corners, size = range(2**space.dim), 1 if width == 1 else width
    sums = " ".join(
        f"""if (at[{1 + c}] >= 0) {{
            const S *w = weights.data + at[{1 + c}] + 2*lane, *x = values_out.data + at[{1 + c}] + 2*lane;
            {VECTORS}
            for (int e = 0; e < many; ++e) {{ whole[e] += w[2*e]; sum[e] += w[2*e]*x[2*e]; }}
        }}"""
        for c in corners
    )
    stores = " ".join(
        f"""if (at[{1 + c}] >= 0) {{
            S* o = values_out.data + at[{1 + c}] + 2*lane;
            for (int e = 0; e < many; ++e) o[2*e] = sum[e];
        }}"""
        for c in corners
    )

    @wp.func_native(f"""
        typedef {ctype_of_real(space)} S;
        const int32_t* at = runs.data + {1 + 2**space.dim}*(int64_t)run;
        S whole[{size}], sum[{size}];
        for (int e = 0; e < many; ++e) {{ whole[e] = S(0); sum[e] = S(0); }}
        {sums}
        for (int e = 0; e < many; ++e) sum[e] /= whole[e];
        {stores}
    """)
    def means(
        runs: wp.array(dtype=wp.int32),
        run: int,
        lane: int,
        many: int,
        weights: wp.array(dtype=space.scalar),
        values_out: wp.array(dtype=space.scalar),
    ): ...

    return means


@cache
def edge_misfit(space: Space) -> wp.Function:
    """Warp function (blocks, block, row, displacement, inverse) -> sum over the edges of a row of its block of their weights
    times |u_j - u - H r|^2, per volume: (2/h^2) c_- c_+ |(u_+ - u) + (u_- - u)|^2 of every axis."""
    dim, lines = space.dim, []
    for k in range(dim):
        second = [f"(q{k}[{a}] - x[{a}]) + (p{k}[{a}] - x[{a}])" for a in range(dim)]
        before, behind = _side(dim, k)
        lines += [
            f"{{ const S c = {each}; square += S(2)*{before}*{behind}*inverse[{k}]*inverse[{k}]*c*c; }}"
            for each in second
        ]

    @wp.func_native(f"""
        const int lane = row, rows = 1, e = 0;
        {_opened(space, 1)}
        {_starts(space, "displacement", dim)}
        S square = S(0);
        {" ".join(lines)}
        return square;
    """)
    def square(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        row: int,
        displacement: wp.array(dtype=space.vec),
        inverse: space.vec,
    ) -> space.scalar: ...

    return square
