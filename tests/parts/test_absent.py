"""A part that a body does not have costs nothing: it is not allocated, not compiled, not launched; and what a part costs
is what `wsph check` tells of the scene with it and without."""

import inspect
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import warp as wp
from warp._src.context import ModuleBuilder, ModuleHasher

import wsph
from wsph.checking import described
from wsph.parts.table import PARTS
from wsph.plugins.formulations import of_sets
from wsph.simulation.compose import compose

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "kernels"))
from parts import FORMS, block
from scenes import kernels_of

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")

SETTINGS: dict[str, Any] = {
    "viscosity": {"alpha": 0.5, "beta": 0.5},
    "residual": {"coefficient": 0.1},
    "hourglass": {"coefficient": 0.1},
    "artificial_stress": {},
    "phase_field": {"fracture_energy": 1e-3, "length": 0.25},
    "links": {"criterion": "principal-stress", "threshold": 0.01},
    "damping": {"rate": 1.0},
}
FILES = {
    "damping": ("wsph.parts.body_force_work",),
    "residual": (
        "wsph.sph.misfit",
        "wsph.formulations.lagrangian.held_energy",
        "wsph.formulations.lattice.held",
        "wsph.formulations.lattice.edges.held",
        "wsph.formulations.updated.memory",
    ),
}
"""Modules of what has nothing on the device in a file of its own; of others it is theirs and, of a folder, all in it."""
PARTICLES = 81
"""Of the block, at most."""
TRAITS = {name: each.traits for name, each in of_sets(1).items()}
CASES = [(name, form) for name in SETTINGS for form in FORMS if name not in PARTS or PARTS[name].fits(TRAITS[form])]


def scenes(part: str, form: str) -> tuple[wsph.Scene, wsph.Scene]:
    """A block with the part and without it."""
    plain: dict[str, Any] = {"residual": False} | ({"placement": "cells"} if form == "total-lagrangian" else {})
    keys: dict[str, Any] = {"form": form, "material": "jaumann" if part == "links" else "elastic", "run": {"end": 2.0}}
    return block(body=plain | {part: SETTINGS[part]}, **keys), block(body=plain, **keys)


def rooms(kernels: list[wp.Kernel]) -> set[str]:
    """Python modules of the kernels and of all functions in them."""
    found: set[str] = set()
    for kernel in kernels:
        kernel.module.get_module_hash()
        options = kernel.module.resolve_options(wp.config, block_dim=1) | {"output_arch": None}
        builder = ModuleBuilder(kernel.module, options, hasher=ModuleHasher([kernel], options), target="cpu")
        found |= {kernel.func.__module__} | {
            each.func.__module__ for each in builder.functions if each.func is not None
        }
    return found


def own(part: str, names: set[str]) -> set[str]:
    """Of modules those of a part."""
    mine = FILES.get(part) or (PARTS[part].__module__.removesuffix(".part"),)
    return {name for name in names if any(name == one or name.startswith(f"{one}.") for one in mine)}


@contextmanager
def allocated() -> Iterator[dict[int, tuple[int, set[str]]]]:
    """Bytes of the arrays that are allocated on the CPU within it and live, and the modules that asked for them, by their
    address."""
    live: dict[int, tuple[int, set[str]]] = {}
    allocator = type(wp.get_device("cpu").default_allocator)
    allocate, free = allocator.allocate, allocator.deallocate

    def noting(self: Any, size: int) -> int:
        address = allocate(self, size)
        live[address] = size, {frame.frame.f_globals.get("__name__", "") for frame in inspect.stack(0)}
        return address

    def forgetting(self: Any, address: int, size: int) -> None:
        live.pop(address, None)
        free(self, address, size)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(allocator, "allocate", noting)
        patch.setattr(allocator, "deallocate", forgetting)
        yield live


@dataclass
class Measured:
    """Kernels that a step launches, bytes that a composition holds, modules that asked for them, and a run's summary."""

    launched: list[str]
    held: int
    askers: set[str]
    summary: Any

    @classmethod
    def of(cls, scene: wsph.Scene) -> "Measured":
        """Compose and run a scene."""
        with allocated() as live:
            composition = compose(scene)
            launched = [kernel.func.__name__ for kernel in composition.launches()]
            found = list(live.values())
        askers = {name for _, names in found for name in names}
        return cls(launched, sum(size for size, _ in found), askers, wsph.run(scene, throw=False).summary)


def told(scene: wsph.Scene) -> tuple[int, int, float, int]:
    """What `wsph check` says: launches and steps, device bytes and pairs."""
    rows = dict(described(scene, "block"))
    particles, pairs, each = map(int, re.match(r"(\d+), (\d+) pairs, (\d+) bytes", rows["  particles"]).groups())  # type: ignore[union-attr]
    launches = int(re.search(r"in (\d+) launches", rows["kernels"])[1])  # type: ignore[index]
    steps = int(re.search(r", (\d+) steps to", rows["time step"])[1])  # type: ignore[index]
    return launches, steps, float(particles * each), pairs


@pytest.mark.parametrize(("part", "form"), CASES)
def test_an_absent_part_is_neither_compiled_nor_launched(part: str, form: str) -> None:
    with_it, without = scenes(part, form)
    there, gone = (rooms(kernels_of(scene)) for scene in (with_it, without))
    assert own(part, there), "the part itself has something on the device"
    assert not own(part, gone)
    assert own(part, there) <= there - gone


@pytest.mark.parametrize(("part", "form"), CASES)
def test_what_a_part_costs_is_what_is_told(part: str, form: str) -> None:
    """Bytes to a tenth, of the arrays that were allocated, and none of them by the part where it is absent; work and
    launches as they are."""
    with_it, without = scenes(part, form)
    made = [Measured.of(scene) for scene in (with_it, without)]
    said = [told(scene) for scene in (with_it, without)]
    for (launches, steps, _, pairs), each in zip(said, made, strict=True):
        assert launches == len(each.launched)
        assert pairs * steps == pytest.approx(each.summary["pairs"] * each.summary["right_hand_sides"], rel=0.1)
    # Bytes of a particle are told without decimals.
    assert said[0][2] - said[1][2] == pytest.approx(made[0].held - made[1].held, rel=0.1, abs=2.0 * PARTICLES)
    assert not own(part, made[1].askers)


def test_every_part_is_looked_at() -> None:
    assert set(SETTINGS) >= set(PARTS)


@pytest.mark.parametrize("law", ["surface", "pinball"])
def test_without_contact_there_is_none_of_it(law: str) -> None:
    far = {"type": "box", "min": [1.2, 0.0], "max": [2.2, 1.0]}
    material = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.25}
    other = {"name": "other", "shape": far, "spacing": 0.125, "state": "strain", "material": material}
    with_it, without = (
        block(form="stress-points", bodies=[other], run={"end": 2.0}, **more)
        for more in ({"contact": [{"between": ["block", "other"], "law": law}]}, {})
    )
    there, gone = (
        {name for name in rooms(kernels_of(each)) if name.startswith("wsph.contact.")} for each in (with_it, without)
    )
    assert there > WATCHING
    assert gone <= WATCHING
    assert (
        not {name for name in Measured.of(without).askers if name.startswith("wsph.contact.")}
        - WATCHING
        - {
            "wsph.contact.table",  # which is asked for interactions, and has none to give
            "wsph.contact.overlap",
        }
    )


WATCHING = {"wsph.contact.watch"}
"""What looks, between checks, whether bodies that nothing keeps apart go through each other."""
