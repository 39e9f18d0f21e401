"""wsph: solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wsph.driver import run
    from wsph.errors import OutputError, PluginError, Refused, SceneError, Unstable, WsphError
    from wsph.result import Result
    from wsph.scene import Scene, load

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
    "load",
    "run",
]

_HOME = {"Result": "result", "run": "driver", "Scene": "scene", "load": "scene"}


def __getattr__(name: str) -> Any:
    # On demand: `wsph list` and an interrupt during start-up need not wait for Warp to be imported.
    if name == "__version__":
        return import_module("importlib.metadata").version("wsph")
    if name in __all__:
        return getattr(import_module(f"wsph.{_HOME.get(name, 'errors')}"), name)
    raise AttributeError(f"module 'wsph' has no attribute {name!r}")
