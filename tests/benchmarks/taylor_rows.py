"""What Taylor-SPH's first half step would take by rows of the lattice: CPU nanoseconds a cell, beside that of lists.

    python tests/benchmarks/taylor_rows.py [--dim 3] [--cells 32] [--precision f64] [--turns 15]

A cell sees its corners, with weights of one over their number, and gradients that are differences along the axes: the loops
of `wsph.formulations.lattice` apply, of velocities and stresses at once. The kernel here does what the package's does in
small strain, of a law without internals; both are run in turns on the same state, and inside of a block give the same to
rounding. Cells at a face have weights of their own, of corners with less volume, and so have nodes on a face, which see one
side, in the other half step: they would keep their lists. What is printed is for all cells, the most that rows could give.
"""

import argparse
import time
import warnings
from typing import Any

import numpy as np
import warp as wp
from rows import ELASTIC

import wsph
from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.launch import Launch
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.block_rates import WIDTH
from wsph.formulations.lattice.lanes import (
    VECTORS,
    block_of,
    capacity_of,
    corner_edges,
    entry_of,
    field_lanes,
    lane,
)
from wsph.formulations.lattice.runs import HEAD, runs_of
from wsph.formulations.taylor.gather import divergence
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct
from wsph.simulation.compose import compose


def gathering(space: Space, width: int, dtype: type) -> wp.Function:
    """Warp function (blocks, block, lane, rows, field, inverse, values_out): of every cell of a block the mean of its
    corners, and the derivatives along the axes; number by number, so that what is unrolled stays small."""
    dim, capacity, count = space.dim, capacity_of(width), dtype._length_
    corners = range(2**dim)
    starts = "\n".join(
        f"const S* p{c} = (const S*)field.data + {count}*((int64_t)at[{HEAD + c}] + lane);" for c in corners
    )
    loops: list[str] = []
    for a in range(count):
        own = [f"const S x{c} = p{c}[{count}*e+{a}];" for c in corners]
        others = " + ".join(f"(x{c} - x0)" for c in corners[1:])
        own.append(f"o[{a * capacity}+e] = x0 + S({0.5**dim!r})*({others});")
        for k in range(dim):
            edges = " + ".join(f"(x{high} - x{low})" for axis, low, high in corner_edges(dim) if axis == k)
            own.append(f"o[{(count + a * dim + k) * capacity}+e] = S({0.5 ** (dim - 1)!r})*inverse[{k}]*({edges});")
        loops.append(f"{VECTORS} for (int e = 0; e < rows; ++e) {{ {' '.join(own)} }}")
    code = "\n".join([entry_of(space), starts, "S* o = values_out.data;", *loops])

    @wp.func_native(code)
    def gather(
        blocks: wp.array(dtype=wp.int32),
        block: int,
        lane: int,
        rows: int,
        field: wp.array(dtype=dtype),
        inverse: space.vec,
        values_out: wp.array(dtype=space.scalar),
    ): ...

    return gather


def half_step_kernel(
    space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: BodyForceKinds, width: int
) -> wp.Kernel:
    """The half step of the virtual particles of a grid along the coordinate axes."""
    real, vec, mat, stress, Params = space.scalar, space.vec, space.mat, laws.stress, laws.Params
    Real, Virtual, capacity, dim = (
        fields_struct(space, real_layout),
        fields_struct(space, virtual),
        capacity_of(width),
        space.dim,
    )
    linear, force_of, internal = laws.linear, divergence(space, laws), laws.internal
    accelerated, Inertia, block = acceleration(space, parts), inertia_struct(space, parts.varied), block_of(dim, width)
    slopes, w = space.matrix(stress._length_, dim), stress._length_
    of_velocity, of_stress = gathering(space, width, vec), gathering(space, width, stress)
    (get_v, put_v), (get_s, put_s) = lane(space, width, vec), lane(space, width, stress)
    get_L, get_slope = lane(space, width, mat, dim)[0], lane(space, width, slopes, w)[0]
    write_v, write_s = field_lanes(space, width, vec)[1], field_lanes(space, width, stress)[1]
    velocities, stresses = (dim + dim * dim) * capacity, (w + w * dim) * capacity

    @kernel(ranged=True, lanes=True)
    def half_step_by_rows(
        first: int,
        p: Params,
        body: Inertia,
        inverse: vec,
        blocks: wp.array(dtype=wp.int32),
        fields: Real,
        clock: wp.array(dtype=wp.float64),
        weight: real,
        fields_out: Virtual,
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        dt = real(dt_of(clock)) * weight
        moving = wp.zeros(shape=velocities, dtype=real)
        bearing = wp.zeros(shape=stresses, dtype=real)
        of_velocity(blocks, b, at, rows, fields.velocity, inverse, moving)
        of_stress(blocks, b, at, rows, fields.stress, inverse, bearing)
        e = int(0)
        while e < own:
            v = get_v(moving, e)
            s = get_s(bearing, e)
            change, _dq = linear(p, s, get_L(moving, e), internal(), stress(), internal())
            put_v(moving, e, v + dt * accelerated(body, i + e, force_of(get_slope(bearing, e)), v))
            put_s(bearing, e, s + dt * change)
            e += 1
        write_v(moving, i, own, fields_out.velocity)
        write_s(bearing, i, own, fields_out.stress)

    return half_step_by_rows


def composed(dim: int, cells: int, precision: str) -> Any:
    """The composition of a block."""
    body: dict[str, Any] = {
        "name": "b",
        "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim},
        "spacing": 1.0 / cells,
        "velocity": ["1e-2*sin(3*x)", "1e-2*x*y", "1e-2*z"][:dim],
        "material": ELASTIC | {"model": "jaumann"},
    }
    if dim < 3:
        body["state"] = "strain"
    run = {
        "integrator": "tsph",
        "formulation": "small-strain",
        "end": 10.0,
        "cfl": 0.4,
        "guard": "off",
        "device": "cpu",
        "threads": 1,
        "precision": precision,
    }
    made = compose(wsph.Scene(schema=1, dim=dim, run=run, bodies=[body]))
    made.compile()
    made.program.run(3)
    return made


def main() -> None:
    """Print both times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dim", type=int, default=3)
    parser.add_argument("--cells", type=int, default=32)
    parser.add_argument("--precision", choices=WIDTH, default="f64")
    parser.add_argument("--turns", type=int, default=15)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    made = composed(options.dim, options.cells, options.precision)
    system, space, width = made.bodies[0].system, made.space, WIDTH[options.precision]
    by_lists = next(each for each in made.clock.launches(made.program.step) if each.kernel.func.__name__ == "half_step")
    p, body, _rows, real, _sources, clock, weight = by_lists.inputs
    layouts, laws = (system._layout("virtual"), system._layout("real")), made.bodies[0].constitutive.laws
    kernel_of_rows = half_step_kernel(space, laws, *layouts, system.force.parts, width)
    boxes = system.lattice.boxes
    table = runs_of(boxes, len(system.lattice.nodes), width, 1).cells
    blocks = wp.array(table.ravel(), dtype=wp.int32, device="cpu")
    inverse = space.vec(*(1.0 / boxes.steps(system.scales.length)).tolist())
    out = State(space, len(boxes.corners), layouts[0], "cpu")
    by_rows = Launch(kernel_of_rows, len(table), [p, body, inverse, blocks, real, clock, weight], [out.struct], "cpu")
    sides = (by_rows, by_lists)
    for each in sides:
        each.run()
    inside = ~system.lattice.on_face[boxes.corners].any(1)
    for name in ("velocity", "stress"):
        found, expected = (getattr(each, name).numpy()[inside] for each in (out.struct, by_lists.outputs[0]))
        apart = np.abs(found - expected).max() / np.abs(expected).max()
        assert apart < (1e-10 if options.precision == "f64" else 1e-3), (name, apart)
    best, cells = [np.inf, np.inf], len(boxes.corners)
    for _ in range(options.turns):
        for side, each in enumerate(sides):
            before = time.process_time()
            for _ in range(5):
                each.run()
            best[side] = min(best[side], (time.process_time() - before) / 5 / cells)
    ns = [1e9 * each for each in best]
    print(
        f"half step of tsph, {options.dim}D {options.precision}, {cells} cells: {ns[0]:.1f} ns a cell by rows, by lists"
        f" {ns[1]:.1f}: {ns[1] / ns[0]:.2f} times"
    )


if __name__ == "__main__":
    main()
