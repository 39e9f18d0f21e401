"""Compositions: only what the scene asks for; refused beyond the limits, by name, with the number."""

import numpy as np
import pytest
import warp as wp

import wsph
from tests import scenes
from wsph.errors import Refused, SceneError
from wsph.simulation.compose import compose


def names(scene: wsph.Scene) -> list[str]:
    """Kernels of a step."""
    return [kernel.func.__name__ for kernel in compose(scene).launches()]


def test_a_step_launches_only_what_the_scene_asks_for(shock_bar: wsph.Scene, viscoplastic_bar: wsph.Scene) -> None:
    bare = shock_bar.with_(probes=[], **{"boundary": [{"body": "bar", "face": "-x", "fixed": ["x"]}]})
    assert names(bare) == ["half_step", "impose", "rate", "impose", "advance"]
    by_rows = ["half_step", "step_by_rows", "impose", "rate", "step_by_rows", "impose", "advance"]
    assert names(bare.with_(**{"bodies.0.spacing": 0.0005})) == by_rows
    assert names(shock_bar.with_(probes=[])) == ["half_step", "impose", "rate", "impose", "work", "advance"]
    assert names(shock_bar)[-2:] == ["record", "record"]
    assert names(viscoplastic_bar.with_(probes=[])).count("source") == 2
    moved = shock_bar.with_(probes=[], output={"fields": ["displacement"]})
    assert "drift" in names(moved)


def test_a_scene_of_one_material_compiles_only_its_kernels(
    shock_bar: wsph.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[str] = []
    original = wp.Module.load
    monkeypatch.setattr(wp.Module, "load", lambda self, *a, **k: (loaded.append(self.name), original(self, *a, **k))[1])
    composition = compose(shock_bar)
    composition.compile()
    step = {kernel.module.name for kernel in composition.launches()} | {
        composition.bodies[0].diagnostics.kernel(composition.bodies[0].system.state).module.name
    }
    setup = {"wsph.pairs.1d.f64", "wsph.weights.cubic-spline.1d.f64"}
    assert set(loaded) <= step | setup
    assert len(step) == 7  # half_step, rate, impose, work, advance, record, ledger


def test_a_scene_without_a_part_allocates_none_of_its_arrays(
    shock_bar: wsph.Scene, viscoplastic_bar: wsph.Scene
) -> None:
    def bytes_of(scene: wsph.Scene) -> tuple[dict[str, int], int]:
        state = compose(scene).bodies[0].system.state
        return state.widths, state.buffer.capacity

    n = 101
    assert bytes_of(shock_bar) == ({"velocity": 1, "stress": 1}, 8 * 2 * n)
    assert bytes_of(shock_bar.with_(output={"fields": ["displacement"]})) == (
        {"velocity": 1, "stress": 1, "displacement": 1},
        8 * 3 * n,
    )
    assert bytes_of(viscoplastic_bar) == ({"velocity": 1, "stress": 1, "internals": 2}, 8 * 4 * n)


@pytest.mark.parametrize(
    ("support", "limit"), [(1.2, 1.0), (1.8, 1.053), (2.2, 1.275), (2.4, 1.392), (3.6, 2.084), (4.4, 2.542)]
)
def test_the_limit_is_that_of_the_scene_s_own_weights(shock_bar: wsph.Scene, support: float, limit: float) -> None:
    assert compose(shock_bar.with_(support=support)).bodies[0].limit == pytest.approx(
        limit, abs=6e-4
    )  # as published, to its digits


def test_beyond_the_limit_is_refused_by_name(shock_bar: wsph.Scene) -> None:
    with pytest.raises(
        Refused, match=r"body 'bar': tsph at Courant number 1.01 is beyond its stability limit 1.000 \(2 sqrt\(m2\) of"
    ):
        compose(shock_bar.with_(cfl=1.01))
    compose(shock_bar.with_(cfl=1.0 + 5e-7))
    with pytest.warns(RuntimeWarning, match="limit 1.000"):
        compose(shock_bar.with_(cfl=1.01, guard="warn"))
    compose(shock_bar.with_(cfl=1.01, guard="off"))


def test_two_dimensions_are_held_below_the_corners_growth(shock_bar: wsph.Scene) -> None:
    square = square_scene(shock_bar)
    assert compose(square).bodies[0].limit == pytest.approx(0.9)
    with pytest.raises(Refused, match="limit 0.900 .*corners grow"):
        compose(square.with_(cfl=0.95))


def square_scene(shock_bar: wsph.Scene) -> wsph.Scene:
    """The bar made a square in plane strain."""
    data = shock_bar.data() | {"dim": 2, "probes": []}
    data["bodies"][0] |= {"shape": scenes.cube(2), "spacing": 0.1, "state": "strain"}
    data["run"]["cfl"] = 0.9
    return wsph.Scene(**data)


def test_the_material_s_own_time_step_is_a_limit(viscoplastic_bar: wsph.Scene) -> None:
    stiff = {"bodies.0.material.fluidity": 1e3, "bodies.0.material.exponent": 1.0}
    with pytest.raises(Refused, match=r"beyond what perzyna can take, limit 6.666e-07 s; use run.dt <= 6.666e-07"):
        compose(viscoplastic_bar.with_(**stiff))  # 2 F0 / (3 G gamma N), F0 = 0.1 of 4e5 Pa


def test_what_selects_nothing_or_cannot_be_is_refused(shock_bar: wsph.Scene) -> None:
    with pytest.raises(SceneError, match="boundary.0.where: 'x > 2' selects no particle of 'bar'"):
        compose(shock_bar.with_(boundary=[{"body": "bar", "where": "x > 2", "fixed": ["x"]}]))
    with pytest.raises(SceneError, match="probes.0.at: .* does not lie in one body"):
        compose(shock_bar.with_(probes=[{"name": "p", "at": [[3.0]], "fields": ["velocity"]}]))
    with pytest.raises(Refused, match="run.formulation: tsph works in 'small-strain', not in 'total-lagrangian'"):
        compose(shock_bar.with_(formulation="total-lagrangian"))
    with pytest.raises(Refused, match=r"there is no 'cuda:9'"):
        compose(shock_bar.with_(device="cuda:9"))
    with pytest.raises(SceneError, match="run.integrator.stages: unknown key; tsph knows no options"):
        compose(shock_bar.with_(integrator={"name": "tsph", "stages": 3}))
    with pytest.raises(Refused, match=r"virtual particles, the first at .* see too few .* raise run.support"):
        compose(shock_bar.with_(support=0.4))


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_every_dimension_and_precision_runs_ten_steps(shock_bar: wsph.Scene, dim: int, precision: str) -> None:
    data = shock_bar.data()
    body = data["bodies"][0]
    body |= {"shape": scenes.cube(dim), "spacing": 0.2}
    if dim == 3:
        del body["state"]
    data |= {"dim": dim, "probes": []}
    data["run"] |= {"cfl": 0.8, "precision": precision, "end": "8 ms"}
    result = wsph.run(wsph.Scene(**data))
    assert result.stable
    assert np.abs(result.particles["velocity"]).max() > 0.1


def test_a_scene_pays_nothing_for_fracture_and_contact_that_it_has_not() -> None:
    """The same kernels, launches and bytes whether or not the program knows of them."""

    def scene(**part: object) -> wsph.Scene:
        return scenes.block(run={"formulation": "total-lagrangian", "cfl": 0.2}, **part)

    bare = compose(scene())
    assert sorted(set(names(scene()))) == ["advance", "answer", "combine", "force", "gradient", "spread"]
    assert not {"damage", "damaged_stress"} & set(bare.bodies[0].system.state.widths)
    assert bare.interactions == ()
    assert not bare.program.followed
    broken = scene(phase_field={"fracture_energy": 1.0, "length": 0.15}, residual={"coefficient": 1.0})
    assert names(broken).count("advance") == names(scene()).count("advance") + 1
    assert compose(broken).bodies[0].system.nbytes > bare.bodies[0].system.nbytes
