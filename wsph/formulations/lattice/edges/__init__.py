"""Nodes of equal cells that see each other along the edges of these."""
