"""Sums of a target over the other set: one loop over its pairs, shared by every two-set kernel over lists."""

from functools import cache

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.constitutive.evolution import thickness
from wsph.constitutive.laws import Laws


@cache
def operator_struct(space: Space) -> type:
    """Struct of an operator from one set to the other: rows of pairs with the weights of both its parts.

    offsets   # (targets + 1,) int32
    indices   # sources, (pairs,) int32
    weight    # of the interpolation, (pairs,) scalar
    gradient  # (pairs,) vec
    targets   # whose rows they are, where other targets have none, (rows,) int32
    """
    annotations = {
        "offsets": wp.array(dtype=wp.int32),
        "indices": wp.array(dtype=wp.int32),
        "weight": wp.array(dtype=space.scalar),
        "gradient": wp.array(dtype=space.vec),
        "targets": wp.array(dtype=wp.int32),
    }
    return wp.struct(type("Operator", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def target_of(space: Space, mixed: bool) -> wp.Function:
    """Warp function (rows, row) -> the target of a row; `mixed`: there are targets without one."""
    Operator = operator_struct(space)

    @wp.func
    def target(rows: Operator, row: int) -> int:
        if wp.static(mixed):
            return rows.targets[row]
        return row

    return target


@cache
def gather(space: Space, laws: Laws, layout: Layout) -> wp.Function:
    """Warp function (rows, i, fields, sources, v0, s0) -> (v, s, q, S, Q, L, slope, G): sums over the pairs of row i.

    v, s, q: interpolated velocity and stress, less v0 and s0, and internals; S, Q: interpolated source, that of the
    internals within the range of its sources: dissipation grows; L (dim x dim) and slope (stress components x dim):
    gradients of velocity and stress less v0 and s0; G: sum of the gradient weights, so that a gradient about a value
    f_I (less v0 or s0) is L - f_I (x) G. Where free normals change the thickness, slope is that of the thickness times
    the stress (`handed_on`).

    v0 and s0 are values nearby: sums of differences lose no digits to a velocity that all particles have in common.
    """
    vec, mat = space.vec, space.mat
    stress, internal, sourced, kept = laws.stress, laws.internal, laws.source is not None, "internals" in dict(layout)
    slopes = space.matrix(len(laws.state.components), space.dim)
    Operator, Fields = operator_struct(space), fields_struct(space, layout)
    thick, thins = thickness(space, laws), laws.kept.thinning >= 0
    at = element(wp.int32, space.scalar, vec, stress, internal)

    @wp.func
    def sums(rows: Operator, i: int, fields: Fields, sources: Fields, v0: vec, s0: stress):
        v = vec()
        s = stress()
        q = internal()
        S = stress()
        Q = internal()
        L = mat()
        slope = slopes()
        G = vec()
        least = internal()
        most = internal()
        if wp.static(sourced):
            least = at(sources.internals, at(rows.indices, rows.offsets[i]))
            most = least
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            j = at(rows.indices, k)
            w = at(rows.weight, k)
            g = at(rows.gradient, k)
            dv = at(fields.velocity, j) - v0
            ds = at(fields.stress, j) - s0
            v += w * dv
            s += w * ds
            L += wp.outer(dv, g)
            if wp.static(thins):
                # What a section or a plane hands on is its thickness times its stress.
                ds = thick(at(fields.internals, j)) * at(fields.stress, j) - s0
            slope += wp.outer(ds, g)
            G += g
            if wp.static(kept):
                q += w * at(fields.internals, j)
            if wp.static(sourced):
                S += w * at(sources.stress, j)
                own = at(sources.internals, j)
                Q += w * own
                least = wp.min(least, own)
                most = wp.max(most, own)
        if wp.static(sourced):
            # Weights that look past a face are negative in part: what grows everywhere around would shrink there.
            Q = wp.max(wp.min(Q, most), least)
        return v, s, q, S, Q, L, slope, G

    return sums


@cache
def handed_on(space: Space, laws: Laws) -> wp.Function:
    """Warp function (s, s0, q) -> thickness times stress, less s0, of a stress less s0: what a slope is about."""
    stress, internal, thick, thins = laws.stress, laws.internal, thickness(space, laws), laws.kept.thinning >= 0

    @wp.func
    def handed(s: stress, s0: stress, q: internal) -> stress:
        if wp.static(thins):
            return thick(q) * (s + s0) - s0
        return s

    return handed


@cache
def divergence(space: Space, laws: Laws) -> wp.Function:
    """Warp function: slopes of the packed stress -> its divergence."""
    dim, vec, width = space.dim, space.vec, len(laws.state.components)
    slopes = space.matrix(width, dim)
    integers = wp.types.vector(length=width, dtype=wp.int32)
    row, column = (integers(*[c[k] for c in laws.state.components]) for k in range(2))

    @wp.func
    def contracted(slope: slopes) -> vec:
        force = vec()
        for c in range(wp.static(width)):
            i = row[c]
            j = column[c]
            if i < wp.static(dim) and j < wp.static(dim):
                force[i] = force[i] + slope[c, j]
                if i != j:
                    force[j] = force[j] + slope[c, i]
        return force

    return contracted
