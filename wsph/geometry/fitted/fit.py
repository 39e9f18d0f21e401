"""A fitted body: cells of the grid well inside, one layer of cells from there to the surface, and nodes on the surface.

The steps: a grid with lines on the planes that it can meet; layers for all other patches, and for those that a layer goes on
along; cells that leave room for them; their surface made one sheet; sides told which patch they stand for; the layer; nodes
moved onto their patches, edges and corners; nodes smoothed; and a look at what has come of it.
"""

# pyright: strict

import numpy as np

from wsph.geometry.fitted.chains import joined, side_names
from wsph.geometry.fitted.cleaning import cleaned
from wsph.geometry.fitted.core import kept_cells
from wsph.geometry.fitted.gate import check
from wsph.geometry.fitted.junctions import junctions
from wsph.geometry.fitted.labels import label_sides
from wsph.geometry.fitted.layer import Cells, boxes_first, grid_cells, with_layer
from wsph.geometry.fitted.outline import outline
from wsph.geometry.fitted.planning import plan_layers
from wsph.geometry.fitted.projection import Projection
from wsph.geometry.fitted.relax.smoothing import smoothed
from wsph.geometry.fitted.walls import check_walls
from wsph.geometry.meshes.mesh import Mesh
from wsph.geometry.shapes.combined import Shape


def fit(shape: Shape, spacing: float | tuple[float, ...], seed: int = 0) -> Mesh:
    """Quadrilaterals or hexahedra that fill `shape`, some `spacing` [m] large, with nodes on its surface, edges and corners.

    Where the surface lies on the grid the cells are those of a lattice; elsewhere a layer of cells goes to it. Sides are
    turned outward: the normal is to the right of one in 2D, and (c - a) x (b - a) of nodes a, b, c, ... in 3D. Cells that
    are the grid's stand first. `seed` is
    that of the halves that the smoothing of labels waits with. Raises ValueError, with the place, for a wall too thin for
    its layers and wherever cells, corners, areas or the volume are not those of a body; for a shape in 1D, and for a
    spacing that is not one for all axes.
    """
    steps = np.ravel(spacing)
    if shape.dim == 1 or (steps != steps[0]).any():
        raise ValueError(
            f"a fitted surface needs 2 or 3 dimensions and one spacing, not {shape.dim} and {steps.tolist()} m"
        )
    body = outline(shape, float(steps[0]))
    body, edges = joined(body, junctions(body))
    plan = plan_layers(body, edges)
    check_walls(body, plan)
    kept = cleaned(kept_cells(body, plan), body, plan)
    if not kept.any():
        raise ValueError(
            f"{body.spacing:g} m leaves no cells inside the shape, between the layers on its surface: choose a smaller spacing"
        )
    cells, normals = grid_cells(kept, plan)
    label = label_sides(body, cells.nodes[cells.sides].mean(1), normals, cells.sides, seed)
    first = len(cells.corners)
    cells = with_layer(Cells(cells.nodes, cells.corners, cells.sides, cells.owner, label), plan.layered)
    labels = cells.on(len(body.patches))
    seams = [(edge.first, edge.second) for edge in edges if edge.seam]
    onto = Projection(labels, body.patches, body.spacing, seams)
    nodes = cells.nodes.copy()
    onto.onto(nodes)
    if plan.layered.any():
        nodes = smoothed(nodes, cells, labels, first, onto, body.spacing)
        onto.onto(nodes)
    check(body, edges, cells, nodes, onto.missed(nodes))
    patch, names = side_names(body, cells.label, nodes[cells.sides].mean(1))
    cells, boxes = boxes_first(cells, nodes, first, plan, shape.axes)
    if shape.rotate != 0.0:
        nodes = shape.middle + (nodes - shape.middle) @ shape.axes.T
    return Mesh(nodes, (cells.corners,), cells.sides, cells.owner, patch, names, boxes=boxes)
