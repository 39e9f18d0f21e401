"""Ties between meshes that stand for surfaces: what they bind, forces against their energy, rotations, breaking."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.contact.surfaces.struct import surface_struct
from wsph.contact.ties.bonds import bonds_between, frames, nearest_weights
from wsph.contact.ties.tie import Tie
from wsph.errors import Refused
from wsph.scene.touch.contact import Contact
from wsph.units import Scales

UNITS = Scales(1.0, 1.0, 1.0)


def area_vectors(X: np.ndarray, faces: np.ndarray) -> np.ndarray:
    edge = X[faces[:, 1]] - X[faces[:, 0]]
    if X.shape[1] == 2:
        return np.stack([edge[:, 1], -edge[:, 0]], 1)
    return 0.5 * np.cross(edge, X[faces[:, 2]] - X[faces[:, 0]])


def mesh(X: np.ndarray, faces: np.ndarray) -> Any:
    vectors = area_vectors(X, faces)
    A = np.linalg.norm(vectors, axis=1)
    starts = np.concatenate([[0], np.cumsum(np.bincount(faces.ravel(), minlength=len(X)))])
    around = np.argsort(faces.ravel(), kind="stable") // faces.shape[1]
    return SimpleNamespace(X=X, faces=faces, N=vectors / A[:, None], A=A, starts=starts, around=around)


def side(dim: int, height: float, up: bool, cells: int, *, shift: float = 0.0, wave: float = 0.0) -> Any:
    """A square side at a height, that looks up or down; in 2D with a wave in it."""
    t = np.linspace(0.0, 1.0, cells + 1)
    if dim == 2:
        X = np.stack([t + shift, height + wave * np.sin(5.0 * t)], 1)
        faces = np.stack([np.arange(cells), np.arange(1, cells + 1)], 1)
        return mesh(X, faces[:, ::-1] if up else faces)
    x, y = (each.ravel() for each in np.meshgrid(t, t, indexing="ij"))
    X = np.stack([x + shift, y, height + wave * np.sin(5.0 * x)], 1)
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return mesh(X, faces if up else faces[:, ::-1])


def surface(name: str, of: Any, spacing: float, space: Space) -> Any:
    """What a tie takes of a surface: one in which vertices have a mass of 1."""
    struct: Any = surface_struct(space)()
    struct.x = wp.array(of.X, dtype=space.vec)
    n = len(of.X)
    force = wp.zeros(n, dtype=space.vec)
    return SimpleNamespace(name=name, n=n, m=len(of.faces), mesh=of, spacing=spacing, modulus=2.0, struct=struct,
                           force=force, here=np.ones(n, bool), square=lambda k: float(np.max(k)))  # fmt: skip


def glued(dim: int, *, gap: float = 0.03, **keys: Any) -> tuple[Tie, Any, Any]:
    """A side of two cells below one of four, with a gap and a shift."""
    space = Space(dim)
    low = surface("low", side(dim, 0.0, True, 2, wave=0.02), 0.5, space)
    high = surface("high", side(dim, gap, False, 4, shift=0.04, wave=0.02), 0.25, space)
    part = Contact(between=("low", "high"), law="tie", **keys)
    return Tie(part, low, high, space, UNITS, Clock(1.0, "cpu")), low, high


def pulled(tie: Tie, places: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The forces of a tie at `places` of its surfaces, by their names."""
    for each in tie.sides:
        each.struct.x.assign(places[each.name])
        each.force.zero_()
    tie.act()
    return {each.name: each.force.numpy().copy() for each in tie.sides}


def moved(tie: Tie, scale: float = 0.05) -> dict[str, np.ndarray]:
    random = np.random.default_rng(3)
    return {each.name: each.mesh.X + scale * random.standard_normal(each.mesh.X.shape) for each in tie.sides}


def rotation(dim: int) -> np.ndarray:
    random = np.random.default_rng(4)
    found = np.linalg.qr(random.standard_normal((dim, dim)))[0]
    found[:, 0] *= np.sign(np.linalg.det(found))
    return found


@pytest.mark.parametrize("dim", [2, 3])
class TestForces:
    def test_are_none_where_both_have_moved_as_one(self, dim: int) -> None:
        """The gap, of which a part lies along the faces, turns with them."""
        tie, *_ = glued(dim)
        assert np.abs(tie.bonds.gap).max() > 0.02
        turn = rotation(dim)
        places = {each.name: each.mesh.X @ turn.T + 0.7 for each in tie.sides}
        for force in pulled(tie, places).values():
            assert np.abs(force).max() < 1e-13
        assert tie.stored < 1e-28

    def test_are_the_gradient_of_the_energy(self, dim: int) -> None:
        tie, *_ = glued(dim)
        places, random, step = moved(tie), np.random.default_rng(5), 1e-6
        forces = pulled(tie, places)
        way = {name: random.standard_normal(x.shape) for name, x in places.items()}

        def energy(t: float) -> float:
            pulled(tie, {name: x + t * way[name] for name, x in places.items()})
            return tie.stored

        slope = (energy(step) - energy(-step)) / (2.0 * step)
        assert slope != 0.0
        assert -sum((forces[name] * way[name]).sum() for name in way) == pytest.approx(slope, rel=1e-7)

    def test_have_no_resultant_and_no_moment(self, dim: int) -> None:
        tie, *_ = glued(dim)
        places = moved(tie)
        forces = pulled(tie, places)
        size = sum(np.abs(f).sum() for f in forces.values())
        assert np.abs(sum(f.sum(0) for f in forces.values())).max() < 1e-14 * size
        moment = sum(places[name].T @ f - f.T @ places[name] for name, f in forces.items())
        assert np.abs(moment).max() < 1e-14 * size

    def test_have_a_stiffness_below_its_bound(self, dim: int) -> None:
        """Of vertices of mass 1, by the matrix of second differences about the glued state."""
        tie, low, high = glued(dim)
        sizes = [(each.name, each.n * dim) for each in (low, high)]
        total = sum(n for _, n in sizes)
        matrix = np.zeros((total, total))
        for k in range(total):
            way = np.zeros(total)
            way[k] = 1e-6
            parts = np.split(way, [sizes[0][1]])
            at = {s.name: s.mesh.X + p.reshape(-1, dim) for s, p in zip((low, high), parts, strict=True)}
            forces = pulled(tie, at)
            matrix[:, k] = np.concatenate([forces[name].ravel() for name, _ in sizes]) / -1e-6
        assert np.abs(matrix - matrix.T).max() < 1e-4 * np.abs(matrix).max()
        assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).max() < 1.001 * tie.bound(low)[0]


@pytest.mark.parametrize("dim", [2, 3])
class TestBonds:
    def test_are_of_the_finer_side_and_stand_for_its_area(self, dim: int) -> None:
        tie, low, high = glued(dim)
        assert tie.sides == (high, low)
        assert tie.bonds.area.sum() == pytest.approx(high.mesh.A.sum(), rel=1e-12)
        q = np.einsum("kc,kca->ka", tie.bonds.weights, low.mesh.X[tie.bonds.corners])
        axes = frames(low.mesh.X[tie.bonds.corners])[0]
        back = q + np.einsum("kax,kx->ka", axes, tie.bonds.gap)
        assert np.abs(back - high.mesh.X[tie.bonds.vertex]).max() < 1e-14

    def test_of_equal_sides_are_the_first_s(self, dim: int) -> None:
        space = Space(dim)
        sides = [surface(n, side(dim, 0.0, up, 4), 0.25, space) for n, up in (("low", True), ("high", False))]
        tie = Tie(Contact(between=("low", "high"), law="tie"), *sides, space, UNITS, Clock(1.0, "cpu"))
        assert tie.sides[0] is sides[0]
        assert (tie.bonds.gap == 0.0).all()
        assert tie.bonds.count == sides[0].n

    def test_reach_no_further_than_half_a_spacing(self, dim: int) -> None:
        low, high = side(dim, 0.0, True, 2), side(dim, 0.26, False, 4)
        assert bonds_between(high, low, 0.5).count == 0
        assert bonds_between(side(dim, 0.24, False, 4), low, 0.5).count == (5 if dim == 2 else 25)

    def test_are_not_of_what_lies_beside(self, dim: int) -> None:
        """Nor of faces that look the same way."""
        low = side(dim, 0.0, True, 2)
        beside = bonds_between(side(dim, 0.0, False, 4, shift=0.3), low, 0.5)
        assert beside.count == (4 if dim == 2 else 20)  # the last of them by .05 beside the edge
        assert bonds_between(side(dim, 0.0, True, 4), low, 0.5).count == 0

    def test_that_are_none_are_refused(self, dim: int) -> None:
        with pytest.raises(Refused, match="contact 'low-high': no vertex of body 'high' is within half a spacing"):
            glued(dim, gap=0.5)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_nearest_point_of_a_face_is_no_further_than_any_other(dim: int) -> None:
    random = np.random.default_rng(6)
    ends, p = random.standard_normal((200, dim, dim)), random.standard_normal((200, dim))
    found = nearest_weights(p, ends)
    assert found.min() >= 0.0
    assert found.sum(1) == pytest.approx(1.0)
    least = np.linalg.norm(p - np.einsum("kc,kca->ka", found, ends), axis=1)
    for weights in random.dirichlet(np.ones(dim), 300):
        assert (least <= np.linalg.norm(p - np.einsum("c,kca->ka", weights, ends), axis=1) + 1e-12).all()


def test_a_bond_breaks_where_its_traction_is_too_large_and_for_good() -> None:
    """Half of a side is lifted: bonds there break, and what they held is dissipated."""
    tie, low, high = glued(2, gap=0.0, stiffness=1.0, strength=0.5)
    eps = 1.0 / (0.5 * 0.5 / 2.0 + 0.5 * 0.25 / 2.0)
    lift = np.where(high.mesh.X[:, :1] > 0.5, 0.6 / eps, 0.4 / eps) * np.array([0.0, 1.0])
    lifted = {"low": low.mesh.X, "high": high.mesh.X + lift}
    pulled(tie, lifted)
    held = tie.stored
    assert held == pytest.approx(float((0.5 * eps * tie.bonds.area * (lift[:, 1] ** 2)).sum()), rel=1e-9)
    assert tie.dissipated == 0.0
    tie.close()
    assert tie.broken == (high.mesh.X[:, 0] > 0.5).sum()
    lost = tie.dissipated
    assert tie.stored + lost == pytest.approx(held, rel=1e-12)
    torn = high.mesh.X[tie.bonds.vertex, 0] > 0.5
    assert lost == pytest.approx(0.5 * 0.36 / eps * tie.bonds.area[torn].sum(), rel=1e-9)
    for places in (lifted, {"low": low.mesh.X, "high": high.mesh.X - 0.1 * lift}):
        force = pulled(tie, places)["high"]
        tie.close()
        assert (force[high.mesh.X[:, 0] > 0.5] == 0.0).all()
        assert (force[high.mesh.X[:, 0] < 0.5, 1] != 0.0).all()
        assert tie.dissipated == lost


@pytest.mark.parametrize("side", [0, 1])
def test_what_held_on_what_has_gone_is_broken(side: int) -> None:
    """Of the finer side its last vertex goes, or of the other its last face; the rows of the others are turned round."""
    tie, low, high = glued(2, gap=0.0, stiffness=1.0)
    lift = 0.01 * np.array([0.0, 1.0])
    before = pulled(tie, {"low": low.mesh.X, "high": high.mesh.X + lift})
    held, sizes = tie.stored, before["high"].copy()
    remade = tie.sides[side]
    rows = np.arange(remade.n)[::-1].copy()
    far = int(remade.mesh.X[:, 0].argmax())
    lost = tie.bonds.vertex == far if side == 0 else (tie.bonds.corners == far).any(1)
    gone = np.isin(np.arange(high.n), tie.bonds.vertex[lost])
    remade.mesh.X, remade.mesh.faces = remade.mesh.X[::-1], rows[remade.mesh.faces]
    if side == 0:
        rows[far] = -1
    else:
        remade.mesh.faces = remade.mesh.faces[~(remade.mesh.faces == rows[far]).any(1)]
    tie.renew(remade, rows)
    assert tie.broken == lost.sum() > 0
    assert tie.stored + tie.dissipated == pytest.approx(held, rel=1e-12)
    found = pulled(tie, {"low": low.mesh.X, "high": high.mesh.X + lift})
    after = found["high"]
    assert found["low"].sum(0) == pytest.approx(-after.sum(0), rel=1e-12)
    kept = after[::-1] if side == 0 else after
    assert (kept[gone] == 0.0).all()
    assert kept[~gone] == pytest.approx(sizes[~gone], rel=1e-12)


def test_a_tie_in_one_dimension_is_a_spring() -> None:
    space = Space(1)
    ends = [
        SimpleNamespace(X=np.array([[x], [x + 1.0]]), faces=np.array([[0], [1]]), N=np.array([[-1.0], [1.0]]),
                        A=np.ones(2), starts=np.array([0, 1, 2]), around=np.array([0, 1]))
        for x in (0.0, 1.0)
    ]  # fmt: skip
    a, b = (surface(n, of, 0.25, space) for n, of in zip("ab", ends, strict=True))
    tie = Tie(Contact(between=("a", "b"), law="tie", stiffness=4.0), a, b, space, UNITS, Clock(1.0, "cpu"))
    force = pulled(tie, {"a": ends[0].X, "b": ends[1].X + 0.1})
    eps = 4.0 * 2.0 / 0.25
    assert force["a"].ravel() == pytest.approx([0.0, 0.1 * eps])
    assert force["b"].ravel() == pytest.approx([-0.1 * eps, 0.0])
