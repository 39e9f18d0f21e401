"""What a particle of one set sums up over those of the other that it sees: by lists, and by rows of the lattice."""
