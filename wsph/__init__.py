"""wsph: solid mechanics by smoothed particle hydrodynamics on NVIDIA Warp.

scene = wsph.load("bar.toml")            # or wsph.Scene(schema=1, dim=1, ...): the same keys, of tables or of objects
result = wsph.run(scene)                 # or wsph.Simulation(scene), which steps
result.probes["end"]["stress_xx"], result.plot("von_mises")
"""

# pyright: strict

import gc
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wsph.boundary.programs.functions import Function
    from wsph.boundary.tables import Boundary
    from wsph.errors import OutputError, PluginError, Refused, SceneError, Unstable, WsphError
    from wsph.geometry.shapes.ball import Ball
    from wsph.geometry.shapes.box import Box
    from wsph.geometry.shapes.combined import Combined
    from wsph.geometry.shapes.cylinder import Cylinder
    from wsph.geometry.shapes.polygon import Polygon
    from wsph.geometry.shapes.ring import Ring
    from wsph.geometry.shapes.stl import Stl
    from wsph.plugins.options import material
    from wsph.scene.load import load
    from wsph.scene.numbers import Section
    from wsph.scene.outputs import Checkpoint, Output
    from wsph.scene.probes import Probe
    from wsph.scene.scene import Scene
    from wsph.scene.tables import Body, Run
    from wsph.scene.touch.contact import Contact
    from wsph.scene.touch.tools import Tool
    from wsph.simulation.compose import compose
    from wsph.simulation.result import Result
    from wsph.simulation.run import run
    from wsph.simulation.stepping.simulation import Simulation

__version__: str
__all__ = [
    "Ball",
    "Body",
    "Boundary",
    "Box",
    "Checkpoint",
    "Combined",
    "Contact",
    "Cylinder",
    "Function",
    "Output",
    "OutputError",
    "PluginError",
    "Polygon",
    "Probe",
    "Refused",
    "Result",
    "Ring",
    "Run",
    "Scene",
    "SceneError",
    "Section",
    "Simulation",
    "Stl",
    "Tool",
    "Unstable",
    "WsphError",
    "__version__",
    "compose",
    "load",
    "material",
    "run",
]

_HOME = {
    "Ball": "geometry.shapes.ball",
    "Body": "scene.tables",
    "Boundary": "boundary.tables",
    "Box": "geometry.shapes.box",
    "Checkpoint": "scene.outputs",
    "Combined": "geometry.shapes.combined",
    "Contact": "scene.touch.contact",
    "Cylinder": "geometry.shapes.cylinder",
    "Function": "boundary.programs.functions",
    "Output": "scene.outputs",
    "Polygon": "geometry.shapes.polygon",
    "Probe": "scene.probes",
    "Result": "simulation.result",
    "Ring": "geometry.shapes.ring",
    "Run": "scene.tables",
    "Scene": "scene.scene",
    "Section": "scene.numbers",
    "Simulation": "simulation.stepping.simulation",
    "Stl": "geometry.shapes.stl",
    "Tool": "scene.touch.tools",
    "compose": "simulation.compose",
    "load": "scene.load",
    "material": "plugins.options",
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
            home = _HOME.get(name, "errors")
            if home.startswith(("geometry.", "boundary.")):
                import_module("wsph.scene.scene")  # which says what is wrong with a table in the words of scenes
            return getattr(import_module(f"wsph.{home}"), name)
        finally:
            if looks:
                gc.freeze()
                gc.enable()
    raise AttributeError(f"module 'wsph' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
