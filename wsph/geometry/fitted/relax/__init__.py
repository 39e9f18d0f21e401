"""Nodes moved to where the cells are best: first to the mean of their neighbours, then to where cells are most like cubes."""
