"""Bodies of equal cells whose points see the corners of these, or each other along their edges: rows that follow from the
lattice, without lists of pairs."""
