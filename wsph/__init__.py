"""wsph: solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp."""

from importlib.metadata import version as _version

import warp as _warp

# Warp greets and names every module it loads otherwise; a run's log belongs to the run.
_warp.config.log_level = _warp.LOG_ERROR

from wsph.driver import Result, run  # noqa: E402
from wsph.errors import OutputError, PluginError, Refused, SceneError, Unstable, WsphError  # noqa: E402
from wsph.scene import Scene, load  # noqa: E402

__version__ = _version("wsph")
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
