"""Probes: at places, over selections, in one body."""

import json

import pytest

import wsph


def test_an_initial_velocity_and_reduced_probes(shock_bar: wsph.Scene) -> None:
    probes = [
        {"name": name, "where": "x > 0.495 and x < 0.605", "reduce": name, "fields": ["velocity_x"]}
        for name in ("mean", "sum", "max")
    ]  # fmt: skip
    scene = shock_bar.with_(
        end="0.1 ms",
        probes=probes,
        **{"bodies.0.velocity": ["2*x"], "boundary": [{"body": "bar", "face": "+x", "velocity": {"x": 2.0}}]},
    )
    result = wsph.run(scene)
    first = {name: result.probes[name]["velocity_x"][0] for name in ("mean", "sum", "max")}
    assert first == {"mean": pytest.approx(1.1), "sum": pytest.approx(12.1), "max": pytest.approx(1.2)}
    both = wsph.run(
        scene.with_(probes=[{"name": "d", "at": [[0.5], [0.7]], "fields": ["velocity_x", "von_mises"]}])
    ).probes["d"]
    assert set(both) == {"time", "velocity_x[0]", "velocity_x[1]", "von_mises[0]", "von_mises[1]"}


def test_the_density_is_for_frames(shock_bar: wsph.Scene) -> None:
    with pytest.raises(wsph.SceneError, match="the density cannot be probed in the small-strain form; frames carry it"):
        wsph.run(shock_bar.with_(probes=[{"name": "d", "at": [[0.5]], "fields": ["density"]}]))


@pytest.mark.filterwarnings("ignore:bodies 'bar' and 'twin' overlap")
def test_a_probe_that_lies_in_two_bodies_has_to_name_one(shock_bar: wsph.Scene) -> None:
    data = shock_bar.with_(end="0.1 ms").data()
    data["bodies"].append(json.loads(json.dumps(data["bodies"][0])) | {"name": "twin"})
    probe = {"name": "p", "where": "x >= 0", "reduce": "sum", "fields": ["velocity_x"]}
    data["probes"] = [probe]
    with pytest.raises(wsph.SceneError, match="probes.0.where: lies in 'bar', 'twin': name one with `body`"):
        wsph.run(wsph.Scene(**data))
    data["probes"] = [probe | {"body": "bar"}]
    assert wsph.run(wsph.Scene(**data)).probes["p"]["velocity_x"][0] == 1.0
