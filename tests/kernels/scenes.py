"""The scenes whose kernels are looked at, and the kernels that each of them uses.

Shared by the scripts of this folder. They go by what the package gives publicly, so that they say the same of it before and
after its modules are moved about.
"""

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import warp as wp

import wsph

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "extremes"))
sys.path.insert(0, str(Path(__file__).parent))
import grid
from parts import block, parts

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PRECISIONS = ("f64", "f32")
SET_UP = {"device": "cpu", "guard": "off"}
"""Keys of every scene. Its time step is not looked into: that composes scenes in single precision once more in double."""
COARSER = {"twisting_column": {"bodies.0.spacing": 0.25}, "taylor_bar": {"bodies.0.spacing": "1.296 mm"}}
"""Examples that take long to set up, with fewer particles: their kernels are the same."""

Scenes = Iterator[tuple[str, Callable[[], wsph.Scene]]]
"""Names of scenes, and what makes them."""


def _example(path: Path, precision: str) -> wsph.Scene:
    return wsph.load(path).with_(precision=precision, **SET_UP, **COARSER.get(path.stem, {}))


def _case(case: grid.Case, precision: str) -> wsph.Scene:
    return grid.scene(case, precision, 1e-3, grid._UNITS[case["size"]][1]).with_(**SET_UP)


def example_scenes() -> Scenes:
    """The shipped examples, in both precisions."""
    for path in sorted(EXAMPLES.glob("*.toml")):
        for precision in PRECISIONS:
            yield f"{path.stem} {precision}", partial(_example, path, precision)


def part_scenes() -> Scenes:
    """Small scenes of parts that the others have little of, in double precision."""
    for name, keys in parts().items():
        yield f"part: {name}", partial(block, **keys)


def all_scenes() -> Scenes:
    """The examples, the parts, and the pairwise grid of the extremes in both precisions."""
    yield from example_scenes()
    yield from part_scenes()
    for case in grid.cases():
        for precision in PRECISIONS:
            yield f"{case.number}. {case} {precision}", partial(_case, case, precision)


@contextmanager
def _noted() -> Iterator[dict[wp.Kernel, None]]:
    """The kernels that are launched or loaded in advance. From the first such load on, with which a run's set-up is over,
    none is compiled and none is run: what is launched is noted."""
    found: dict[wp.Kernel, None] = {}
    launch, setting_up = wp.launch, True

    def noting_launch(kernel: wp.Kernel, *arguments: Any, **keywords: Any) -> Any:
        found[kernel] = None
        return launch(kernel, *arguments, **keywords) if setting_up else None

    def noting_load(*arguments: Any, modules: list[wp.Module], **keywords: Any) -> None:
        nonlocal setting_up
        setting_up = False
        for module in modules:
            found.update(dict.fromkeys(module.kernels.values()))

    force_load, wp.launch, wp.force_load = wp.force_load, noting_launch, noting_load
    try:
        yield found
    finally:
        wp.launch, wp.force_load = launch, force_load


def kernels_of(scene: wsph.Scene) -> list[wp.Kernel]:
    """The kernels that a scene is set up with, steps with, is measured and read with: those of a run of one step, of which
    the set-up alone is carried out. Raises what composing the scene raises."""
    with warnings.catch_warnings(), _noted() as found:
        warnings.simplefilter("ignore")
        if scene.steps:
            short = [{**stage, "duration": 1e-30} for stage in scene.data()["steps"]]
            wsph.run(scene, steps=short, throw=False)
        else:
            wsph.run(scene, end=1e-30, throw=False)
    return list(found)
