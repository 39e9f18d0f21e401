"""Bodies of cells of any kind, and the files that they come from."""
