"""wsph: solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp."""

# pyright: strict

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wsph.errors import OutputError, PluginError, Refused, SceneError, Unstable, WsphError
    from wsph.scene.load import load
    from wsph.scene.scene import Scene
    from wsph.simulation.compose import compose
    from wsph.simulation.result import Result
    from wsph.simulation.run import run
    from wsph.simulation.stepping import Simulation

__version__: str
__all__ = [
    "OutputError",
    "PluginError",
    "Refused",
    "Result",
    "Scene",
    "SceneError",
    "Simulation",
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
    "Simulation": "simulation.stepping",
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
        return getattr(import_module(f"wsph.{_HOME.get(name, 'errors')}"), name)
    raise AttributeError(f"module 'wsph' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
