"""Loads add: components, parts that meet or overlap, edges and corners. Their resultant and moment are those that were asked
for, in every form, dimension and direction."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import body, box, held, material, scene
from wsph.simulation.compose import compose

SIDES, SPACING, ANGLE = (1.0, 0.4, 0.4), 0.1, 30.0
FORMS: dict[str, dict[str, Any]] = {
    "stress-points": {},
    "total-lagrangian": {},
    "total-lagrangian, kernel": {"support": 2.6},
    "updated-lagrangian": {},
}
AXIS = np.array([0.36, 0.48, 0.8])


def turn(dim: int, turned: bool) -> np.ndarray:
    """The rotation of the body, (dim, dim)."""
    if not turned:
        return np.eye(dim)
    c, s = np.cos(np.deg2rad(ANGLE)), np.sin(np.deg2rad(ANGLE))
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    x, y, z = AXIS
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + s * cross + (1.0 - c) * cross @ cross


def own(axis: int, R: np.ndarray) -> str:
    """An expression of the coordinate along an axis of the shape."""
    return "(" + " + ".join(f"({float(R[k, axis])!r})*{'xyz'[k]}" for k in range(len(R))) + ")"


def loads(dim: int, R: np.ndarray) -> tuple[list[dict[str, Any]], list[tuple[np.ndarray, np.ndarray]]]:
    """Entries of a scene, and for each value the force that it asks for and where: along the axes of the shape, which
    `R` turns; tractions are along the coordinate axes."""
    half = np.array(SIDES[:dim]) / 2.0
    face = f"{own(0, R)} > {float(half[0]) - 0.6 * SPACING!r}"
    across = float(np.prod(SIDES[1:dim]))
    e, right = np.eye(dim), half * np.eye(dim)[0]
    entries: list[dict[str, Any]] = [{"face": "+x", "stress": {"xx": 300.0}}, {"face": "+x", "traction": {"x": -50.0}}]
    entries += [{"face": "-x", "stress": {"xx": "20*t"}}, {"face": "+x", "stress": {"xx": 7.0}}]
    asked = [(307.0 * across * R[:, 0], R @ right), (-50.0 * across * e[0], R @ right)]
    asked += [(-20.0 * across * R[:, 0], -R @ right)]
    if dim > 1:
        entries[0]["stress"]["xy"] = 120.0
        asked += [(120.0 * across * R[:, 1], R @ right)]
        for sign in (1, -1):
            part = f"{face} and {sign}*{own(1, R)} >= 0"
            entries.append({"where": part, "stress": {"xx": 1000.0}})
            asked.append((500.0 * across * R[:, 0], R @ (right + sign * half[1] / 2.0 * e[1])))
        # Overlaps both.
        entries.append({"where": f"{face} and {own(1, R)} > -0.1001", "stress": {"xx": 77.0}})
        asked.append((0.75 * 77.0 * across * R[:, 0], R @ (right + 0.05 * e[1])))
        side = float(np.prod(SIDES[:dim])) / SIDES[1]
        entries.append({"face": "+y", "traction": {"y": 40.0}})
        asked.append((40.0 * side * e[1], R @ (half * e[1])))
        entries.append({"face": "-y", "stress": {"yy": -30.0, "xy": 10.0}})
        asked.append((30.0 * side * R[:, 1] - 10.0 * side * R[:, 0], -R @ (half * e[1])))
    return [{"body": "b", **entry} for entry in entries], asked


def outward(x: np.ndarray, dim: int) -> np.ndarray:
    """The outward normal of the face that holds a point."""
    far = np.abs(x) / np.array(SIDES[:dim])
    axis = int(far.argmax())
    return np.sign(x[axis]) * np.eye(dim)[axis]


def moment(force: np.ndarray, at: np.ndarray) -> np.ndarray:
    """sum of x f - f x, (dim, dim)."""
    return np.einsum("ni,nj->ij", at, force) - np.einsum("ni,nj->ij", force, at)


def applied(made: Any) -> tuple[np.ndarray, np.ndarray]:
    """Forces of the loads [N] at t = 1 s, and where they act."""
    system = made.bodies[0].system
    system.clock.time.assign([1.0 / system.scales.time, 1.0, 0.0, 0.0])
    system.loads.impose(system.clock, 0.0)
    unit = system.scales.stress * system.scales.length ** (system.space.dim - 1)
    return system.loads.vectors.numpy().astype(float) * unit, system.position


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("dim", "turned"), [(1, False), (2, False), (2, True), (3, False), (3, True)])
def test_loads_add_up_to_what_was_asked_for(form: str, dim: int, turned: bool) -> None:
    R = turn(dim, turned)
    rotate = {"rotate": ANGLE if dim == 2 else [AXIS.tolist(), ANGLE]} if turned else {}
    entries, asked = loads(dim, R)
    shape = box(*[(-side / 2.0, side / 2.0) for side in SIDES[:dim]]) | rotate
    run = {"formulation": form.split(",")[0], **FORMS[form]}
    force, at = applied(compose(scene(body(shape, SPACING), run=run, boundary=entries)))
    wanted = np.array([f for f, _ in asked])
    assert force.sum(0) == pytest.approx(wanted.sum(0), abs=1e-12 * np.abs(wanted).sum())
    if form.endswith("kernel"):
        # Its particles are half a spacing inside of a face, and a load on it is a load on them.
        asked = [(f, x - SPACING / 2.0 * R @ outward(R.T @ x, dim)) for f, x in asked]
    turning = moment(wanted, np.array([x for _, x in asked]))
    assert moment(force, at) == pytest.approx(turning, abs=1e-12 * np.abs(wanted).sum())


def test_a_load_costs_its_particles_alone() -> None:
    made = [
        compose(scene(body(box(1.0, 0.4), 0.1), boundary=entries))
        for entries in ([], [{"body": "b", "face": "+x", "stress": {"xx": "t"}}])
    ]
    without, with_load = (each.bodies[0].system.loads for each in made)
    assert (without.vectors.size, without.forces.count) == (1, 0)
    assert with_load.forces.count == 5  # The nodes of the face.


@pytest.mark.parametrize(
    ("entries", "integrator", "message"),
    [
        ([{"face": "+x", "velocity": {"x": 1.0}}, {"face": "+x", "velocity": {"x": 2.0}}], "leapfrog", r"boundary.1.velocity.x: prescribes what boundary.0.velocity.x has"),
        ([{"face": "+x", "velocity": {"x": 1.0}}, {"where": "x > 0.4", "fixed": ["x"]}], "leapfrog", "boundary.1.fixed"),
        ([{"where": "y > -0.1", "fixed": ["x"]}, {"face": "-x", "velocity": {"x": "t"}}], "leapfrog", "boundary.1.velocity.x"),
        ([{"face": "+x", "stress": {"xx": 1.0}}, {"face": "+x", "stress": {"xx": 2.0}}], "tsph", "boundary.1.stress.xx"),
        ([{"face": "+x", "stress": {"xx": 1.0}}, {"face": "+x", "stress": {"xx": 2.0}}], "ul-tsph", "boundary.1.stress.xx"),
    ],
)  # fmt: skip
def test_values_that_clash_are_refused_by_name(entries: list[dict[str, Any]], integrator: str, message: str) -> None:
    made = body(box((-0.5, 0.5), (-0.2, 0.2)), 0.1)
    with pytest.raises(wsph.SceneError, match=message):
        compose(scene(made, run={"integrator": integrator}, boundary=[{"body": "b", **each} for each in entries]))


@pytest.mark.parametrize("form", FORMS)
def test_faces_may_share_an_edge_and_equal_values_anything(form: str) -> None:
    entries = [
        {"face": "-x", "fixed": ["x", "y"]},
        {"face": "-y", "velocity": {"x": 0.5, "y": 0.0}},
        {"face": "-x", "velocity": {"y": 0.0}},
    ]
    made = compose(
        scene(
            body(box((-0.5, 0.5), (-0.2, 0.2)), 0.1),
            run={"formulation": form.split(",")[0], **FORMS[form]},
            boundary=[{"body": "b", **each} for each in entries],
        )
    )
    system = made.bodies[0].system
    if form != "updated-lagrangian":
        # Of the corner the later entry holds.
        corner = int(np.linalg.norm(system.position - (-0.5, -0.2), axis=1).argmin())
        system.impose(system.state, 0.0)
        assert system.state.read("velocity")[corner, 0] * system.scales.velocity == pytest.approx(0.5)


METHODS = [("leapfrog", form) for form in FORMS] + [("tsph", "small-strain"), ("ul-tsph", "updated-lagrangian")]


@pytest.mark.parametrize(("integrator", "form"), METHODS)
def test_two_components_on_a_turned_face(integrator: str, form: str) -> None:
    """A turned body answers to both as the upright one does."""
    found = []
    for angle in (0.0, ANGLE):
        R = turn(2, angle > 0.0)
        shape = box((-0.4, 0.4), (-0.25, 0.25)) | {"rotate": angle}
        load = {"body": "b", "face": "+x", "stress": {"xx": 3e-4, "xy": "1.2e-4*min(t, 1)"}}
        run = {"integrator": integrator, "formulation": form.split(",")[0], "end": 2.0, **FORMS.get(form, {})}
        block = body(shape, 0.1, material=material("jaumann"))
        output = {"fields": ["displacement"]}
        particles = wsph.run(scene(block, run=run, boundary=[load, held("-x", 2)], output=output)).particles
        found.append(particles["displacement"] @ R)
    assert np.abs(found[0]).max() > 3e-4
    # The turned lattice has other roundings, and places on it the digits of its length.
    assert found[1] == pytest.approx(found[0], abs=1e-11)


def test_parts_that_meet_at_a_node_and_overlap_push_with_their_sum() -> None:
    """The rate of the momentum is the load: 1 kPa on both halves of a face of 0.4 m."""
    parts = [
        {"body": "b", "where": f"x > 0.99 and {side}", "traction": {"x": 1000.0}} for side in ("y >= 0.2", "y <= 0.2")
    ]
    keys = {"density": 1000.0, "youngs_modulus": 1e7}
    result = wsph.run(scene(body(box(1.0, 0.4), 0.1, material=material(**keys)), run={"end": 0.01}, boundary=parts))
    assert result.history["momentum_x"][-1] == pytest.approx(400.0 * result.history["time"][-1], rel=1e-12)


@pytest.mark.parametrize(("dim", "state", "formulation"), [(2, "stress", "stress-points"), (3, None, "stress-points"), (2, "strain", "total-lagrangian")])  # fmt: skip
def test_a_turned_bar_of_large_strain_between_a_spring_and_a_growing_pressure(
    dim: int, state: str | None, formulation: str
) -> None:
    """With no Poisson's ratio its section stays: P = mu (s - 1/s) = -p gives the stretch s, and the spring's way is p/k."""
    length, stiffness, p, angle = 2.0, 0.5, 0.05, 30.0
    axis = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])[:dim]
    turn = {"rotate": angle if dim == 2 else [[0, 0, 1], angle]}
    shape = box((-length / 2.0, length / 2.0), *[(-0.5, 0.5)] * (dim - 1)) | turn
    keys = {"state": state} if state else {}
    law = material("neo-hookean", poisson_ratio=0.0)
    bar = body(shape, 0.25, material=law, damping={"rate": 1.0}, **keys)
    loads = [
        {"body": "b", "face": "-x", "spring": {"stiffness": stiffness}},
        {"body": "b", "face": "+x", "pressure": f"{p}*min(t/10, 1)"},
    ]
    run = {"end": 60.0, "formulation": formulation}
    result = wsph.run(scene(bar, run=run, boundary=loads, output={"fields": ["displacement"]}))
    along = result.particles["position"][:, :dim] @ axis + length / 2.0
    exact = -p / stiffness + (np.sqrt(p * p + 1.0) - p - 1.0) * along
    moved = result.particles["displacement"][:, :dim]
    assert moved == pytest.approx(np.outer(exact, axis), abs=1e-5 * np.abs(exact).max())
