"""Which lattices a ladder may have, what they cost, and the order that errors can have, without a run."""

import pytest

import wsph
from tests.scenes import bar, block, body, box, held, scene
from wsph.accuracy.planning.cost import Costs, plan
from wsph.accuracy.planning.formal import formal_order
from wsph.accuracy.planning.lattices import Lattices


def ladder(of: wsph.Scene, count: int = 5) -> list[int]:
    lattices = Lattices(of)
    found = [lattices.first]
    while len(found) < count:
        found.append(lattices.next(found[-1] + 0.5))
    return found


def probed(of: wsph.Scene, *place: float) -> wsph.Scene:
    return wsph.Scene(**of.data() | {"probes": [{"name": "p", "at": [list(place)], "fields": ["velocity"]}]})


def test_lattices_divide_every_edge():
    # 12 x 8 cells: steps of 3 x 2.
    of = scene(body(box(3.0, 2.0), 0.25, state="stress"), boundary=[held("-x", 2)])
    assert ladder(of) == [3, 6, 9, 12, 15]
    for cells in ladder(of):
        plan(Lattices(of).scene_at(cells))


def test_probes_stay_on_lines_or_between_them():
    assert ladder(probed(bar(12), 0.5)) == [8, 10, 12, 14, 16]
    assert ladder(probed(bar(12), 0.25)) == [8, 12, 16, 20, 24]
    between = ladder(probed(bar(10), 0.25))  # in the middle of a cell
    assert all(cells % 4 == 2 for cells in between)
    assert ladder(probed(bar(10), 0.234)) == [8, 9, 10, 11, 12]


def test_a_fixed_step_follows_the_spacing():
    of = bar(20, run={"dt": 0.01})
    assert Lattices(of).scene_at(40).run.dt == pytest.approx(0.005)


def test_bodies_from_files_have_one_spacing(tmp_path):
    (tmp_path / "points.csv").write_text("x,y,volume\n0,0,1\n1,0,1\n")
    data = bar(8).data()
    of = {"name": "b", "points": {"file": str(tmp_path / "points.csv")}, "material": data["bodies"][0]["material"]}
    run = {"integrator": "leapfrog", "formulation": "total-lagrangian", "end": 1.0, "cfl": 0.1}
    scene = wsph.Scene(schema=1, dim=2, run=run, bodies=[of | {"state": "stress"}])
    with pytest.raises(wsph.WsphError, match="give it a shape and a spacing"):
        Lattices(scene)


def test_staircases_choose_lattices_that_miss_less_of_their_volume():
    disc = {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}
    of = scene(body(disc, 0.2, state="stress", surface="stairs"))
    lattices = Lattices(of)
    every = range(lattices.first, lattices.first + 24)
    taken = [n for n in every if lattices.next(n - 0.5) == n]
    assert 6 < len(taken) < 20
    mean = lambda cells: sum(lattices.misfit(n) * n for n in cells) / len(cells)  # noqa: E731
    assert mean(taken) < 0.7 * mean(every)
    assert formal_order(of).stairs.keys() == {of.bodies[0].name}


@pytest.mark.parametrize("dim", [1, 2])
def test_work_is_planned_exactly(dim):
    of = block(dim=dim, cells=6, run={"cfl": 0.3, "end": 1.0})
    costs = Costs(Lattices(of))
    for cells in (6, 12):
        changed = Lattices(of).scene_at(cells)
        s = wsph.run(changed).summary
        assert costs.plan(cells).work == s["pairs"] * s["right_hand_sides"]


HELD = {"boundary": [held("-x", 1), held("+x", 1)]}


def test_smooth_motions_have_order_two():
    assert formal_order(bar(20, velocity=["1e-3*sin(pi*x)"], tables=HELD)).order == 2.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"velocity": ["1e-3"], "boundary": [held("-x", 1)]}, "boundary.0 holds what moves at the start"),
        ({"velocity": ["1e-3*(x > 0.5)"]}, "bodies.0.velocity jumps inside"),
        ({"boundary": [{"body": "b", "face": "-x", "traction": {"x": 1e-3}}]}, "boundary.0.traction.x begins at once"),
        (
            {"boundary": [{"body": "b", "face": "-x", "traction": {"x": "1e-3*t*(t < 0.1)"}}]},
            "boundary.0.traction.x steps",
        ),
    ],
)
def test_jumps_have_order_one(changes, words):
    data = bar(20).data()
    name = data["bodies"][0]["name"]
    for condition in changes.get("boundary", []):
        condition["body"] = name
    data["boundary"] = changes.get("boundary", [])
    if "velocity" in changes:
        data["bodies"][0]["velocity"] = changes["velocity"]
    found = formal_order(wsph.Scene(**data))
    assert found.order == 1.0
    assert words in str(found)
