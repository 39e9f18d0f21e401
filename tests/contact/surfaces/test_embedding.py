"""How vertices follow particles: exactly in linear fields, through no crack, and forces back with all that they have."""

import numpy as np
import pytest

from tests.contact.surfaces.bodies import BODIES, CUBE, MESHES, SLIT, SQUARE, around, cut, whole
from wsph.contact.surfaces.meshing.embedding import Embedding, embedding
from wsph.contact.surfaces.meshing.mesh import SurfaceMesh
from wsph.contact.surfaces.meshing.sparse import SparseRows
from wsph.geometry.geometry import Geometry

FORMS = [(name, True) for name in BODIES] + [(name, False) for name in BODIES if name not in MESHES]
"""Particles are the nodes of any body, or the cells of a lattice."""


def particles(geometry: Geometry, at_nodes: bool) -> np.ndarray:
    return geometry.nodes if at_nodes else geometry.cells


def made(name: str, at_nodes: bool) -> tuple[np.ndarray, SurfaceMesh, Embedding]:
    geometry: Geometry = BODIES[name]()
    mesh = whole(geometry)
    return particles(geometry, at_nodes), mesh, embedding(around(geometry), mesh, at_nodes=at_nodes)


@pytest.mark.parametrize(("name", "at_nodes"), FORMS)
def test_linear_fields_are_carried_exactly(name: str, at_nodes: bool) -> None:
    x, mesh, found = made(name, at_nodes)
    assert found.exact
    assert found.B @ np.ones(len(x)) == pytest.approx(1.0, abs=1e-12)
    slope = np.random.default_rng(7).normal(size=(x.shape[1], x.shape[1]))
    assert found.B @ (x @ slope) == pytest.approx(mesh.X @ slope, abs=1e-12)


@pytest.mark.parametrize(("name", "at_nodes"), FORMS)
def test_forces_keep_power_resultant_and_moment(name: str, at_nodes: bool) -> None:
    """About places in any motion: those of the vertices follow from those of the particles."""
    x, mesh, found = made(name, at_nodes)
    random = np.random.default_rng(8)
    force, u = random.normal(size=mesh.X.shape), random.normal(size=x.shape)
    spread = found.B.T @ force
    size = np.abs(force).sum()
    assert abs((force * (found.B @ u)).sum() - (spread * u).sum()) < 1e-13 * size
    assert spread.sum(0) == pytest.approx(force.sum(0), abs=1e-13 * size)
    there, here = mesh.X + found.B @ u, x + u
    moment = there.T @ force - here.T @ spread
    assert np.abs(moment - moment.T).max() < 1e-12 * size


@pytest.mark.parametrize("name", BODIES)
def test_a_vertex_at_its_particle_is_that(name: str) -> None:
    geometry: Geometry = BODIES[name]()
    mesh = whole(geometry)
    found = embedding(around(geometry), mesh, at_nodes=True)
    assert found.identity == (not mesh.moved.any())
    still = np.flatnonzero(~mesh.moved)
    own = found.B.only(still)
    assert (own.values == 1.0).all()
    assert (own.indices == mesh.boundary.node[still]).all()


def test_the_force_on_the_end_of_a_bar_reaches_two_cells() -> None:
    """Three halves of it the first cell, less one half the second: a uniform stress is in equilibrium with that."""
    geometry = cut(SQUARE, 0.1)
    mesh = whole(geometry)
    found = embedding(around(geometry), mesh, at_nodes=False)
    end = (mesh.X[:, 0] < 1e-9).astype(float)
    end[np.flatnonzero(end)[np.abs(mesh.X[end > 0.0, 1] - 0.5) > 0.49]] = 0.5
    spread = found.B.T @ end
    columns = [spread[np.abs(geometry.cells[:, 0] - at) < 1e-9].sum() for at in (0.05, 0.15, 0.25)]
    assert columns == pytest.approx([15.0, -5.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(("split", "at_nodes"), [(True, True), (True, False), (False, False)])
def test_no_vertex_sees_through_a_crack(split: bool, at_nodes: bool) -> None:
    """The left half of a cracked body moves: vertices below the tip do as their own bank."""
    geometry = cut(SQUARE, 0.1, cracks=SLIT, split=split)
    parted = np.zeros((0, 2), int)
    if not split:
        rows = 0.05 + 0.1 * np.arange(5)
        parted = np.array(
            [[np.linalg.norm(geometry.cells - [x, y], axis=1).argmin() for x in (0.45, 0.55)] for y in rows]
        )
    mesh = whole(geometry, parted)
    found = embedding(around(geometry, parted), mesh, at_nodes=at_nodes)
    x = particles(geometry, at_nodes)
    # Cells around the tip hang together around it.
    left = np.where(x[:, 0] < 0.5, 1.0, 0.0)
    if at_nodes:
        bank = np.zeros(len(x))
        for side in np.flatnonzero(geometry.faces.axis == 0):
            bank[geometry.faces.nodes[side]] += geometry.faces.sign[side]
        left = np.where(np.abs(x[:, 0] - 0.5) < 1e-9, (bank > 0.0).astype(float), left)
    moved = found.B @ left
    low = (mesh.X[:, 1] < 0.35) & (np.abs(mesh.X[:, 0] - 0.5) < 1e-9)
    assert sorted(np.round(moved[low], 12).tolist()) == [0.0] * 4 + [1.0] * 4


def test_a_layer_of_single_cells_is_known_not_to_be_exact() -> None:
    geometry = cut({**SQUARE, "max": [1.0, 0.1]}, 0.1)
    mesh = whole(geometry)
    assert not embedding(around(geometry), mesh, at_nodes=False).exact
    assert embedding(around(geometry), mesh, at_nodes=True).exact


def test_rows_are_short() -> None:
    """What a vertex is made of stays around it: stability and speed rest on that."""
    geometry = cut(CUBE, 0.1)
    B = embedding(around(geometry), whole(geometry), at_nodes=False).B
    assert np.diff(B.offsets).max() <= 36
    assert (abs(B) @ np.ones(B.columns)).max() < 2.6


def test_sparse_rows_are_a_matrix() -> None:
    random = np.random.default_rng(9)
    row, column = random.integers(0, 6, 40), random.integers(0, 9, 40)
    value = random.normal(size=40)
    dense = np.zeros((6, 9))
    np.add.at(dense, (row, column), value)
    rows = SparseRows.of((row, column, value), (6, 9))
    x = random.normal(size=(9, 2))
    assert rows.dense() == pytest.approx(dense)
    assert rows @ x == pytest.approx(dense @ x)
    assert rows.T.dense() == pytest.approx(dense.T)
    assert abs(rows).dense() == pytest.approx(np.abs(dense))
    some = np.array([4, 0, 4])
    assert rows.only(some).dense() == pytest.approx(dense[some])
