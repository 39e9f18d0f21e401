"""Surfaces of bodies that break: new faces where cells die or part, and which vertices stay which."""

from typing import Any

import numpy as np
import pytest

from tests import scenes
from tests.contact.surfaces.bodies import BODIES, around, cells_of, whole
from wsph.contact.surfaces.meshing.boundary import successors
from wsph.contact.surfaces.meshing.mesh import area_vectors, surface_mesh
from wsph.contact.surfaces.surface import Surface
from wsph.errors import Refused
from wsph.formulations.one_set import OneSetSystem
from wsph.simulation.compose import compose

LINKS = {"links": {"criterion": "stretch", "threshold": 0.1}}
FIELD = {"phase_field": {"fracture_energy": 1.0, "length": 0.3}}
pytestmark = pytest.mark.filterwarnings("ignore:body")


def broken(form: str, model: str, **keys: Any) -> tuple[OneSetSystem, Surface]:
    """A unit square of 8 x 8 cells that can break."""
    scene = scenes.block(2, 8, run={"formulation": form}, model=model, **keys)
    system = compose(scene).bodies[0].system
    assert isinstance(system, OneSetSystem)
    return system, Surface("b", system, np.zeros(2), lagged=False)


def tear(system: OneSetSystem, below: float) -> None:
    """Break the links across x = 1/2 whose ends are below a height."""
    pairs, weights = system.neighbours, system.breakable_weights
    assert weights is not None
    one, other = system.position[pairs.rows()], system.position[pairs.indices.numpy()]
    across = ((one[:, 0] - 0.5) * (other[:, 0] - 0.5) < 0.0) & (one[:, 1] < below)
    weights.assign(np.where(across, 0.0, weights.numpy()))


def closed(surface: Surface) -> bool:
    mesh = surface.mesh
    return bool(np.abs(area_vectors(mesh.X, mesh.faces, mesh.N).sum(0)).max() < 1e-13)


def test_links_that_break_open_a_crack() -> None:
    """Four links: four faces on either bank. The mouth is two vertices then, the tip one, those between are new."""
    system, surface = broken("total-lagrangian", "jaumann", **LINKS)
    assert surface.eroded() is None
    before = surface.mesh.X.copy()
    tear(system, 0.5)
    now = surface.eroded()
    assert now is not None
    assert (surface.n, surface.m) == (40, 40)
    assert closed(surface)
    assert surface.mesh.A.sum() == pytest.approx(5.0)
    assert surface.mesh.X[now] == pytest.approx(before)
    assert len(np.unique(now)) == 32
    assert surface.eroded() is None
    # Above the tip cells hang together: what the banks see of each other is around it alone.
    assert surface.exact
    slope = np.array([[1.0, 2.0], [-1.0, 0.5]])
    assert surface.B @ (system.position @ slope) == pytest.approx(surface.mesh.X @ slope, abs=1e-12)


def test_a_body_torn_in_two_has_two_surfaces() -> None:
    system, surface = broken("total-lagrangian", "jaumann", **LINKS)
    tear(system, 2.0)
    surface.eroded()
    left = np.where(system.position[:, 0] < 0.5, 1.0, 0.0)
    assert sorted(np.unique(np.round(surface.B @ left, 12)).tolist()) == [0.0, 1.0]
    assert (surface.B @ left).sum() == 24
    assert closed(surface)


@pytest.mark.parametrize(("form", "model"), [("stress-points", "elastic"), ("total-lagrangian", "elastic")])
def test_what_a_phase_field_has_broken_is_no_surface(form: str, model: str) -> None:
    """A column of cells dies: its two ends go, and both halves have a side more."""
    system, surface = broken(form, model, **FIELD)
    before = surface.mesh.X.copy()
    cells = system.geometry.cells
    damage = system.attached["phase_field"].damage
    assert damage is not None
    column = (np.abs(cells[:, 0] - 0.4375) < 1e-9).astype(float)
    damage.assign(0.9 * column)
    assert surface.eroded() is None
    damage.assign(column)
    now = surface.eroded()
    assert now is not None
    assert surface.mesh.A.sum() == pytest.approx(4.0 - 0.25 + 2.0)
    assert closed(surface)
    assert surface.mesh.X[now[now >= 0]] == pytest.approx(before[now >= 0])
    assert (now >= 0).all()
    damage.assign(np.ones_like(column))
    now = surface.eroded()
    assert (surface.n, surface.m) == (0, 0)
    assert now is not None
    assert (now == -1).all()
    surface.place(system.state)
    surface.spread(system.temporary())
    surface.close(system.state)


def test_forces_and_works_go_on_after_a_break() -> None:
    """The work so far stays, and ways are counted on from the last step."""
    system, surface = broken("total-lagrangian", "jaumann", **LINKS)

    def step(seed: int) -> tuple[np.ndarray, np.ndarray]:
        random = np.random.default_rng(seed)
        u = 0.1 * random.normal(size=(system.count, 2))
        system.state.write("displacement", u)
        surface.place(system.state)
        force = random.normal(size=(surface.n, 2))
        surface.force.assign(force)
        rate = system.temporary()
        surface.spread(rate)
        assert rate.read("velocity") == pytest.approx(surface.B.T @ force / surface.mass[:, None])
        surface.close(system.state)
        return u, force

    first, force = step(0)
    load = surface.B.T @ force
    work = surface.work
    assert work == pytest.approx(0.5 * (load * first).sum())
    tear(system, 0.5)
    surface.eroded()
    assert surface.work == work
    second, force = step(1)
    assert surface.struct.moved.numpy() == pytest.approx(surface.B @ (second - first))
    load += surface.B.T @ force
    assert surface.work == pytest.approx(work + 0.5 * (load * (second - first)).sum())


def test_a_body_that_cannot_break_is_not_remade() -> None:
    system = compose(scenes.block(2, 4, run={"formulation": "stress-points"})).bodies[0].system
    assert isinstance(system, OneSetSystem)
    surface = Surface("b", system, np.zeros(2), lagged=False)
    assert surface.eroded() is None
    with pytest.raises(RuntimeError, match="cannot break"):
        surface.remesh(np.ones(16, bool))


def test_cracks_that_leave_nodes_whole_are_cut_from_the_start() -> None:
    """Particles at cells, a crack along a line of the grid."""
    cracks = [{"from": [0.5, 0.0], "to": [0.5, 0.5]}]
    scene = scenes.block(2, 8, run={"formulation": "total-lagrangian"}, placement="cells", cracks=cracks)
    system = compose(scene).bodies[0].system
    assert isinstance(system, OneSetSystem)
    surface = Surface("b", system, np.zeros(2), lagged=False)
    assert (surface.n, surface.m) == (40, 40)


def test_particles_without_cells_have_no_surface(tmp_path: Any) -> None:
    path = tmp_path / "points.csv"
    path.write_text("x,y,volume\n" + "".join(f"{i},{j},1\n" for i in range(6) for j in range(6)))
    body = {"name": "b", "points": {"file": str(path)}, "material": scenes.material(), "state": "strain"}
    keys = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.3, "formulation": "total-lagrangian"}
    import wsph

    system = compose(wsph.Scene(schema=1, dim=2, run=keys, bodies=[body])).bodies[0].system
    assert isinstance(system, OneSetSystem)
    with pytest.raises(Refused, match="body 'b': its particles have no cells between them"):
        Surface("b", system, np.zeros(2), lagged=False)


@pytest.mark.parametrize("name", BODIES)
def test_any_cells_can_die(name: str) -> None:
    """The surface of what is left is closed, its faces look out, and every vertex that stays is where it was."""
    geometry = BODIES[name]()
    live = np.random.default_rng(11).random(cells_of(geometry)) > 0.3
    old, new = whole(geometry), surface_mesh(around(geometry, live=live), deep=True)
    vectors = area_vectors(new.X, new.faces, new.N)
    assert np.abs(vectors.sum(0)).max() < 1e-13 * new.A.sum()
    inside = (new.X[new.faces].mean(1) * vectors).sum() / new.X.shape[1]
    if not old.moved.any() and len(live) == len(geometry.cell_volume):
        assert inside == pytest.approx(geometry.cell_volume[live].sum(), rel=1e-2)
    assert set(new.boundary.cell.tolist()) <= set(np.flatnonzero(live).tolist())
    now = successors(old.boundary, new.boundary)
    stays = now >= 0
    assert stays.any()
    assert not stays.all()
    assert (new.boundary.node[now[stays]] == old.boundary.node[stays]).all()
    gone = np.flatnonzero(~stays)
    left = {
        (new.boundary.node[v], c)
        for v in range(len(new.X))
        for c in new.boundary.cells[new.boundary.starts[v] : new.boundary.starts[v + 1]]
    }
    for vertex in gone:
        fan = old.boundary.cells[old.boundary.starts[vertex] : old.boundary.starts[vertex + 1]]
        assert not any((old.boundary.node[vertex], cell) in left for cell in fan)
