"""Where particles are: shapes, the grid that cuts them, nodes, cells, faces and cracks. numpy, in metres."""
