"""Shapes: the volumes of what is filled, turned or not."""

import numpy as np
import pytest

from tests.scenes import box, shape
from wsph.geometry.lattice import lattice

SQUARE = box(4.0, 4.0)


@pytest.mark.parametrize(
    ("data", "volume"),
    [
        ({"type": "disc", "center": [0.3, 0.1], "radius": 1.0}, np.pi),
        ({"type": "ring", "center": [0.0, 0.0], "inner": 0.5, "outer": 1.0}, 0.75 * np.pi),
        ({"type": "polygon", "points": [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]}, 1.0),
        ({"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}, 4.0 / 3.0 * np.pi),
        ({"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 1.0, 1.0], "radius": 0.5}, np.pi / 4.0 * 2**0.5),
        ({"type": "union", "shapes": [SQUARE, box((3.0, 6.0), (3.0, 5.0))]}, 21.0),
    ],
    ids=lambda v: v["type"] if isinstance(v, dict) else "",
)  # fmt: skip
def test_volumes_of_shapes(data: dict, volume: float) -> None:
    for turned in ({}, {"rotate": 30.0 if len(shape(**data).bounds()[0]) == 2 else [[1, 2, 2], 30.0]}):
        assert lattice(shape(**data, **turned), 0.05).cell_volume.sum() == pytest.approx(volume, rel=0.03)
