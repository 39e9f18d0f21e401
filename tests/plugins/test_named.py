"""A fault in the midst of a run's work is named after the plugin that has it, whichever of them was at work when it
showed."""

from pathlib import Path
from typing import Any

import pytest

import wsph
from tests import scenes
from tests.distributions import install
from wsph.errors import PluginError, Unstable

LAW = """
from dataclasses import dataclass, field
import warp as wp

@dataclass(frozen=True)
class Plugin:
    density: float = field(metadata={"unit": "kg/m3", "above": 0.0})
    youngs_modulus: float = field(metadata={"unit": "Pa"})
    poisson_ratio: float = field(metadata={"unit": ""})

    def moduli(self):
        return self.youngs_modulus / 1.2, self.youngs_modulus / 2.6

    def MEMBER(self, space, Params):
        real, tensor = space.scalar, space.tensor

        @wp.func
        def law(ARGUMENTS) -> tensor:
            return RESULT

        return law
"""
RATE = LAW.replace("MEMBER", "rate").replace("ARGUMENTS", "p: Params, stress: tensor, L: tensor")
TOTAL = LAW.replace("MEMBER", "stress").replace("ARGUMENTS", "p: Params, H: tensor")
# Without a total law the return to the yield surface is of the same kind of function.
BACK = RATE.replace("RESULT", "p.elastic_shear * (L + wp.transpose(L))") + LAW.replace("MEMBER", "project").replace(
    "ARGUMENTS", "p: Params, stress: tensor"
).partition("    def project")[2].join(("    def project", ""))

METHODS = [
    ("leapfrog", "stress-points"),
    ("leapfrog", "total-lagrangian"),
    ("leapfrog", "updated-lagrangian"),
    ("rk4", "total-lagrangian"),
    ("tsph", "small-strain"),
    ("ul-tsph", "updated-lagrangian"),
]
WHO = r"material 'broken' \(fault-inside 4.2\)"


def scene(method: tuple[str, str], model: str, **run: Any) -> wsph.Scene:
    """A block that stretches."""
    keys = {"integrator": method[0], "formulation": method[1], "end": 0.3, "cfl": 0.3, **run}
    return scenes.block(2, 4, run=keys, velocity=["x", "0"], material=scenes.material(model))


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_law_that_does_not_compile_is_its_materials(method: tuple[str, str], here: Path) -> None:
    install(here, "fault-inside", "material", f"uncompiled_{METHODS.index(method)}", RATE.replace("RESULT", "L + 1"))
    with pytest.raises(PluginError, match=rf"{WHO}: its code fails .*expected rate\(self, space, Params\)"):
        wsph.run(scene(method, "broken"))


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_law_that_gives_nan_is_named(method: tuple[str, str], here: Path) -> None:
    """At set-up where a limit asks the law, in the run where none does."""
    code = RATE.replace("RESULT", "L * (real(0.0) / real(0.0))")
    install(here, "fault-inside", "material", f"nan_{METHODS.index(method)}", code)
    with pytest.raises((PluginError, Unstable), match=rf"{WHO}: its `rate` gives numbers that are not finite") as said:
        wsph.run(scene(method, "broken"))
    assert isinstance(said.value, Unstable) == (method[0] in ("tsph", "ul-tsph"))


@pytest.mark.parametrize("form", scenes.FORMS)
@pytest.mark.parametrize(("result", "words"), [("H + 1", "its code fails"), ("H * (real(0.0) / real(0.0))", "its `stress` gives numbers")], ids=["code", "nan"])  # fmt: skip
def test_so_is_a_total_law(form: str, result: str, words: str, here: Path) -> None:
    module = f"total_{scenes.FORMS.index(form)}_{len(result)}"
    install(here, "fault-inside", "material", module, TOTAL.replace("RESULT", result))
    with pytest.raises(PluginError, match=f"{WHO}: {words}"):
        wsph.run(scene(("leapfrog", form), "broken"))


@pytest.mark.filterwarnings("ignore:.*where it yields beside free and loaded faces")
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_so_is_a_way_back_to_the_yield_surface(method: tuple[str, str], here: Path) -> None:
    code = BACK.replace("RESULT", "stress * (real(0.0) / real(0.0))")
    install(here, "fault-inside", "material", f"back_{METHODS.index(method)}", code)
    with pytest.raises(Unstable, match=rf"is not finite, because of {WHO}: its `project` gives numbers"):
        wsph.run(scene(method, "broken"))


@pytest.mark.parametrize("method", METHODS[:2] + METHODS[4:], ids=str)
def test_a_law_that_fails_where_it_is_strained_is_named_too(method: tuple[str, str], here: Path) -> None:
    """At the stresses that the body has."""
    result = (
        "p.elastic_shear * (L + wp.transpose(L)) / wp.where(wp.abs(stress[0, 0]) > real(1e-2), real(0.0), real(1.0))"
    )
    install(here, "fault-inside", "material", f"strained_{METHODS.index(method)}", RATE.replace("RESULT", result))
    with pytest.raises(Unstable, match=f"is not finite, because of {WHO}"):
        wsph.run(scene(method, "broken"))


METHOD = """
class Plugin:
    sets, formulations, order, evaluations = SETS, FORMS, 1, 1

    def __init__(self, system):
        self.system, self.state, self.k = system, system.state, system.new()
        self.other = system.new()

    def limit(self):
        return LIMIT, "of the plugin"

    def step(self):
        s, y = self.system, self.state
        STEP
"""
GOOD = "s.rate(y, self.k); s.combine(y, plain=[(1.0, y)], timed=[(1.0, self.k)]); s.accept(y)"
ONE = [form for _, form in METHODS[:3]]
HALF = "h = s.new('virtual') if not hasattr(self, 'h') else self.h; self.h = h; s.half_step(y, h, 0.5); "


def method(step: str, limit: str = "0.5", form: str = "total-lagrangian", sets: int = 1) -> str:
    """The code of a method."""
    changes = {"SETS": str(sets), "FORMS": repr((form,)), "LIMIT": limit, "STEP": step}
    code = METHOD
    for key, value in changes.items():
        code = code.replace(key, value)
    return code


@pytest.mark.parametrize("limit", ["float('nan')", "-1.0", "'big'"])
def test_a_limit_that_is_no_number_is_named(limit: str, here: Path) -> None:
    install(here, "fault-inside", "integrator", f"limit_{len(limit)}", method(GOOD, limit))
    with pytest.raises(
        PluginError, match=r"integrator 'broken' \(fault-inside 4.2\): limit\(\) gives .*: a Courant number"
    ):
        wsph.run(scene(("broken", "total-lagrangian"), "elastic"))


SCRATCH = "s.rate(y, self.k); s.combine(self.other, plain=[(1.0, y)], timed=[(1.0, self.k)]); s.accept(self.other)"
STEPS = {
    "scratch": (SCRATCH, r"step\(\) accepts a scratch state"),
    "nothing": ("pass", r"step\(\) never calls accept"),
    "no accept": (GOOD.replace("; s.accept(y)", ""), r"step\(\) never calls accept"),
    "no advance": ("s.rate(y, self.k); s.accept(y)", r"step\(\) changes nothing of the state"),
    "advanced scratch": (SCRATCH.replace("accept(self.other)", "accept(y)"), r"step\(\) changes nothing of the state"),
}
TWO_STEPS = {
    "scratch": (HALF + "s.rate(h, self.other, imposed=y, weight=1.0); s.accept(self.other)", STEPS["scratch"][1]),
    "nothing": ("pass", STEPS["nothing"][1]),
    "no advance": (HALF + "s.accept(y)", STEPS["no advance"][1]),
}


@pytest.mark.parametrize("form", ONE)
@pytest.mark.parametrize("fault", list(STEPS))
def test_a_step_that_leaves_the_state_as_it_is_is_named(fault: str, form: str, here: Path) -> None:
    step, words = STEPS[fault]
    install(
        here,
        "fault-inside",
        "integrator",
        f"step_{list(STEPS).index(fault)}_{ONE.index(form)}",
        method(step, form=form),
    )
    with pytest.raises(PluginError, match=rf"integrator 'broken' \(fault-inside 4.2\): {words}"):
        wsph.run(scene(("broken", form), "elastic"))


@pytest.mark.parametrize("form", ["small-strain", "updated-lagrangian"])
@pytest.mark.parametrize("fault", list(TWO_STEPS))
def test_so_it_is_on_two_sets(fault: str, form: str, here: Path) -> None:
    step, words = TWO_STEPS[fault]
    code = method(step, form=form, sets=2)
    install(here, "fault-inside", "integrator", f"two_{list(TWO_STEPS).index(fault)}_{len(form)}", code)
    with pytest.raises(PluginError, match=rf"integrator 'broken' \(fault-inside 4.2\): {words}"):
        wsph.run(scene(("broken", form), "elastic"))


@pytest.mark.parametrize("form", ONE)
def test_a_step_without_a_fault_runs(form: str, here: Path) -> None:
    install(here, "fault-inside", "integrator", f"good_{ONE.index(form)}", method(GOOD, form=form))
    assert wsph.run(scene(("broken", form), "elastic")).status == "completed"
