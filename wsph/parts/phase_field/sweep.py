"""The damage of a point after one Jacobi sweep, and what is left of its stiffness. `wsph.parts.phase_field.field` has the
equations."""

from functools import cache

import warp as wp

from wsph.backend.space import Space

KEPT = 1e-6
"""The part of the opening stiffness that a broken point keeps."""


@cache
def phase_struct(space: Space) -> type:
    """Struct of a phase field of m points as kernels take it, nondimensional. Pairs see k places: the points, or n nodes.

    per_energy  # q per psi+
    spread      # b of the sweep
    damage      # that the step starts from, (m,)
    seen        # the damage that pairs see, (k,)
    near        # 1 where a point has damage in its sight, (m,) int32
    opening     # psi+ of the last evaluation, or of whole points a bound of it, (m,)
    share       # shares of the points times g, (m,)
    weights     # sums of the weights of the pairs, (m,)
    """
    real = space.scalar
    array = wp.array(dtype=real)
    annotations = {
        "per_energy": real,
        "spread": real,
        "damage": array,
        "seen": array,
        "near": wp.array(dtype=wp.int32),
        "opening": array,
        "share": array,
        "weights": array,
    }
    return wp.struct(type("Phase", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def degradation(space: Space) -> wp.Function:
    """Warp function g(d)."""
    real = space.scalar

    @wp.func
    def degraded(d: real) -> real:
        return (real(1.0) - d) * (real(1.0) - d) * real(wp.static(1.0 - KEPT)) + real(KEPT)

    return degraded


@cache
def swept(space: Space, model: str) -> wp.Function:
    """Warp function (phase, old damage, psi+, S, D) -> damage after one Jacobi sweep."""
    real, Phase = space.scalar, phase_struct(space)

    @wp.func
    def sweep(phase: Phase, old: real, opening: real, S: real, D: real) -> real:
        q = phase.per_energy * opening
        if wp.static(model == "AT1"):
            at = (q - real(1.0) + phase.spread * S) / (q + phase.spread * D)
        else:
            at = (q + phase.spread * S) / (real(1.0) + q + phase.spread * D)
        return wp.max(old, wp.min(real(1.0), at))

    return sweep
