"""Bodies whose points see the corners of equal cells: rows that follow from the lattice, without lists of pairs."""
