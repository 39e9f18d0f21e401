"""What is known of a scene before it runs: its lattices (`lattices`, `staircases`), the work of each (`cost`, `rate`), and
the order in the spacing that its errors can fall with (`formal`, by its `jumps`)."""
