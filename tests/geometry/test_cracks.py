"""Cracks: cuts along lines of the grid."""

import numpy as np
import pytest

from tests.scenes import box, shape
from wsph.geometry.lattice import lattice

SQUARE = box(4.0, 4.0)


class TestCracks:
    """Cuts along lines of the grid."""

    def test_nodes_are_there_for_each_side_but_the_tip(self) -> None:
        body = lattice(shape(**SQUARE), 0.5, jitter=0.2, cracks=(((-1.0, 2.0), (2.0, 2.0)),))
        whole = lattice(shape(**SQUARE), 0.5, jitter=0.2)
        assert len(body.nodes) == len(whole.nodes) + 4
        places, count = np.unique(body.nodes, axis=0, return_counts=True)
        assert (places[count == 2][:, 1] == 2.0).all()
        assert places[count == 2][:, 0].max() < 2.0
        assert len(body.faces.area) == len(whole.faces.area) + 8
        assert body.faces.outer.sum() == len(whole.faces.area)
        assert body.node_volume.sum() == pytest.approx(16.0)

    def test_no_pair_reaches_through(self) -> None:
        body = lattice(shape(**SQUARE), 0.5, cracks=(((-1.0, 2.0), (2.0, 2.0)),))
        nodes, cells = body.off_cracks
        first, second = (np.repeat(cells, len(nodes), 0), np.tile(nodes, (len(cells), 1)))
        apart = body.crossed(first, second)
        # By hand: opposite sides of the line y = 4 cells, crossing it at x < 4 cells.
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (4.0 - first[:, 1]) / (second[:, 1] - first[:, 1])
            at = first[:, 0] + share * (second[:, 0] - first[:, 0])
        np.testing.assert_array_equal(apart, (share > 0.0) & (share < 1.0) & (at <= 4.0))
        assert apart.any()

    def test_in_three_dimensions_it_is_a_rectangle(self) -> None:
        cube = shape(type="box", min=[0.0] * 3, max=[1.0] * 3)
        body = lattice(cube, 0.25, cracks=(((0.0, 0.0, 0.5), (0.5, 1.0, 0.5)),))
        assert len(body.nodes) == 125 + 2 * 5
        assert len(body.faces.area) == 96 + 2 * 8

    @pytest.mark.parametrize(
        ("ends", "message"),
        [
            (((0.0, 1.9), (2.0, 1.9)), "lies at y = 1.9 m between the cells' sides at 1.5 m and 2 m"),
            (((0.0, 2.0), (1.7, 2.0)), "ends at x = 1.7 m between the particles at 1.5 m and 2 m"),
            (((0.0, 0.0), (2.0, 2.0)), "a crack in a body with particles on its faces runs along a side of the cells"),
        ],
    )
    def test_off_the_lines_it_is_refused_unless_nothing_is_split(self, ends: tuple, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            lattice(shape(**SQUARE), 0.5, cracks=(ends,))
        assert len(lattice(shape(**SQUARE), 0.5, cracks=(ends,), split=False).nodes) == 81

    def test_one_that_parts_nothing_is_refused(self) -> None:
        for split in (True, False):
            with pytest.raises(ValueError, match=r"from and to \[5.0, 2.0\], \[6.0, 2.0\] part no cells of the body"):
                lattice(shape(**SQUARE), 0.5, cracks=(((5.0, 2.0), (6.0, 2.0)),), split=split)
