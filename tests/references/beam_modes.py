"""The first frequencies of the clamped beams, by finite elements: biquadratic in 2D (plane stress but where plane strain is
said), triquadratic in 3D.

    pip install scikit-fem scipy; python tests/references/beam_modes.py

Writes beam_modes.json: omega [rad/s] of the first in bending, with the difference to the next coarser mesh, and the first
eight of all; and examples/fronts/beam_tip.csv, the
tip of examples/oscillating_beam.toml over one period and more, by superposition of forty modes. The vibration is the one of
a beam that is started in its first mode, so the modal frequency of the linear problem is the reference for small amplitudes.
"""

import json
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import eigsh
from skfem import Basis, BilinearForm, ElementHex2, ElementQuad2, ElementVector, MeshHex, MeshQuad, condense
from skfem.helpers import ddot, dot, eye, sym_grad, trace

MAGNESIUM = {"youngs_modulus": 45e9, "poisson_ratio": 0.35, "density": 1738.0}
RUBBER = {"youngs_modulus": 2e6, "poisson_ratio": 0.3975, "density": 1000.0}
UNIT = {"youngs_modulus": 1.0, "poisson_ratio": 0.3, "density": 1.0}
CASES = {
    "magnesium, L = .5, W = .05": (MAGNESIUM, (0.5, 0.05)),
    "magnesium, L = .5, W = .1": (MAGNESIUM, (0.5, 0.1)),
    "slender, L = 10, W = 1": (UNIT, (10.0, 1.0)),
    "block, 10 x 1 x 1": (UNIT, (10.0, 1.0, 1.0)),
    "rubber in plane strain, L = .2, W = .02": (RUBBER, (0.2, 0.02)),
    "rubber block, L = .2, W = .02": (RUBBER, (0.2, 0.02, 0.02)),
}


def assembled(material: dict[str, float], size: tuple[float, ...], rows: int, thin: bool = True) -> tuple:
    """Basis, free degrees of freedom, stiffness and mass with `rows` elements across, clamped at x = 0; `thin`: in 2D, plane
    stress."""
    E, nu, rho = material["youngs_modulus"], material["poisson_ratio"], material["density"]
    shear = E / (2.0 * (1.0 + nu))
    # Plane stress is plane strain with another lambda.
    lame = E * nu / (1.0 - nu**2) if len(size) == 2 and thin else E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    counts = [max(round(rows * edge / size[1]), 2) for edge in size]
    lines = [np.linspace(0.0, edge, count + 1) for edge, count in zip(size, counts, strict=True)]
    mesh = MeshQuad.init_tensor(*lines) if len(size) == 2 else MeshHex.init_tensor(*lines)
    basis = Basis(mesh, ElementVector(ElementQuad2() if len(size) == 2 else ElementHex2()))

    @BilinearForm
    def stiffness(u, v, _):
        e = sym_grad(u)
        return ddot(2.0 * shear * e + lame * eye(trace(e), len(size)), sym_grad(v))

    @BilinearForm
    def mass(u, v, _):
        return rho * dot(u, v)

    K, M = stiffness.assemble(basis), mass.assemble(basis)
    held = basis.get_dofs(lambda x: np.isclose(x[0], 0.0))
    K, M, _, free = condense(K, M, D=held)
    return basis, free, K, M


def frequencies(material: dict[str, float], size: tuple[float, ...], rows: int, thin: bool = True) -> list[float]:
    """The first eight frequencies [rad/s]; the first is one in bending."""
    _, _, K, M = assembled(material, size, rows, thin)
    return np.sqrt(np.sort(eigsh(K, 8, M, sigma=0.0, which="LM")[0])).tolist()


def tip(rows: int = 12, modes: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and deflection [m] at the middle of the free end of the beam of examples/oscillating_beam.toml."""
    basis, free, K, M = assembled(MAGNESIUM, (0.5, 0.1), rows)
    squares, shapes = eigsh(K, modes, M, sigma=0.0, which="LM")
    start = np.zeros(basis.N)
    x, k = basis.doflocs[0], 3.750208
    bending = 4.138133775978785 * (np.cosh(k * x) - np.cos(k * x)) - 3.03778544028026 * (np.sinh(k * x) - np.sin(k * x))
    across = np.concatenate(
        [d[1::2].ravel() for d in (basis.dofs.nodal_dofs, basis.dofs.facet_dofs, basis.dofs.interior_dofs)]
    )
    start[across] = 0.01 * bending[across]
    here = across[np.argmin(np.abs(basis.doflocs[:, across] - np.array([[0.5], [0.05]])).sum(0))]
    share = shapes.T @ (M @ start[free])
    omega, time = np.sqrt(squares), np.linspace(0.0, 3.5e-3, 3501)
    return time, (shapes[np.flatnonzero(free == here)[0]] * share / omega) @ np.sin(np.outer(omega, time))


def main() -> None:
    """Compute and write."""
    found = {}
    for name, (material, size) in CASES.items():
        sizes = (4, 8, 16) if len(size) == 2 else (1, 2, 3)
        values = [frequencies(material, size, rows, "plane strain" not in name) for rows in sizes]
        omega = [first for first, *_ in values]
        found[name] = {
            "omega": omega[-1],
            "change": omega[-1] - omega[-2],
            "size": size,
            **material,
            "modes": values[-1],
        }
        print(name, omega)
    Path(__file__).with_suffix(".json").write_text(json.dumps(found, indent=2) + "\n")
    coarse, (time, fine) = tip(8)[1], tip()
    print("tip: largest change from 8 to 12 rows", np.abs(fine - coarse).max() / np.abs(fine).max())
    rows = "\n".join(f"{t:.7g},{u:.9g}" for t, u in zip(time, fine, strict=True))
    front = Path(__file__).resolve().parents[2] / "examples" / "fronts" / "beam_tip.csv"
    front.write_text(f"time,displacement_y\n{rows}\n")


if __name__ == "__main__":
    main()
