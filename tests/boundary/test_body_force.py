"""Forces per volume over regions, and gravity that changes: of the reference position, in every form, on the ledger."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import block, body, box, held, material, scene
from wsph.simulation.compose import compose

METHODS: list[dict[str, Any]] = [
    {"formulation": "stress-points"}, {"formulation": "total-lagrangian"},
    {"formulation": "total-lagrangian", "support": 2.6}, {"formulation": "updated-lagrangian"},
    {"integrator": "rk4"}, {"integrator": "lf4"}, {"integrator": "tsph"}, {"integrator": "ul-tsph"},
]  # fmt: skip


def test_a_rotating_disc_is_that_of_the_closed_form() -> None:
    """In its own frame, under b = rho w^2 r (Timoshenko & Goodier, 30): sigma = (3 + nu)/8 rho w^2 a^2 in the middle, u =
    (1 - nu)/4 rho w^2 a^3/E at the rim."""
    nu, rate, a = 0.3, 1e-3, 1.0
    keys = {"state": "stress", "material": material(poisson_ratio=nu), "damping": {"rate": 2.0}, "surface": "fitted"}
    disc = body({"type": "disc", "center": [0.0, 0.0], "radius": a}, 0.1, **keys)
    disc["body_force"] = {"x": f"{rate**2}*x", "y": f"{rate**2}*y"}
    output = {"fields": ["displacement", "stress"]}
    result = wsph.run(scene(disc, run={"end": 25.0, "cfl": "auto"}, output=output))
    place, moved = result.particles["position"][:, :2], result.particles["displacement"][:, :2]
    far = np.linalg.norm(place, axis=1)
    rim, middle = far > a - 1e-3, far < 0.15
    out = (moved * place).sum(1) / np.maximum(far, 1e-300)
    assert out[rim] == pytest.approx(0.25 * (1.0 - nu) * rate**2 * a**3, rel=1e-2)
    # (3 + nu)/8 (a^2 - r^2) along the radius, (3 + nu)/8 a^2 - (1 + 3 nu)/8 r^2 around: their mean.
    exact = rate**2 / 8.0 * ((3.0 + nu) * a**2 - 2.0 * (1.0 + nu) * far[middle] ** 2)
    mean = result.particles["stress"][middle][:, :2].mean(1)
    assert mean == pytest.approx(exact, rel=1e-2)


@pytest.mark.parametrize(("dim", "method"), [
    *((dim, method) for dim in (1, 2) for method in METHODS), (3, METHODS[0]), (3, METHODS[6]),
], ids=str)  # fmt: skip
def test_gravity_as_an_expression_is_gravity(dim: int, method: dict[str, Any]) -> None:
    """A number, the same as an expression of t, of x, by a table, and as a force of a body of density 1: one run."""
    made, given = {"state": "strain"} if dim < 3 else {}, -1e-3
    beam = body(box(1.0, 0.5, 0.5) if dim == 3 else box(*(1.0, 0.5)[:dim]), 0.25, **made)
    tables = {"g": {"t": [0.0, 9.0], "value": [given, given]}}
    found = []
    for gravity in ({"x": given}, {"x": f"{given} + 0*t"}, {"x": f"{given} + 0*x"}, {"x": "g"}, None):
        one = beam if gravity is not None else {**beam, "body_force": {"x": f"{given}*(t >= 0)"}}
        keys = {"gravity": gravity} if gravity is not None else {}
        run = {"end": 2.0, "cfl": 0.25, **method}
        given_scene = scene(one, run=run, functions=tables, boundary=[held("-x", dim)], **keys)
        result = wsph.run(given_scene)
        found.append((result.particles["velocity"], result.history["external_work"][-1]))
    size = np.abs(found[0][0]).max()
    for velocity, work in found[1:]:
        assert velocity == pytest.approx(found[0][0], abs=1e-12 * size)
        # Of a processed method the way of what changes in time is that of its inner variables.
        assert work == pytest.approx(found[0][1], rel=1e-3 if method.get("integrator") == "lf4" else 1e-11)


FALLING = "-0.02*cos(3*t)"


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_free_body_falls_as_its_gravity_says(method: dict[str, Any]) -> None:
    run = {"end": 1.5, "cfl": 0.1, **method}
    result = wsph.run(block(2, 4, run=run, tables={"gravity": {"y": FALLING}}))
    time = float(result.history["time"][-1])
    exact = -0.02 / 3.0 * np.sin(3.0 * time)
    assert result.particles["velocity"][:, 1] == pytest.approx(exact, abs=2e-4 * 0.02)
    # All that its gravity does is its motion.
    history = result.history
    assert history["external_work"][-1] == pytest.approx(0.5 * exact**2, abs=2e-3 * 0.5 * (0.02 / 3.0) ** 2)
    assert np.abs(history["residual"]).max() < 2e-3 * history["external_work"].max()


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_region_is_pushed_by_its_volume_and_moves_with_the_body(method: dict[str, Any]) -> None:
    """Of a block that flies on, two entries in different places: the momentum is theirs, wherever it has come to."""
    forces = [{"where": "x > 0.5", "x": 2e-4}, {"x": "1e-4*(y < 0.3)*t"}]
    flying = block(2, 10, velocity=[0.3, 0.0], body_force=forces, run={"end": 2.0, "cfl": 0.2, **method})
    result = wsph.run(flying)
    time, momentum = result.history["time"][-1], result.history["momentum_x"]
    at = result.particles["position"][:, :2]
    cells = len(at) == 100
    # Nodes at the border of a region stand for half a cell within it.
    first, second = (0.5, 0.3) if cells else (0.45, 0.25)
    asked = 2e-4 * first * time + 1e-4 * second * time**2 / 2.0
    tolerance = 1e-10 if method.get("integrator") not in ("tsph", "ul-tsph") else 5e-2
    assert momentum[-1] - momentum[0] == pytest.approx(asked, rel=tolerance)


@pytest.mark.parametrize("method", [METHODS[0], METHODS[3], METHODS[6]], ids=str)
def test_resumed_forces_have_the_same_bits(method: dict[str, Any], tmp_path: Path) -> None:
    force = {"where": "x > 0.4", "y": "1e-3*sin(t)*x"}
    given = block(2, 6, body_force=force, run={"end": 1.0, **method}, tables={"gravity": {"x": "1e-3*cos(t)"}})
    whole = wsph.run(given)
    kept = given.with_(**{"checkpoint": {"every": 5}, "run.end": 0.5})
    wsph.run(kept, tmp_path / "cut")
    again = wsph.run(given.with_(checkpoint={"every": 5}), tmp_path / "cut", resume=True)
    assert np.array_equal(again.particles["velocity"], whole.particles["velocity"])
    assert again.history["external_work"][-1] == whole.history["external_work"][-1]


@pytest.mark.parametrize(
    ("keys", "tables", "message"),
    [
        ({"body_force": {"z": 1.0}}, {}, "bodies.0.body_force.0.z: is none of x, y"),
        ({"body_force": {"where": "x > 0"}}, {}, "bodies.0.body_force.0: has no force: give x, y or z"),
        ({"body_force": {"where": "x + 1", "x": 1.0}}, {}, "bodies.0.body_force.0.where: 'x [+] 1' is no comparison"),
        ({"body_force": {"where": "x > 7", "x": 1.0}}, {}, "bodies.0.body_force.0.where: 'x > 7' selects no particle"),
        ({"body_force": {"x": "3 Pa"}}, {}, "bodies.0.body_force.0.x"),
        ({"body_force": {"x": "z"}}, {}, "bodies.0.body_force.0.x: 'z' uses z"),
        ({}, {"gravity": {"y": "g*2"}}, "gravity.y: .*unknown name 'g'"),
        ({}, {"gravity": {"y": "9.81 m"}}, "gravity.y: .*not in units of m/s2"),
    ],
)
def test_what_is_no_force_is_refused_by_name(keys: dict[str, Any], tables: dict[str, Any], message: str) -> None:
    with pytest.raises(wsph.SceneError, match=message):
        compose(block(2, 4, tables=tables, **keys))


def test_the_paper_s_correction_takes_numbers_alone() -> None:
    run = {"formulation": "total-lagrangian", "correction": "paper"}
    keys = {"residual": {"coefficient": 0.0}}
    with pytest.raises(wsph.Refused, match="takes gravity that is a number alone"):
        compose(block(1, 10, state="stress", run=run, tables={"gravity": {"x": "t"}}, **keys))
