"""wsph: solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp."""

# pyright: strict

import gc
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wsph.errors import OutputError, PluginError, Refused, SceneError, Unstable, WsphError
    from wsph.scene.load import load
    from wsph.scene.scene import Scene
    from wsph.simulation.compose import compose
    from wsph.simulation.result import Result
    from wsph.simulation.run import run

__version__: str
__all__ = [
    "OutputError",
    "PluginError",
    "Refused",
    "Result",
    "Scene",
    "SceneError",
    "Unstable",
    "WsphError",
    "__version__",
    "compose",
    "load",
    "run",
]

_HOME = {
    "Result": "simulation.result",
    "Scene": "scene.scene",
    "compose": "simulation.compose",
    "load": "scene.load",
    "run": "simulation.run",
}
"""Modules of the public names; the others are errors."""


def __getattr__(name: str) -> object:
    # On demand: `wsph list` and an interrupt during start-up need not wait for Warp to be imported.
    if name == "__version__":
        return import_module("importlib.metadata").version("wsph")
    if name in __all__:
        looks = gc.isenabled()
        gc.disable()  # nothing of an import is garbage, and looking for it again and again takes a fifth of a start
        try:
            return getattr(import_module(f"wsph.{_HOME.get(name, 'errors')}"), name)
        finally:
            if looks:
                gc.freeze()
                gc.enable()
    raise AttributeError(f"module 'wsph' has no attribute {name!r}")
