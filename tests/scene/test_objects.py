"""Scenes of objects: the same scenes as of tables, with docstrings, signatures and units."""

import inspect
from pathlib import Path

import pytest
from wsph_materials.mises import Mises

import wsph

ROOT = Path(__file__).resolve().parents[2]


def scene_of_objects(material: object) -> wsph.Scene:
    beam = wsph.Body(
        name="beam",
        shape=wsph.Combined(type="difference", shapes=(wsph.Box(type="box", min=(0.0, 0.0), max=(0.1, 0.02)), wsph.Ball(type="disc", center=(0.05, 0.01), radius=0.004))),
        spacing="2 mm",
        state="stress",
        material=material,
    )  # fmt: skip
    return wsph.Scene(
        schema=1,
        dim=2,
        run=wsph.Run(integrator="leapfrog", end="10 us", cfl=0.5),
        bodies=[beam],
        functions={"push": wsph.Function(t=(0.0, "1 us"), value=(0.0, -1e6))},
        boundary=[wsph.Boundary(body="beam", face="-x", fixed=("x", "y")), wsph.Boundary(body="beam", face="+x", traction={"y": "push"})],
        probes=[wsph.Probe(name="tip", at=((0.1, 0.01),), fields=("displacement",))],
    )  # fmt: skip


STEEL = {"density": 7850.0, "youngs_modulus": 210e9, "poisson_ratio": 0.3, "yield_stress": 350e6}


def test_a_scene_of_objects_is_that_of_tables() -> None:
    tables = {
        "schema": 1,
        "dim": 2,
        "run": {"integrator": "leapfrog", "end": "10 us", "cfl": 0.5},
        "bodies": [
            {
                "name": "beam",
                "shape": {
                    "type": "difference",
                    "shapes": [
                        {"type": "box", "min": [0.0, 0.0], "max": [0.1, 0.02]},
                        {"type": "disc", "center": [0.05, 0.01], "radius": 0.004},
                    ],
                },
                "spacing": "2 mm",
                "state": "stress",
                "material": {"model": "mises", **STEEL},
            }
        ],
        "functions": {"push": {"t": [0.0, "1 us"], "value": [0.0, -1e6]}},
        "boundary": [
            {"body": "beam", "face": "-x", "fixed": ["x", "y"]},
            {"body": "beam", "face": "+x", "traction": {"y": "push"}},
        ],
        "probes": [{"name": "tip", "at": [[0.1, 0.01]], "fields": ["displacement"]}],
    }
    of_class = scene_of_objects(Mises(**STEEL))
    by_name = scene_of_objects(wsph.material("mises", **{**STEEL, "youngs_modulus": "210 GPa", "density": "7.85 g/cc"}))
    of_table = wsph.Scene(**tables)
    for each in (of_class, by_name):
        assert {**each.data(), "bodies": None} == {**of_table.data(), "bodies": None}
        (ours,), (theirs,) = each.bodies, of_table.bodies
        assert ours.material.options().items() >= theirs.material.options().items()
        assert ours.shape == theirs.shape
    assert wsph.compose(of_class).particles == wsph.compose(of_table).particles


def test_a_scene_of_objects_has_its_faults_told_by_key() -> None:
    good = scene_of_objects(Mises(**STEEL))
    with pytest.raises(wsph.SceneError, match="boundary.0.body: no body is named 'bean'; did you mean 'beam'"):
        wsph.Scene(**{**good.data(), "boundary": [wsph.Boundary(body="bean", face="-x", fixed=("x",))]})


def test_a_material_by_name_says_what_is_wrong_with_it() -> None:
    with pytest.raises(wsph.SceneError, match=r"mises.yield_stres: unknown key; did you mean 'yield_stress'"):
        wsph.material("mises", yield_stres=1.0)
    with pytest.raises(wsph.SceneError, match="unknown unit 'gpa'; did you mean 'GPa'"):
        wsph.material("elastic", density=1.0, youngs_modulus="1 gpa", poisson_ratio=0.0)


def test_every_public_class_says_what_it_is_and_what_it_takes() -> None:
    for name in wsph.__all__:
        made = getattr(wsph, name)
        if name != "__version__":
            assert inspect.getdoc(made), name
    assert "spacing" in inspect.signature(wsph.Body).parameters
    assert "friction" in inspect.signature(wsph.Contact).parameters
