"""Stress along the ligament of the plate with a void (He & Seaid 2016, 4.3), by biquadratic finite elements, plane stress.

    pip install scikit-fem scipy; python tests/references/plate_with_void.py

Writes examples/references/plate_ligament.csv: for each radius sigma_yy(x, 0) over its mean, from the hole to the free side,
with an edge that slides; prints what other loads, another height and a coarser mesh change. The plate is 2 m x 2 m; a
quarter of it, [0, 1]^2 without the disc of radius R0 about the origin, is meshed along rays from the hole to the square.
Held: u_x at x = 0 and u_y at y = 0; free: the hole and x = 1. The paper prescribes a velocity of the edge y = 1, the same
at all its points, and does not say whether the edge may slide along itself: "sliding" leaves u_x free, "clamped" holds it,
"traction" is a uniform stress instead. The mean over a ligament is the reaction over its length, since the hole and x = 1
are free: the profiles do not depend on the size of the load, nor on Young's modulus.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, LinearForm, MeshQuad, MeshQuad2, condense, solve
from skfem.helpers import ddot, eye, sym_grad, trace

MAGNESIUM = {"youngs_modulus": 45e9, "poisson_ratio": 0.35, "density": 1738.0}
RADII = (0.3, 0.2)
LOADS = ("sliding", "clamped", "traction")
HEIGHTS = (0.0, 0.01)
ROWS = (32, 64, 128)
TABLE = Path(__file__).resolve().parents[2] / "examples" / "references" / "plate_ligament.csv"


def edge(angle: np.ndarray) -> np.ndarray:
    """Distance from the origin to the square along a ray."""
    return 1.0 / np.maximum(np.cos(angle), np.sin(angle))


def meshes(radius: float, rows: int) -> tuple[MeshQuad, MeshQuad2]:
    """The unit square (along a ray, finer at the hole; share of the right angle), and its image: the quarter plate."""
    along = np.linspace(0.0, 1.0, rows + 1)
    square = MeshQuad.init_tensor(0.25 * along + 0.75 * along**2, along)
    plate = MeshQuad2.from_mesh(square)
    share, angle = plate.doflocs[0], 0.5 * np.pi * plate.doflocs[1]
    distance = radius + share * (edge(angle) - radius)
    return square, MeshQuad2(distance * np.stack([np.cos(angle), np.sin(angle)]), plate.t)


class Plate:
    """The static solution with `rows` elements along a ray and as many around: the stress at any point of the quarter."""

    def __init__(self, radius: float, load: str = "sliding", rows: int = 64) -> None:
        self.radius = radius
        E, nu = MAGNESIUM["youngs_modulus"], MAGNESIUM["poisson_ratio"]
        shear, lame = E / (2.0 * (1.0 + nu)), E * nu / (1.0 - nu**2)
        square, plate = meshes(radius, rows)
        basis = Basis(plate, ElementVector(ElementQuad2()))
        top = basis.get_dofs(lambda x: np.isclose(x[1], 1.0))
        bottom = basis.get_dofs(lambda x: np.isclose(x[1], 0.0)).all("u^2")
        left = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all("u^1")

        def stress(u):
            e = sym_grad(u)
            return 2.0 * shear * e + lame * eye(trace(e), 2)

        @BilinearForm
        def stiffness(u, v, _):
            return ddot(stress(u), sym_grad(v))

        @LinearForm
        def pull(v, _):
            return v[1] * E

        K, u, f = stiffness.assemble(basis), basis.zeros(), basis.zeros()
        held = [left, bottom]
        if load == "traction":
            f = pull.assemble(basis.boundary(plate.facets_satisfying(lambda x: np.isclose(x[1], 1.0))))
        else:
            u[top.all("u^2")] = 1.0
            held += [top.all("u^2")] + [top.all("u^1")] * (load == "clamped")
        u = solve(*condense(K, f, x=u, D=np.unique(np.concatenate(held))))
        self.reaction = -float((K @ u)[bottom].sum())

        # Continuous stress: the projection of the elements' own, twice as close at the nodes.
        scalar = basis.with_element(ElementQuad2())

        @BilinearForm
        def product(s, v, _):
            return s * v

        @LinearForm
        def raw(v, w):
            return stress(w["u"])[1, 1] * v

        self._stress = solve(product.assemble(scalar), raw.assemble(scalar, u=basis.interpolate(u)))
        self._square = Basis(square, ElementQuad2())

    def start(self, y: float) -> float:
        """Where the ligament at height y begins: on the hole, or on the line of symmetry above it."""
        return float(np.sqrt(max(self.radius**2 - y**2, 0.0)))

    def sigma_yy(self, x: np.ndarray, y: np.ndarray | float) -> np.ndarray:
        """sigma_yy [Pa] at points of the quarter plate, for the unit load of the class."""
        x, y = np.broadcast_arrays(np.asarray(x, float), y)
        angle, distance = np.arctan2(y, x), np.hypot(x, y)
        share = (distance - self.radius) / (edge(angle) - self.radius)
        where = np.stack([np.clip(share, 0.0, 1.0), np.clip(2.0 / np.pi * angle, 0.0, 1.0)])
        return self._square.probes(where) @ self._stress

    def profile(self, x: np.ndarray, y: float = 0.0) -> np.ndarray:
        """sigma_yy(x, y) over its mean along the ligament at that height."""
        return self.sigma_yy(x, y) * (1.0 - self.start(y)) / self.reaction


def points(start: float, count: int = 101) -> np.ndarray:
    """Positions on a ligament, finer at the hole."""
    return start + (1.0 - start) * np.linspace(0.0, 1.0, count) ** 2


def kirsch(x: np.ndarray, radius: float) -> np.ndarray:
    """sigma_yy(x, 0) of the infinite plate over the stress far away, as the paper prints it."""
    ratio = (radius / x) ** 2
    return 1.0 + 0.5 * ratio + 1.5 * ratio**2


def norms(value: np.ndarray, exact: np.ndarray) -> dict[str, float]:
    """Sum |e| / sum |exact|, and the same of the squares under a root."""
    error = value - exact
    return {
        "l1": float(np.abs(error).sum() / np.abs(exact).sum()),
        "l2": float(np.sqrt((error**2).sum() / (exact**2).sum())),
    }


def case(radius: float, load: str) -> dict:
    """Tables of the finest mesh, and what each refinement changes: the error left is a third of the last change."""
    plates = [Plate(radius, load, rows) for rows in ROWS]
    fine = plates[-1]
    found: dict = {"lines": []}
    for y in HEIGHTS:
        x = points(fine.start(y))
        values = [p.profile(x, y) for p in plates]
        middles = fine.start(y) + (1.0 - fine.start(y)) * (np.arange(4000) + 0.5) / 4000
        found["lines"].append(
            {
                "y": y,
                "start": fine.start(y),
                "integral_over_reaction": float(fine.profile(middles, y).mean()),
                "largest_change": [float(np.abs(b - a).max()) for a, b in pairwise(values)],
                "edge_over_mean": float(values[-1][0]),
                "x": x.round(9).tolist(),
                "sigma_yy_over_mean": values[-1].round(7).tolist(),
            }
        )
    return found


def compared(radius: float) -> dict:
    """Other loads, another height and the infinite plate (its stress fitted) against lines y = 0, at 36 even positions x."""
    plates = {load: Plate(radius, load) for load in LOADS}
    x = radius + (1.0 - radius) * (np.arange(36) + 0.5) / 36
    lines, far = {load: plate.profile(x) for load, plate in plates.items()}, kirsch(x, radius)
    out = {f"{load} against sliding": norms(lines[load], lines["sliding"]) for load in LOADS[1:]}
    for load, line in lines.items():
        out[f"kirsch against {load}"] = norms(far * (far @ line) / (far @ far), line)
    return out | {"y = .01 against y = 0, sliding": norms(plates["sliding"].profile(x, 0.01), lines["sliding"])}


def main() -> None:
    """Compute and write."""
    columns: dict[str, list[float]] = {}
    for radius in RADII:
        cases = {load: case(radius, load) for load in LOADS}
        for load, one in cases.items():
            for line in one["lines"]:
                print(radius, load, {k: v for k, v in line.items() if isinstance(v, float)}, line["largest_change"])
        for name, one in compared(radius).items():
            print(radius, name, one)
        line = cases["sliding"]["lines"][0]
        columns |= {f"x_{radius}": line["x"], f"sigma_{radius}": line["sigma_yy_over_mean"]}
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True)]
    TABLE.write_text("\n".join([",".join(columns), *rows]) + "\n")


if __name__ == "__main__":
    main()
