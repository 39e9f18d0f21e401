"""How good the cells of fitted bodies are.

    python tests/geometry/fitted_quality.py [NAME ...] [--large]

One line a body: cells, least volume over their median, least scaled Jacobian, the least local length s_p over the spacing,
which bounds the time step, the largest error of the area of a patch and that of the volume, and processor seconds. --large
adds a sphere of 100 000 cells.
"""

# pyright: strict

import argparse
import sys
import time
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from examples.bracket import bracket, write_stl
from tests.scenes import Data, box, shape
from wsph.geometry.cells import cell_volumes, edge_ends
from wsph.geometry.fitted.fit import fit
from wsph.geometry.meshes.mesh import Mesh


@dataclass(frozen=True)
class Case:
    """A shape, a spacing [m], and the exact volume and areas of its patches."""

    shape: Data
    spacing: float
    volume: float
    areas: dict[str, float]


def polygon(*points: tuple[float, float], turned: float = 0.0) -> Data:
    """A polygon turned by degrees about the origin."""
    angle = np.radians(turned)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return {"type": "polygon", "points": (np.array(points) @ turn.T).tolist()}


def _sides(*lengths: float) -> dict[str, float]:
    return {f"side-{k}": length for k, length in enumerate(lengths, 1)}


def _box_sides(dim: int, **other: float) -> dict[str, float]:
    return {f"box-1/{sign}{axis}": other.get(f"{sign}{axis}", 1.0) for axis in "xyz"[:dim] for sign in "-+"}


def _star(points: int, inner: float) -> Data:
    angle = np.arange(2 * points) * np.pi / points
    radius = np.where(np.arange(2 * points) % 2 == 0, 1.0, inner)
    return polygon(*zip(radius * np.cos(angle), radius * np.sin(angle), strict=True))


def _cylinder(end: list[float], radius: float) -> Data:
    return {"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": end, "radius": radius}


SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
L = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0))
_ROOT = 3.0**0.5
_STAR = float(np.hypot(np.cos(np.pi / 10.0) * 0.6 - 1.0, np.sin(np.pi / 10.0) * 0.6))
_HOLE = {"type": "disc", "name": "hole", "center": [0.5, 0.5], "radius": 0.2}
_VOID = {"type": "sphere", "name": "void", "center": [0.5, 0.5, 0.5], "radius": 0.25}
_BOSS = {"type": "cylinder", "name": "boss", "from": [1.0, 1.0, 0.2], "to": [1.0, 1.0, 1.0], "radius": 0.4}

BODIES = {
    "disc": Case({"type": "disc", "center": [0.0, 0.0], "radius": 0.5}, 1 / 16, np.pi / 4, {"disc": np.pi}),
    "ring": Case(
        {"type": "ring", "center": [0.0, 0.0], "inner": 0.5, "outer": 1.0}, 0.1, 0.75 * np.pi,
        {"inner": np.pi, "outer": 2.0 * np.pi},
    ),
    "hole in plate": Case(
        {"type": "difference", "shapes": [box(1.0, 1.0), _HOLE]}, 0.05, 1.0 - 0.04 * np.pi,
        {**_box_sides(2), "hole": 0.4 * np.pi},
    ),
    "box at 30": Case(polygon(*SQUARE, turned=30.0), 1 / 12, 1.0, _sides(1.0, 1.0, 1.0, 1.0)),
    "box at 45": Case(polygon(*SQUARE, turned=45.0), 1 / 12, 1.0, _sides(1.0, 1.0, 1.0, 1.0)),
    "triangle of 60": Case(polygon((0.0, 0.0), (1.0, 0.0), (0.5, 0.5 * _ROOT)), 1 / 16, _ROOT / 4, _sides(1.0, 1.0, 1.0)),
    "wedge of 30": Case(
        polygon((0.0, 0.0), (1.0, 0.0), (1.0, 1.0 / _ROOT)), 1 / 16, 0.5 / _ROOT, _sides(1.0, 1.0 / _ROOT, 2.0 / _ROOT)
    ),
    "L at 20": Case(polygon(*L, turned=20.0), 1 / 16, 0.75, _sides(1.0, 0.5, 0.5, 0.5, 0.5, 1.0)),
    "hexagon": Case(
        polygon(*((np.cos(a), np.sin(a)) for a in np.arange(6) * np.pi / 3.0), turned=11.0), 0.1, 1.5 * _ROOT,
        _sides(*[1.0] * 6),
    ),
    "star of 10": Case(_star(10, 0.6), 0.05, 6.0 * np.sin(np.pi / 10.0), _sides(*[_STAR] * 20)),
    "sphere, 12": Case({"type": "sphere", "center": [0.0] * 3, "radius": 0.5}, 1 / 12, np.pi / 6, {"sphere": np.pi}),
    "sphere, 16": Case({"type": "sphere", "center": [0.0] * 3, "radius": 0.5}, 1 / 16, np.pi / 6, {"sphere": np.pi}),
    "cylinder": Case(
        _cylinder([0.0, 0.0, 2.0], 0.5), 1 / 10, np.pi / 2,
        {"from": np.pi / 4, "to": np.pi / 4, "mantle": 2.0 * np.pi},
    ),
    "cylinder, turned": Case(
        _cylinder([0.6, 0.8, 1.0], 0.4), 1 / 14, 0.16 * np.pi * 2**0.5,
        {"from": 0.16 * np.pi, "to": 0.16 * np.pi, "mantle": 0.8 * np.pi * 2**0.5},
    ),
    "spherical hole": Case(
        {"type": "difference", "shapes": [box(1.0, 1.0, 1.0), _VOID]}, 0.0625, 1.0 - np.pi / 48,
        {**_box_sides(3), "void": np.pi / 4},
    ),
    "plate with boss": Case(
        {"type": "union", "shapes": [box(2.0, 2.0, 0.5), _BOSS]}, 1 / 12, 2.0 + 0.08 * np.pi,
        {**_box_sides(3, **{"-z": 4.0, "+z": 4.0 - 0.16 * np.pi}), "boss/to": 0.16 * np.pi, "boss": 0.4 * np.pi},
    ),
}  # fmt: skip
"""Bodies of all kinds; the bracket comes from a file."""


def bracket_case(folder: Path, spacing: float = 0.0015) -> Case:
    """The bracket as a shape, from an STL file in a folder; its areas are those of its triangles."""
    path = folder / "bracket.stl"
    write_stl(path, bracket())
    data = {"type": "stl", "file": str(path), "scale": "1 mm"}
    areas = {patch.name: float(patch.surface.samples(1.0)[1].sum()) for patch in shape(**data).patches()}
    corners = 1e-3 * bracket()
    volume = float((np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum()) / 6.0
    return Case(data, spacing, volume, areas)


def offsets(dim: int) -> np.ndarray:
    """Corners of a cell in their order, (2^dim, dim)."""
    return np.array(list(product((0, 1), repeat=dim)))


def volumes(mesh: Mesh) -> np.ndarray:
    """Volumes (c,) [m^dim] of the cells of a fitted body, by 2^dim Gauss points."""
    return cell_volumes(mesh.nodes[mesh.blocks[0]], offsets(mesh.nodes.shape[1]))


def area_vectors(mesh: Mesh) -> np.ndarray:
    """Outward area vectors (m, dim) [m^(dim-1)] of the sides."""
    sides = mesh.nodes[mesh.sides]
    if sides.shape[2] == 2:
        along = sides[:, 1] - sides[:, 0]
        return np.stack([along[:, 1], -along[:, 0]], 1)
    return 0.5 * np.cross(sides[:, 3] - sides[:, 0], sides[:, 1] - sides[:, 2])


def flux(mesh: Mesh) -> float:
    """The volume [m^dim] that the sides enclose, as the integral of x.n over them, bilinear between their corners."""
    sides, dim = mesh.nodes[mesh.sides], mesh.nodes.shape[1]
    if dim == 2:
        return float((sides.mean(1) * area_vectors(mesh)).sum()) / dim
    total = 0.0
    for a, b in product((0.5 - 0.5 / _ROOT, 0.5 + 0.5 / _ROOT), repeat=2):
        weight = np.array([(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b])
        first = (1 - b) * (sides[:, 2] - sides[:, 0]) + b * (sides[:, 3] - sides[:, 1])
        second = (1 - a) * (sides[:, 1] - sides[:, 0]) + a * (sides[:, 3] - sides[:, 2])
        total += float((np.einsum("k,mkd->md", weight, sides) * np.cross(first, second)).sum()) / 4.0
    return total / dim


def patch_areas(mesh: Mesh) -> dict[str, float]:
    """Areas of the patches [m^(dim-1)]: of flat sides."""
    area = np.linalg.norm(area_vectors(mesh), axis=1)
    return dict(zip(mesh.patches, np.bincount(mesh.side_patch, area, len(mesh.patches)).tolist(), strict=True))


def scaled_jacobian(mesh: Mesh) -> float:
    """The least determinant of the three unit edges at a corner."""
    dim, cells = mesh.nodes.shape[1], mesh.nodes[mesh.blocks[0]]
    unit = np.zeros((len(cells), 2**dim, dim, dim))
    for axis in range(dim):
        low, high = edge_ends(offsets(dim), axis)
        edge = cells[:, high] - cells[:, low]
        edge /= np.linalg.norm(edge, axis=2, keepdims=True)
        unit[:, low, axis] = unit[:, high, axis] = edge
    return float(np.linalg.det(unit).min())


def local_lengths(mesh: Mesh) -> np.ndarray:
    """s_p = 2/sqrt(k lambda_max(sum_j g_j g_j^T)) (c,) [m] with the mean gradients g_j of a cell's k shape functions."""
    dim = mesh.nodes.shape[1]
    cells, corner = mesh.nodes[mesh.blocks[0]], offsets(dim)
    mean, total = np.zeros(cells.shape), np.zeros(len(cells))
    for point in product((0.5 - 0.5 / _ROOT, 0.5 + 0.5 / _ROOT), repeat=dim):
        factor = np.where(corner == 1, point, 1.0 - np.array(point))
        slope = np.stack([(2.0 * corner[:, k] - 1.0) * np.delete(factor, k, 1).prod(1) for k in range(dim)], 1)
        jacobian = np.einsum("cka,kb->cab", cells, slope)
        det = np.linalg.det(jacobian)
        inverse = np.asarray(np.linalg.inv(jacobian), float)
        mean += np.einsum("kb,cba->cka", slope, inverse) * det[:, None, None]
        total += det
    gradient = mean / total[:, None, None]
    spread = np.einsum("cka,ckb->cab", gradient, gradient)
    return 2.0 / np.sqrt(2**dim * np.linalg.eigvalsh(spread)[:, -1])


def line(name: str, case: Case) -> str:
    """The figures of a body."""
    start = time.process_time()
    mesh = fit(shape(**case.shape), case.spacing)
    seconds = time.process_time() - start
    volume, areas = volumes(mesh), patch_areas(mesh)
    off = max(abs(areas.get(patch, 0.0) / area - 1.0) for patch, area in case.areas.items())
    return (
        f"{name:18}{len(volume):8}{volume.min() / np.median(volume):8.3f}{scaled_jacobian(mesh):8.3f}"
        f"{local_lengths(mesh).min() / case.spacing:8.3f}{off:10.1e}{volume.sum() / case.volume - 1.0:10.1e}{seconds:8.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--large", action="store_true")
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        cases = BODIES | {"bracket": bracket_case(Path(folder))}
        if options.large:
            small = cases["sphere, 16"]
            cases["sphere, 56"] = Case(small.shape, 1 / 56, small.volume, small.areas)
        print(f"{'body':18}{'cells':>8}{'V/med':>8}{'scaled':>8}{'s_p/h':>8}{'area':>10}{'volume':>10}{'s':>8}")
        for name in options.names or cases:
            print(line(name, cases[name]))


if __name__ == "__main__":
    main()
