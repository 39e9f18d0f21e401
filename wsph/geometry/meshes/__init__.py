"""Bodies of cells of any kind, or of particles alone, and the files that they come from."""
