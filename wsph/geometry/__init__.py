"""Where particles are: shapes, the grid that cuts them, nodes, cells, faces and cracks, cells fitted to the surface. numpy,
in metres; Warp says what is inside of triangles."""
