"""The lattice that a body of a scene asks for."""

# pyright: strict

import numpy as np

from wsph.errors import Fault, SceneError
from wsph.expressions import compile_expression
from wsph.geometry.lattice import Lattice, lattice
from wsph.scene.tables import Body


def lattice_of(body: Body, number: int, seed: int, split: bool) -> Lattice:
    """The lattice of a scene's body, the `number`-th. `split`: cracks part the particles on them. Raises SceneError where
    the shape holds no cell, or a crack or a map does not fit it."""
    cracks = tuple((crack.start, crack.end) for crack in body.cracks)
    expressions = [compile_expression(text) for text in body.map or ()]

    def mapped(points: np.ndarray) -> np.ndarray:
        return np.stack([expression(points) for expression in expressions], 1)

    try:
        return lattice(body.shape, body.spacing, body.jitter, seed, lattice_rotate=body.lattice_rotate, cracks=cracks,
                       split=split, map=mapped if expressions else None)  # fmt: skip
    except ValueError as error:
        key = "spacing" if "no cell" in str(error) else "map" if "the map" in str(error) else "cracks"
        raise SceneError("scene", [Fault(0, f"bodies.{number}.{key}", str(error))]) from None
